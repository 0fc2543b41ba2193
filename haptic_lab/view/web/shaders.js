// Programs for the graphics card. Light comes from over the left shoulder of whoever looks.

const LIT = `
  float lit(vec3 normal) {
    return 0.60 + 0.42 * max(dot(normalize(mat3(view) * normal), normalize(vec3(-0.35, 0.55, 0.75))), 0.0);
  }`;
const HEAD = `#version 300 es
  precision highp float; precision highp int;
  uniform mat4 view, project;`;
const COLOURED = `#version 300 es
  precision highp float;
  in vec4 tint; out vec4 colour;
  void main() { colour = vec4(tint.rgb * tint.a, tint.a); }`;

const SHADERS = {
  // The skin of one link: patches that touch are lit.
  skin: [HEAD + LIT + `
    in vec3 place, normal; in float area;
    uniform mat4 model; uniform vec3 skin, numb, touch; uniform highp usampler2D touched;
    out vec4 tint;
    void main() {
      int index = int(area);
      vec3 base = index < 0 ? numb : skin * ((index & 1) == 0 ? 1.0 : 0.95);
      bool on = index >= 0 && texelFetch(touched, ivec2(index, 0), 0).r > 0u;
      float shade = lit(mat3(model) * normal);
      tint = vec4(on ? touch * (0.55 + 0.45 * shade) : base * shade, 1.0);
      gl_Position = project * view * model * vec4(place, 1.0);
    }`, COLOURED],
  // Capsules, of which only the ends are told: hands among others.
  capsules: [HEAD + LIT + `
    in vec4 direction; in vec3 first, last; in float radius;
    uniform vec4 paint; uniform float behind, grow;
    out vec4 tint;
    void main() {
      vec3 bone = last - first;
      vec3 z = length(bone) > 1e-7 ? normalize(bone) : vec3(0.0, 0.0, 1.0);
      vec3 x = normalize(cross(abs(z.z) < 0.9 ? vec3(0.0, 0.0, 1.0) : vec3(1.0, 0.0, 0.0), z));
      vec3 outward = mat3(x, cross(z, x), z) * direction.xyz;
      vec4 seen = view * vec4(mix(first, last, direction.w) + (radius + grow) * outward, 1.0);
      tint = vec4(paint.rgb * lit(outward), paint.a);
      // As deep as what lies so many radii behind, so that hands alike show only where they stick out at the sides.
      vec4 at = project * seen, deeper = project * (seen - vec4(0.0, 0.0, behind * radius, 0.0));
      gl_Position = vec4(at.xy, deeper.z / deeper.w * at.w, at.w);
    }`, COLOURED],
  // Voxels, of each the three faces that are turned to the eye.
  voxels: [HEAD + LIT + `
    in vec3 place, normal; in vec3 centre; in float probability;
    uniform float reach; uniform vec3 ramp[4];
    out vec4 tint;
    void main() {
      float p = probability / 255.0, at = clamp((p - 0.1) / 0.85, 0.0, 1.0) * 3.0;
      vec3 base = at < 1.0 ? mix(ramp[0], ramp[1], at)
        : at < 2.0 ? mix(ramp[1], ramp[2], at - 1.0) : mix(ramp[2], ramp[3], at - 2.0);
      vec3 eye = -transpose(mat3(view)) * view[3].xyz;
      vec3 side = mix(vec3(-1.0), vec3(1.0), greaterThan(eye, centre));
      tint = vec4(base * lit(side * normal), 1.0);
      gl_Position = project * view * vec4(centre + reach * side * place, 1.0);
    }`, COLOURED],
  // A mesh, between two colours by a value of each vertex.
  mesh: [HEAD + LIT + `
    in vec3 place, normal; in float value;
    uniform vec3 low, middle, high; uniform float alpha;
    out vec4 tint;
    void main() {
      float at = clamp(value / 255.0, 0.0, 1.0) * 2.0;
      vec3 base = at < 1.0 ? mix(low, middle, at) : mix(middle, high, at - 1.0);
      vec3 seen = mat3(view) * normal;
      tint = vec4(base * lit(seen.z < 0.0 ? -normal : normal), alpha);
      gl_Position = project * view * vec4(place, 1.0);
    }`, COLOURED],
  lines: [HEAD + `
    in vec3 place; in float shade;
    out vec4 tint;
    void main() { tint = vec4(0.45, 0.45, 0.45, shade); gl_Position = project * view * vec4(place, 1.0); }`, COLOURED],
};
