// Matrices by columns, as WebGL has them, and meshes that every scene needs.

function perspective(angle, aspect, near, far) {
  const f = 1 / Math.tan(angle / 2), out = new Float32Array(16);
  out[0] = f / aspect; out[5] = f; out[10] = (far + near) / (near - far); out[11] = -1;
  out[14] = 2 * far * near / (near - far);
  return out;
}

const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const unit = (a) => { const n = Math.hypot(...a) || 1; return a.map((each) => each / n); };
const rgb = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16) / 255);

/** The matrix of a link, of all places (L, 3) and turns (L, 3, 3). */
function placed(places, turns, link) {
  const [x, y, z] = places.subarray(3 * link), [a, b, c, d, e, f, g, h, i] = turns.subarray(9 * link);
  return new Float32Array([a, d, g, 0, b, e, h, 0, c, f, i, 0, x, y, z, 1]);
}

/** Normals of vertices, the mean of those of their faces. */
function normals(vertices, faces) {
  const out = new Float32Array(vertices.length);
  for (let at = 0; at < faces.length; at += 3) {
    const [p, q, r] = [0, 1, 2].map((k) => vertices.subarray(3 * faces[at + k], 3 * faces[at + k] + 3));
    const n = cross([q[0] - p[0], q[1] - p[1], q[2] - p[2]], [r[0] - p[0], r[1] - p[1], r[2] - p[2]]);
    for (let k = 0; k < 3; k++) for (let axis = 0; axis < 3; axis++) out[3 * faces[at + k] + axis] += n[axis];
  }
  return out;
}

/** Each vertex once, though several triangles have it: `faces` tell which. A vertex is so many numbers of `parts`. */
function shared(parts) {
  const faces = [], kept = [], known = new Map(), sizes = Object.entries(parts);
  const count = sizes[0][1].values.length / sizes[0][1].size;
  for (let k = 0; k < count; k++) {
    const key = sizes.map(([, {values, size}]) => values.subarray(size * k, size * (k + 1)).join()).join("|");
    if (!known.has(key)) { known.set(key, kept.length); kept.push(k); }
    faces.push(known.get(key));
  }
  const chosen = ({values, size}) => {
    const out = new values.constructor(size * kept.length);
    kept.forEach((k, at) => out.set(values.subarray(size * k, size * (k + 1)), size * at));
    return out;
  };
  return {...Object.fromEntries(sizes.map(([name, each]) => [name, chosen(each)])), faces: new Uint32Array(faces)};
}

/** Of the cube [-1, 1]³ the three faces on the positive side: corners and normals by turns. */
function cube() {
  const out = [];
  for (let axis = 0; axis < 3; axis++)
    for (const [u, v] of [[-1, -1], [1, -1], [1, 1], [-1, -1], [1, 1], [-1, 1]]) {
      const p = [0, 0, 0], n = [0, 0, 0];
      p[axis] = n[axis] = 1; p[(axis + 1) % 3] = u; p[(axis + 2) % 3] = v;
      out.push(...p, ...n);
    }
  return shared({corners: {values: new Float32Array(out), size: 6}});
}

/** A capsule of any length: directions from its bone, and at which end of that. */
function capsule(around, cap) {
  const out = [], rings = [];
  for (let k = -cap; k <= cap; k++) {
    const polar = Math.PI / 2 * k / cap;
    if (k === 0) rings.push([1, 0, 0]);
    rings.push([Math.cos(polar), Math.sin(polar), k < 0 ? 0 : 1]);
  }
  const point = ([radius, z, end], k) => {
    const turn = 2 * Math.PI * k / around;
    out.push(radius * Math.cos(turn), radius * Math.sin(turn), z, end);
  };
  for (let ring = 0; ring + 1 < rings.length; ring++)
    for (let k = 0; k < around; k++) {
      const [low, high] = [rings[ring], rings[ring + 1]];
      const next = (k + 1) % around;
      point(low, k); point(low, next); point(high, next); point(low, k); point(high, next); point(high, k);
    }
  return shared({directions: {values: new Float32Array(out), size: 4}});
}

/** The edges of the box of the map, and lines on its floor a centimetre from each other. */
function box(extent) {
  const [x, y, z] = extent.map((each) => each / 2), out = [];
  const line = (a, b, shade) => out.push(...a, shade, ...b, shade);
  for (const u of [-1, 1]) for (const v of [-1, 1]) {
    line([-x, u * y, v * z], [x, u * y, v * z], 0.5);
    line([u * x, -y, v * z], [u * x, y, v * z], 0.5);
    line([u * x, v * y, -z], [u * x, v * y, z], 0.5);
  }
  for (let at = 0.01; at < Math.max(x, y); at += 0.01) for (const side of [-1, 1]) {
    if (at < x) line([side * at, -y, -z], [side * at, y, -z], 0.25);
    if (at < y) line([-x, side * at, -z], [x, side * at, -z], 0.25);
  }
  line([0, -y, -z], [0, y, -z], 0.25); line([-x, 0, -z], [x, 0, -z], 0.25);
  return new Float32Array(out);
}
