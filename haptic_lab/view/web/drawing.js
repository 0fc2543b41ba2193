// What is drawn of one moment. Solid things first, then those that are seen through, the outermost last.

function drawnBySoftware() {
  const gl = document.createElement("canvas").getContext("webgl2");
  const told = gl && gl.getExtension("WEBGL_debug_renderer_info");
  return Boolean(told) && /swiftshader|llvmpipe|software|basic render/i.test(gl.getParameter(told.UNMASKED_RENDERER_WEBGL));
}

/** The first half of some hands of so many numbers each. */
function half(ends, each) { return ends.subarray(0, each * Math.ceil(ends.length / each / 2)); }

class Drawing {
  constructor(canvas) {
    this.canvas = canvas;
    // Kept so that the picture can be saved at any time. Without a graphics card smooth edges cost most of the time.
    const gl = this.gl = canvas.getContext("webgl2", {antialias: !drawnBySoftware(), preserveDrawingBuffer: true});
    if (!gl) throw new Error("this browser has no WebGL 2");
    this.programs = Object.fromEntries(Object.entries(SHADERS).map(([name, [v, f]]) => [name, this.program(v, f)]));
    this.buffers = {};
    this.corners = {}; // of triangles, in the buffers of faces
    this.touched = gl.createTexture();
    this.drawn = {}; // what the buffers hold
    this.hold("cube", true, cube);
    this.hold("capsule", true, () => capsule(10, 2));
    this.hold("coarse", true, () => capsule(7, 1));
    this.share = 1; // of the pixels along an edge that are drawn, but for a `sharp` picture
    this.few = false; // whether half of the ghosts do, but for that
    this.sharp = false;
  }

  program(vertex, fragment) {
    const gl = this.gl, made = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text.trim());
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
    const known = {made, attributes: {}, uniforms: {}};
    for (let k = 0; k < gl.getProgramParameter(made, gl.ACTIVE_ATTRIBUTES); k++) {
      const {name} = gl.getActiveAttrib(made, k);
      known.attributes[name] = gl.getAttribLocation(made, name);
    }
    for (let k = 0; k < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); k++) {
      const {name} = gl.getActiveUniform(made, k);
      known.uniforms[name.replace("[0]", "")] = gl.getUniformLocation(made, name);
    }
    return known;
  }

  buffer(values, kind = this.gl.ARRAY_BUFFER, old = null) {
    const buffer = old || this.gl.createBuffer();
    this.gl.bindBuffer(kind, buffer);
    this.gl.bufferData(kind, values, this.gl.DYNAMIC_DRAW);
    return buffer;
  }

  /** Fills a buffer of some name anew where its content is another one. */
  hold(name, content, make) {
    if (this.drawn[name] !== content) {
      this.drawn[name] = content;
      for (const [part, values] of Object.entries(make())) {
        const kind = part === "faces" ? this.gl.ELEMENT_ARRAY_BUFFER : this.gl.ARRAY_BUFFER;
        if (part === "faces") this.corners[name] = values.length;
        this.buffers[name + part] = this.buffer(values, kind, this.buffers[name + part]);
      }
    }
  }

  use(name, uniforms) {
    const gl = this.gl, program = this.program_ = this.programs[name];
    gl.useProgram(program.made);
    gl.uniformMatrix4fv(program.uniforms.view, false, this.view);
    gl.uniformMatrix4fv(program.uniforms.project, false, this.project);
    for (const [each, value] of Object.entries(uniforms)) {
      const at = program.uniforms[each];
      if (typeof value === "number") gl.uniform1f(at, value);
      else if (value.length === 4) gl.uniform4fv(at, value);
      else gl.uniform3fv(at, value);
    }
    for (let k = 0; k < 8; k++) gl.disableVertexAttribArray(k);
  }

  attribute(name, buffer, size, stride = 0, offset = 0, {each = 0, kind = this.gl.FLOAT} = {}) {
    const gl = this.gl, at = this.program_.attributes[name];
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.enableVertexAttribArray(at);
    gl.vertexAttribPointer(at, size, kind, false, stride, offset);
    gl.vertexAttribDivisor(at, each);
  }

  /** Draws what `shown` says of a scene, as the camera sees it. */
  draw(scene, shown, camera) {
    const gl = this.gl, {canvas} = this, share = this.sharp ? 1 : this.share;
    const ratio = Math.min(window.devicePixelRatio || 1, 2) * share;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight].map((each) => Math.max(1, Math.round(each * ratio)));
    if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
    gl.viewport(0, 0, width, height);
    gl.clearColor(1, 1, 1, 1);
    gl.depthMask(true);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (!scene) return;
    [this.view, this.project] = [camera.view(), camera.project(width / height)];
    gl.enable(gl.DEPTH_TEST); gl.enable(gl.CULL_FACE); gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA); // colours come multiplied by their alpha
    const {colours} = scene, {state, map, surface, truth} = shown;
    this.lines(scene);
    if (map) this.voxels(scene, map, shown.threshold);
    if (state && shown.hand) this.skin(scene, state);
    gl.depthMask(false);
    if (truth && truth.faces.length) this.mesh("truth", truth, [colours.truth, colours.truth, colours.truth], 0.6);
    gl.depthMask(true);
    if (surface && surface.faces.length) this.mesh("surface", surface, colours.surface, 0.85);
    gl.depthMask(false);
    const few = this.few && !this.sharp, seen = {alpha: few ? 0.3 : 0.17, behind: 1, mesh: share < 1 ? "coarse" : "capsule"};
    const ghosts = state && (few ? half(state.ghosts, 6 * scene.radii.length) : state.ghosts);
    if (state && shown.ghosts) this.capsules("ghosts", scene, ghosts, rgb(colours.ghosts), seen);
    gl.depthMask(true);
    if (truth && state && state.truth) this.outline(scene, state.truth, rgb(colours.outline));
  }

  lines(scene) {
    this.hold("box", scene, () => ({"": this.edges = box(scene.extent)}));
    this.use("lines", {});
    this.attribute("place", this.buffers.box, 3, 16, 0);
    this.attribute("shade", this.buffers.box, 1, 16, 12);
    this.gl.drawArrays(this.gl.LINES, 0, this.edges.length / 4);
  }

  skin(scene, state) {
    const gl = this.gl, {skin, colours} = scene;
    this.hold("skin", scene, () => shared({
      places: {values: skin.places, size: 3}, normals: {values: skin.normals, size: 3}, patches: {values: skin.patches, size: 1},
    }));
    this.use("skin", {skin: rgb(colours.hand), numb: rgb(colours.numb), touch: rgb(colours.touch)});
    gl.bindTexture(gl.TEXTURE_2D, this.touched);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.R8UI, state.touched.length, 1, 0, gl.RED_INTEGER, gl.UNSIGNED_BYTE, state.touched);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
    this.attribute("place", this.buffers.skinplaces, 3);
    this.attribute("normal", this.buffers.skinnormals, 3);
    this.attribute("area", this.buffers.skinpatches, 1, 0, 0, {kind: gl.SHORT});
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.buffers.skinfaces);
    skin.first.forEach((first, link) => {
      gl.uniformMatrix4fv(this.program_.uniforms.model, false, placed(state.places, state.turns, link));
      const corners = (skin.first[link + 1] ?? skin.patches.length) - first;
      gl.drawElements(gl.TRIANGLES, corners, gl.UNSIGNED_INT, 4 * first);
    });
  }

  /** Some hands of one colour; ends (N, L, 2, 3). */
  capsules(name, scene, ends, colour, {alpha = 1, behind = 0, grow = 0, mesh = "capsule"}) {
    const gl = this.gl, links = scene.radii.length, count = ends.length / 6;
    this.hold(name, ends, () => ({"": ends, radii: Float32Array.from({length: count}, (_, k) => scene.radii[k % links])}));
    this.use("capsules", {paint: [...colour, alpha], behind, grow});
    this.attribute("direction", this.buffers[mesh + "directions"], 4);
    this.attribute("first", this.buffers[name], 3, 24, 0, {each: 1});
    this.attribute("last", this.buffers[name], 3, 24, 12, {each: 1});
    this.attribute("radius", this.buffers[name + "radii"], 1, 0, 0, {each: 1});
    this.instances(mesh, count);
  }

  instances(name, count) {
    const gl = this.gl;
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.buffers[name + "faces"]);
    gl.drawElementsInstanced(gl.TRIANGLES, this.corners[name], gl.UNSIGNED_INT, 0, count);
  }

  /** Of a hand before all else: what of a thicker one lies behind it shows beside it. */
  outline(scene, ends, colour) {
    const {gl} = this;
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.colorMask(false, false, false, false);
    this.capsules("true hand", scene, ends, colour, {});
    gl.colorMask(true, true, true, true);
    gl.cullFace(gl.FRONT);
    this.capsules("true hand", scene, ends, colour, {grow: 0.005 * Math.max(...scene.extent)});
    gl.cullFace(gl.BACK);
  }

  voxels(scene, map, threshold) {
    const gl = this.gl;
    if (this.above?.map !== map || this.above.threshold !== threshold) {
      const solid = (_, k) => map.chances[k] > 255 * threshold;
      this.above = {map, threshold, cells: map.cells.filter(solid), chances: map.chances.filter(solid)};
    }
    const {cells, chances} = this.above;
    if (!cells.length) return;
    this.hold("map", this.above, () => ({places: this.centres(scene, cells), chances}));
    this.use("voxels", {reach: 0.46 * scene.resolution, ramp: scene.colours.map.flatMap(rgb)});
    gl.disable(gl.CULL_FACE); // all that is drawn is turned to the eye
    this.attribute("place", this.buffers.cubecorners, 3, 24, 0);
    this.attribute("normal", this.buffers.cubecorners, 3, 24, 12);
    this.attribute("centre", this.buffers.mapplaces, 3, 0, 0, {each: 1});
    this.attribute("probability", this.buffers.mapchances, 1, 0, 0, {each: 1, kind: gl.UNSIGNED_BYTE});
    this.instances("cube", cells.length);
    gl.enable(gl.CULL_FACE);
  }

  centres(scene, cells) {
    const [, y, z] = scene.shape, out = new Float32Array(3 * cells.length);
    cells.forEach((cell, k) => {
      [Math.floor(cell / (y * z)), Math.floor(cell / z) % y, cell % z].forEach((index, axis) => {
        out[3 * k + axis] = (index + 0.5 - scene.shape[axis] / 2) * scene.resolution;
      });
    });
    return out;
  }

  /** Its far side first. */
  mesh(name, mesh, colours, alpha) {
    const gl = this.gl, [low, middle, high] = colours.map(rgb);
    this.hold(name, mesh, () => ({
      places: mesh.vertices, normals: normals(mesh.vertices, mesh.faces), values: mesh.values, faces: mesh.faces,
    }));
    this.use("mesh", {low, middle, high, alpha});
    this.attribute("place", this.buffers[name + "places"], 3);
    this.attribute("normal", this.buffers[name + "normals"], 3);
    this.attribute("value", this.buffers[name + "values"], 1, 0, 0, {kind: gl.UNSIGNED_BYTE});
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.buffers[name + "faces"]);
    for (const side of [gl.FRONT, gl.BACK]) {
      gl.cullFace(side);
      gl.drawElements(gl.TRIANGLES, mesh.faces.length, gl.UNSIGNED_INT, 0);
    }
    gl.cullFace(gl.BACK);
  }
}
