// Turns about the middle of the map. Degrees, metres.

class Camera {
  constructor(canvas, changed) {
    this.first = -62;
    this.size = 0.13;
    this.reset();
    let held = null;
    canvas.addEventListener("pointerdown", (event) => {
      held = {x: event.clientX, y: event.clientY, moves: event.button === 2 || event.shiftKey};
      canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener("pointerup", () => { held = null; });
    canvas.addEventListener("pointercancel", () => { held = null; });
    canvas.addEventListener("pointermove", (event) => {
      if (!held) return;
      this.moved = true;
      const [dx, dy] = [event.clientX - held.x, event.clientY - held.y];
      Object.assign(held, {x: event.clientX, y: event.clientY});
      if (held.moves) {
        const [right, up] = this.axes(), scale = this.far() / canvas.clientHeight * 0.6;
        this.target = this.target.map((each, axis) => each + scale * (dy * up[axis] - dx * right[axis]));
      } else {
        this.azimuth -= 0.4 * dx;
        this.elevation = Math.min(89, Math.max(-89, this.elevation + 0.4 * dy));
      }
      changed();
    });
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.distance = Math.min(3, Math.max(-2.5, this.distance + 0.001 * event.deltaY));
      changed();
    }, {passive: false});
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
    canvas.addEventListener("dblclick", () => { this.reset(); changed(); });
  }

  begin(scene) {
    this.first = scene.azimuth;
    this.size = Math.max(...scene.extent);
    if (!this.moved) this.reset();
  }

  reset() { Object.assign(this, {azimuth: this.first, elevation: 22, distance: 0, target: [0, 0, 0], moved: false}); }

  /** Metres from the target. */
  far() { return 2.1 * this.size * 2 ** this.distance; }

  /** To the right, up, and towards the eye. */
  axes() {
    const [a, e] = [this.azimuth, this.elevation].map((each) => each * Math.PI / 180);
    const towards = [Math.cos(e) * Math.cos(a), Math.cos(e) * Math.sin(a), Math.sin(e)];
    const right = [-Math.sin(a), Math.cos(a), 0];
    return [right, cross(towards, right), towards];
  }

  view() {
    const [right, up, towards] = this.axes();
    const eye = this.target.map((each, axis) => each + this.far() * towards[axis]);
    return new Float32Array([
      right[0], up[0], towards[0], 0, right[1], up[1], towards[1], 0, right[2], up[2], towards[2], 0,
      -dot(right, eye), -dot(up, eye), -dot(towards, eye), 1,
    ]);
  }

  project(aspect) {
    const angle = 0.6 * Math.max(1, 1.1 / aspect);
    return perspective(angle, aspect, 0.02 * this.far(), 6 * this.far() + 2 * this.size);
  }
}
