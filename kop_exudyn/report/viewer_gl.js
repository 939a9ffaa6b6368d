"use strict";
// Rods with their true sections in WebGL 2: meshes, camera, drawing and picking. No libraries, no network.

const V3 = {
  sub: (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]],
  cross: (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]],
  unit: a => { const n = Math.hypot(a[0], a[1], a[2]) || 1; return [a[0] / n, a[1] / n, a[2] / n]; },
};

// Rotation matrix (rows) of a unit quaternion x, y, z, w.
function rotation(q, i) {
  const x = q[i], y = q[i + 1], z = q[i + 2], w = q[i + 3];
  return [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w),
          2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
          2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)];
}

// A state between two others: lengths of rods are not kept exactly, but frames are close to each other.
function between(a, b, t) {
  if (t <= 0 || a === b) return a;
  if (t >= 1) return b;
  const mix = (u, v) => u && v && u.map((x, i) => x + t * (v[i] - x));
  const turns = new Float32Array(a.turns.length);
  for (let i = 0; i < turns.length; i += 4) {
    let dot = 0, norm = 0;
    for (let k = 0; k < 4; k++) dot += a.turns[i + k] * b.turns[i + k];
    const sign = dot < 0 ? -1 : 1;
    for (let k = 0; k < 4; k++) turns[i + k] = (1 - t) * a.turns[i + k] + sign * t * b.turns[i + k];
    for (let k = 0; k < 4; k++) norm += turns[i + k] ** 2;
    for (let k = 0; k < 4; k++) turns[i + k] /= Math.sqrt(norm);
  }
  return {...a, turns, places: mix(a.places, b.places), joints: mix(a.joints, b.joints), corners: mix(a.corners, b.corners),
          deviation: mix(a.deviation, b.deviation), utilisation: mix(a.utilisation, b.utilisation),
          opening: a.opening === null ? null : a.opening + t * (b.opening - a.opening), note: ""};
}

// Collects triangles: place, normal, colour, id (part + 1; 0: none).
class MeshBuilder {
  constructor() { this.data = []; this.faces = []; this.count = 0; }
  vertex(p, n, c, id) { this.data.push(p[0], p[1], p[2], n[0], n[1], n[2], c[0], c[1], c[2], id); return this.count++; }
  face(a, b, c) { this.faces.push(a, b, c); }
  ball(centre, radius, colour, id) {
    const first = this.count;
    for (const n of BALL.points) this.vertex(n.map((x, k) => centre[k] + radius * x), n, colour, id);
    for (const f of BALL.faces) this.face(first + f[0], first + f[1], first + f[2]);
  }
  get vertices() { return new Float32Array(this.data); }
  get indices() { return new Uint32Array(this.faces); }
}

// The unit sphere as a once divided icosahedron.
const BALL = (() => {
  const g = (1 + Math.sqrt(5)) / 2;
  const points = [[-1, g, 0], [1, g, 0], [-1, -g, 0], [1, -g, 0], [0, -1, g], [0, 1, g], [0, -1, -g], [0, 1, -g],
                  [g, 0, -1], [g, 0, 1], [-g, 0, -1], [-g, 0, 1]].map(V3.unit);
  const coarse = [[0, 11, 5], [0, 5, 1], [0, 1, 7], [0, 7, 10], [0, 10, 11], [1, 5, 9], [5, 11, 4], [11, 10, 2], [10, 7, 6],
                  [7, 1, 8], [3, 9, 4], [3, 4, 2], [3, 2, 6], [3, 6, 8], [3, 8, 9], [4, 9, 5], [2, 4, 11], [6, 2, 10],
                  [8, 6, 7], [9, 8, 1]];
  const middles = new Map(), faces = [];
  const middle = (a, b) => {
    const key = Math.min(a, b) + "," + Math.max(a, b);
    if (!middles.has(key)) {
      middles.set(key, points.length);
      points.push(V3.unit(points[a].map((x, k) => x + points[b][k])));
    }
    return middles.get(key);
  };
  for (const [a, b, c] of coarse) {
    const ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    faces.push([a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]);
  }
  return {points, faces};
})();

// An outline (y, z) at least as wide and high as asked for, so that thin rods don't vanish between pixels.
function atLeast(outline, least) {
  const [y, z] = [0, 1].map(k => {
    const values = outline.map(p => p[k]), extent = Math.max(...values) - Math.min(...values);
    return Math.max(1, least / (extent || least));
  });
  return outline.map(p => [y * p[0], z * p[1]]);
}

// Sweep every rod piece's section along its rings. colourOf(piece, ring) -> [r, g, b]; least : breadth of sections.
function sweepRods(build, rods, state, colourOf, least) {
  const sections = rods.sections.map(outline => atLeast(outline, least));
  let ring = 0;
  for (let piece = 0; piece < rods.rings.length; piece++) {
    const outline = sections[rods.section[piece]], k = outline.length, n = rods.rings[piece];
    const id = rods.part[piece] + 1, places = [], colours = [];
    for (let r = 0; r < n; r++) {
      const i = ring + r, R = rotation(state.turns, 4 * i), x = state.places.subarray(3 * i, 3 * i + 3);
      places.push(outline.map(([y, z]) => [x[0] + R[1] * y + R[2] * z, x[1] + R[4] * y + R[5] * z, x[2] + R[7] * y + R[8] * z]));
      colours.push(colourOf(piece, i));
    }
    for (let r = 0; r + 1 < n; r++) for (let j = 0; j < k; j++) {
      const a = places[r][j], b = places[r][(j + 1) % k], c = places[r + 1][(j + 1) % k], d = places[r + 1][j];
      const normal = V3.unit(V3.cross(V3.sub(b, a), V3.sub(d, a)));
      const [va, vb, vc, vd] = [[a, r], [b, r], [c, r + 1], [d, r + 1]].map(([p, at]) => build.vertex(p, normal, colours[at], id));
      build.face(va, vb, vc);
      build.face(va, vc, vd);
    }
    for (const [r, sign] of [[0, -1], [n - 1, 1]]) {
      const along = V3.unit(V3.sub(places[n - 1][0], places[0][0])).map(x => sign * x);
      const cap = places[r].map(p => build.vertex(p, along, colours[r], id));
      for (let j = 1; j + 1 < k; j++) build.face(cap[0], cap[j], cap[j + 1]);
    }
    ring += n;
  }
}

const VERTEX_SHADER = `#version 300 es
in vec3 place; in vec3 normal; in vec3 colour; in float id;
uniform mat4 view, projection;
out vec3 n; out vec3 c; out float part; out float depth;
void main() {
  vec4 at = view * vec4(place, 1.0);
  n = mat3(view) * normal; c = colour; part = id; depth = -at.z;
  gl_Position = projection * at;
}`;
const FRAGMENT_SHADER = `#version 300 es
precision highp float;
in vec3 n; in vec3 c; in float part; in float depth;
uniform float chosen, picking, alpha, near, far;
out vec4 colour;
void main() {
  if (picking > 0.5) { colour = vec4(mod(part, 256.0) / 255.0, floor(part / 256.0) / 255.0, 0.0, 1.0); return; }
  vec3 m = normalize(n);
  if (m.z < 0.0) m = -m;
  float lit = max(dot(m, normalize(vec3(-0.35, 0.55, 0.75))), 0.0);
  float light = alpha < 1.0 ? 0.86 + 0.1 * lit : 0.60 + 0.32 * lit + 0.08 * m.y;
  vec3 base = c;
  if (chosen > 0.5 && abs(part - chosen) > 0.5) base = mix(vec3(dot(c, vec3(0.3, 0.59, 0.11))), vec3(0.87), 0.88);
  float haze = 0.30 * clamp((depth - near) / (far - near), 0.0, 1.0);
  colour = vec4(mix(base * light * 1.12, vec3(0.965), haze) * alpha, alpha);
}`;

class Renderer {
  constructor(canvas) {
    const gl = this.gl = canvas.getContext("webgl2", {antialias: true, alpha: true, preserveDrawingBuffer: true});
    if (!gl) throw new Error("This browser offers no WebGL 2.");
    this.canvas = canvas;
    const program = this.program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX_SHADER], [gl.FRAGMENT_SHADER, FRAGMENT_SHADER]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    ["place", "normal", "colour", "id"].forEach((name, k) => gl.bindAttribLocation(program, k, name));
    gl.linkProgram(program);
    gl.useProgram(program);
    this.uniform = {};
    for (const name of ["view", "projection", "chosen", "picking", "alpha", "near", "far"])
      this.uniform[name] = gl.getUniformLocation(program, name);
    gl.enable(gl.DEPTH_TEST);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  }

  // Upload a mesh, into an earlier one's buffers where given.
  upload(build, old) {
    const gl = this.gl, mesh = old || {array: gl.createVertexArray(), vertices: gl.createBuffer(), indices: gl.createBuffer()};
    gl.bindVertexArray(mesh.array);
    gl.bindBuffer(gl.ARRAY_BUFFER, mesh.vertices);
    gl.bufferData(gl.ARRAY_BUFFER, build.vertices, gl.DYNAMIC_DRAW);
    [[3, 0], [3, 12], [3, 24], [1, 36]].forEach(([size, offset], k) => {
      gl.enableVertexAttribArray(k);
      gl.vertexAttribPointer(k, size, gl.FLOAT, false, 40, offset);
    });
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, mesh.indices);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, build.indices, gl.DYNAMIC_DRAW);
    mesh.count = build.faces.length;
    return mesh;
  }

  resize() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2), {clientWidth: w, clientHeight: h} = this.canvas;
    this.ratio = ratio;
    this.canvas.width = Math.max(1, Math.round(w * ratio));
    this.canvas.height = Math.max(1, Math.round(h * ratio));
  }

  clear(picking) {
    const gl = this.gl;
    gl.disable(gl.SCISSOR_TEST);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.uniform1f(this.uniform.picking, picking ? 1 : 0);
  }

  // Draw meshes [{mesh, alpha}] into a tile {x, y, w, h} in CSS pixels from the upper left, seen by a camera.
  draw(tile, camera, meshes, chosen, picking) {
    const gl = this.gl, r = this.ratio;
    const box = [tile.x * r, (this.canvas.clientHeight - tile.y - tile.h) * r, tile.w * r, tile.h * r].map(Math.round);
    gl.viewport(...box);
    gl.enable(gl.SCISSOR_TEST);
    gl.scissor(...box);
    const {view, projection, near, far} = camera.matrices(tile.w / tile.h);
    gl.uniformMatrix4fv(this.uniform.view, false, view);
    gl.uniformMatrix4fv(this.uniform.projection, false, projection);
    gl.uniform1f(this.uniform.chosen, chosen + 1);
    gl.uniform1f(this.uniform.near, near);
    gl.uniform1f(this.uniform.far, far);
    for (const {mesh, alpha} of meshes) {
      if (picking && alpha < 1) continue;
      gl.uniform1f(this.uniform.alpha, alpha);
      if (alpha < 1) { gl.enable(gl.BLEND); gl.depthMask(false); }
      gl.bindVertexArray(mesh.array);
      gl.drawElements(gl.TRIANGLES, mesh.count, gl.UNSIGNED_INT, 0);
      gl.disable(gl.BLEND);
      gl.depthMask(true);
    }
  }

  // Part under a place of the canvas (CSS pixels), or -1; what was drawn last must have been drawn for picking. Looks
  // around the place too: rods are thin.
  partAt(x, y) {
    const gl = this.gl, reach = Math.round(5 * this.ratio), size = 2 * reach + 1, pixels = new Uint8Array(4 * size * size);
    const left = Math.round(x * this.ratio) - reach, bottom = this.canvas.height - Math.round(y * this.ratio) - reach;
    gl.readPixels(left, bottom, size, size, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    let best = -1, distance = Infinity;
    for (let row = 0; row < size; row++) for (let column = 0; column < size; column++) {
      const at = 4 * (row * size + column), part = pixels[at] + 256 * pixels[at + 1] - 1;
      const d = Math.hypot(row - reach, column - reach);
      if (pixels[at + 3] && part >= 0 && d < distance) { best = part; distance = d; }
    }
    return best;
  }
}

// Orbits the centre of a box; z is up. box: centre, size (diagonal), wide and high (half extents as first seen).
class Camera {
  constructor() { this.azimuth = -1.08; this.elevation = 0.6; this.zoom = 1; this.pan = [0, 0]; }

  looking(box) { return Object.assign(new Camera(), this, {box}); }

  // Unit vectors to the right, up, and from the centre to the eye.
  get axes() {
    const ce = Math.cos(this.elevation), se = Math.sin(this.elevation), ca = Math.cos(this.azimuth), sa = Math.sin(this.azimuth);
    return {right: [-sa, ca, 0], up: [-se * ca, -se * sa, ce], back: [ce * ca, ce * sa, se]};
  }

  // From the eye to the centre: fills the tile but for a margin, and for the part in front of the centre, which looks
  // larger.
  distance(aspect) {
    const {size, wide, high} = this.box, half = Camera.HALF;
    return (1.15 * Math.max(high / half, wide / half / aspect) + 0.25 * size) / this.zoom;
  }

  // Pixels of a unit of length at the centre of a tile {x, y, w, h}.
  scale(tile) { return tile.h / 2 / Camera.HALF / this.distance(tile.w / tile.h); }

  // Where a point of space is on the canvas (CSS pixels), and its depth from the eye.
  pixel(tile, point) {
    const {right, up, back} = this.axes, {centre: c, size} = this.box, d = V3.sub(point, c);
    const dot = a => a[0] * d[0] + a[1] * d[1] + a[2] * d[2];
    const depth = this.distance(tile.w / tile.h) - dot(back), k = tile.h / 2 / Camera.HALF / depth;
    return {x: tile.x + tile.w / 2 + k * (dot(right) + this.pan[0] * size), y: tile.y + tile.h / 2 - k * (dot(up) + this.pan[1] * size), depth};
  }

  matrices(aspect) {
    const {right, up, back} = this.axes, {centre: c, size} = this.box, half = Camera.HALF, distance = this.distance(aspect);
    const near = Math.max(distance - size, 0.01 * distance), far = distance + size;
    const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    const view = new Float32Array([right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0,
      -dot(right, c) + this.pan[0] * size, -dot(up, c) + this.pan[1] * size, -dot(back, c) - distance, 1]);
    const f = 1 / half;
    const projection = new Float32Array([f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1,
      0, 0, 2 * far * near / (near - far), 0]);
    return {view, projection, near: distance - 0.5 * size, far: distance + 0.5 * size};
  }
}

Camera.HALF = Math.tan(0.15);  // of the angle of view
