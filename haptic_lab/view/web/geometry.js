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

/** The cube [-1, 1]³: corners and normals by turns. */
function cube() {
  const out = [];
  for (let axis = 0; axis < 3; axis++)
    for (const side of [-1, 1]) {
      const corner = (u, v) => {
        const p = [0, 0, 0], n = [0, 0, 0];
        p[axis] = n[axis] = side; p[(axis + 1) % 3] = u * side; p[(axis + 2) % 3] = v;
        out.push(...p, ...n);
      };
      corner(-1, -1); corner(1, -1); corner(1, 1); corner(-1, -1); corner(1, 1); corner(-1, 1);
    }
  return new Float32Array(out);
}

/** A capsule of any length: directions from its bone, and at which end of that. */
function capsule(around = 10, cap = 2) {
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
      point(low, k); point(low, k + 1); point(high, k + 1); point(low, k); point(high, k + 1); point(high, k);
    }
  return new Float32Array(out);
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
