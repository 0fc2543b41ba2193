// What is told beside the picture: names and how probable they are, now and through time, and figures.

const MOST_BARS = 8;

class Panel {
  constructor(recorded, seek) {
    this.recorded = recorded;
    this.course = document.getElementById("course");
    const to = (event) => {
      if (event.buttons !== 1 || !recorded.states.length) return;
      const box = this.course.getBoundingClientRect();
      seek((event.clientX - box.left) / box.width * this.whole());
    };
    this.course.addEventListener("pointerdown", to);
    this.course.addEventListener("pointermove", to);
  }

  /** s, of what is drawn through time. */
  whole() {
    const {scene, states} = this.recorded;
    return Math.max(this.recorded.end ? 0 : scene.seconds || 0, states.length ? states[states.length - 1].time : 0, 1e-9);
  }

  begin() {
    const {scene} = this.recorded;
    document.title = `${scene.title} · Haptic SLAM`;
    document.getElementById("title").textContent = scene.title;
    for (const [name, colour] of Object.entries({
      hand: scene.colours.hand, ghosts: scene.colours.ghosts + "77", touch: scene.colours.touch, truth: scene.colours.truth,
      map: `linear-gradient(90deg, ${scene.colours.map.join()})`, surface: `linear-gradient(90deg, ${scene.colours.surface.join()})`,
    })) document.querySelector(`#layers i.${name}`).style.background = colour;
    document.getElementById("truth-label").hidden = true;
    const box = document.getElementById("show-surface");
    box.disabled = scene.no_surface !== null;
    box.closest("label").classList.toggle("off", box.disabled);
    if (box.disabled) document.getElementById("surface-told").textContent = `(${scene.no_surface})`;
    this.rows = null;
  }

  /** The candidates that have bars: all, or of many those that are the most probable. */
  chosen(posterior) {
    const all = posterior.map((_, k) => k);
    if (all.length <= MOST_BARS) return all;
    return all.sort((a, b) => posterior[b] - posterior[a] || a - b).slice(0, MOST_BARS);
  }

  bars(state, truth) {
    const {scene} = this.recorded, place = document.getElementById("bars"), chosen = this.chosen(state.posterior);
    if (!this.rows || this.rows.length !== chosen.length) {
      const make = (kind, ...children) => {
        const made = document.createElement("div");
        made.className = kind;
        made.append(...children);
        return made;
      };
      this.rows = chosen.map(() => {
        const [name, fill, told] = ["name", "fill", "told"].map((kind) => make(kind));
        return {row: make("bar", name, make("track", fill), told), name, fill, told};
      });
      place.replaceChildren(...this.rows.map(({row}) => row));
    }
    chosen.forEach((k, at) => {
      const {row, name, fill, told} = this.rows[at], p = state.posterior[k];
      name.textContent = name.title = scene.labels[k];
      fill.style.width = `${100 * p}%`;
      fill.style.background = scene.label_colours[k];
      told.textContent = `${Math.round(100 * p)} %`;
      row.classList.toggle("true", Boolean(truth) && truth.label === k);
    });
  }

  figures(state) {
    const touching = state.touched.reduce((sum, each) => sum + each, 0), {scene} = this.recorded;
    const rows = [
      ["joints, SD", `${state.spread.toFixed(1)}°`],
      ["patches that touch", `${touching} of ${state.touched.length}`],
      ["particles that count", `${Math.round(state.n_eff)} of ${scene.particles}`],
    ];
    if (state.error !== null && this.told_truth) rows.push(["joints, error", `${state.error.toFixed(1)}°`]);
    const place = document.getElementById("figures");
    place.replaceChildren(...rows.flatMap((row) => row.map((text, column) => {
      const made = document.createElement(column ? "dd" : "dt");
      made.textContent = text;
      return made;
    })));
  }

  /** The posterior through time, up to now and beyond. */
  times(state, truth) {
    const {states, scene} = this.recorded, {course} = this, ratio = window.devicePixelRatio || 1;
    const [width, height] = [course.clientWidth, course.clientHeight];
    if (course.width !== width * ratio) { course.width = width * ratio; course.height = height * ratio; }
    const pen = course.getContext("2d"), whole = this.whole(), foot = 16;
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    const x = (time) => 1 + (width - 2) * time / whole, y = (p) => 3 + (height - foot - 6) * (1 - p);
    pen.lineWidth = 1;
    pen.strokeStyle = "#ddd";
    for (const p of [0, 0.5, 1]) { pen.beginPath(); pen.moveTo(0, y(p)); pen.lineTo(width, y(p)); pen.stroke(); }
    const stride = Math.max(1, Math.floor(states.length / width));
    for (const k of this.chosen(state.posterior)) {
      pen.strokeStyle = scene.label_colours[k];
      pen.lineWidth = truth && truth.label === k ? 3 : 1.6;
      pen.beginPath();
      for (let at = 0; at < states.length; at += stride) pen.lineTo(x(states[at].time), y(states[at].posterior[k]));
      pen.stroke();
    }
    pen.strokeStyle = "#222";
    pen.lineWidth = 1.2;
    pen.beginPath(); pen.moveTo(x(state.time), 0); pen.lineTo(x(state.time), height - foot); pen.stroke();
    pen.fillStyle = "#666";
    pen.font = "12px system-ui, 'DejaVu Sans', sans-serif";
    pen.textBaseline = "bottom";
    pen.textAlign = "left"; pen.fillText("0 s", 0, height);
    pen.textAlign = "right"; pen.fillText(`${Number(whole.toFixed(1))} s`, width, height);
  }

  show(state, truth) {
    this.told_truth = Boolean(truth);
    this.bars(state, truth);
    this.figures(state);
    this.times(state, truth);
  }
}
