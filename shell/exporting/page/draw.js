// What is seen, by plain WebGL 2: object, tip, force arrow, places that were pressed, floor. Metres, device frame.

const OBJECT_VERTEX = `#version 300 es
uniform mat4 camera;
in vec3 point, normal, rest;
in float value;
out vec3 at, out_, lattice;
out float shade;
void main() { at = point; out_ = normal; lattice = rest; shade = value; gl_Position = camera * vec4(point, 1.0); }`;

// A matt, slightly translucent skin with a lattice of 10 mm that moves with the material, so that one sees it stretch.
const OBJECT_FRAGMENT = `#version 300 es
precision highp float;
uniform vec3 eye, light, up, ball, colour, low, middle, high;
uniform float radius, coloured;
in vec3 at, out_, lattice;
in float shade;
out vec4 seen;
float lines(vec3 p, vec3 n) {
  vec3 cell = p / 0.010, away = abs(fract(cell) - 0.5), width = fwidth(cell);
  vec3 line = smoothstep(vec3(0.0), width * 1.4 + 1e-4, 0.5 - away);
  vec3 weight = 1.0 - smoothstep(0.7, 0.95, abs(n));
  return 1.0 - dot(weight * (1.0 - line), vec3(1.0)) * clamp(0.28 / max(max(width.x, width.y), width.z) * 0.12, 0.0, 1.0);
}
void main() {
  vec3 n = normalize(out_), view = normalize(eye - at);
  vec3 skin = colour;
  if (coloured > 0.5) skin = shade < 0.5 ? mix(low, middle, shade * 2.0) : mix(middle, high, shade * 2.0 - 1.0);
  float lit = max(0.35 + 0.6 * dot(n, light), 0.0);
  float sky = 0.5 + 0.5 * dot(n, up);
  float shine = pow(max(dot(n, normalize(light + view)), 0.0), 28.0) * 0.10;
  float rim = pow(1.0 - max(dot(n, view), 0.0), 3.0) * 0.10;
  vec3 to = ball - at;
  float far = max(length(to) - radius, 0.0) / max(radius, 1e-6);
  float covered = radius > 0.0 ? 0.5 * max(dot(n, normalize(to)), 0.0) / (1.0 + 5.0 * far * far + 2.0 * far) : 0.0;
  vec3 light_ = skin * (0.74 * lit + 0.34 * sky + 0.08) * (1.0 - covered) * mix(0.80, 1.0, lines(lattice, n));
  seen = vec4(pow(light_ + shine + rim * skin, vec3(1.0 / 2.2)), 1.0);
}`;

const PLAIN_VERTEX = `#version 300 es
precision highp float;
uniform mat4 camera, place;
uniform float floor_;
in vec3 point, normal;
out vec3 at, out_;
void main() {
  vec4 p = place * vec4(point, 1.0);
  at = p.xyz; out_ = floor_ > 0.0 ? normal : mat3(place) * normal; gl_Position = camera * p;
}`;

const PLAIN_FRAGMENT = `#version 300 es
precision highp float;
uniform vec3 eye, light, up;
uniform vec4 paint;
uniform float floor_;
in vec3 at, out_;
out vec4 seen;
void main() {
  if (floor_ > 0.0) { seen = vec4(paint.rgb, paint.a * (1.0 - smoothstep(0.3, 1.0, length(out_.xy)))); return; }
  vec3 n = normalize(out_), view = normalize(eye - at);
  float lit = max(dot(n, light), 0.0) * 0.7 + 0.35 + 0.15 * dot(n, up);
  float shine = pow(max(dot(n, normalize(light + view)), 0.0), 60.0) * 0.5;
  seen = vec4(pow(paint.rgb * lit + shine, vec3(1.0 / 2.2)), paint.a);
}`;

const WHERE_IT_IS = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
const linear = (hex) => [1, 3, 5].map((at) => (parseInt(hex.slice(at, at + 2), 16) / 255) ** 2.2);

class Drawing {
  // Throws an Error where the browser has no WebGL 2.
  constructor(canvas, surface, shape, colours, dots) {
    this.canvas = canvas;
    this.dots = dots;
    this.gl = canvas.getContext("webgl2", { antialias: !drawnBySoftware(), alpha: true, powerPreference: "high-performance" });
    if (!this.gl) throw new Error("this browser shows no WebGL 2");
    Object.assign(this, { surface, shape, colours });
    canvas.addEventListener("webglcontextlost", (event) => event.preventDefault());
    canvas.addEventListener("webglcontextrestored", () => this.prepare());
    this.ratio = Math.min(window.devicePixelRatio || 1, 2);
    this.prepare();
  }

  prepare() {
    const { gl, surface } = this;
    this.object = this.program(OBJECT_VERTEX, OBJECT_FRAGMENT);
    this.plain = this.program(PLAIN_VERTEX, PLAIN_FRAGMENT);
    this.buffers = {};
    this.whole = gl.createVertexArray();
    gl.bindVertexArray(this.whole);
    this.attribute(this.object, "point", this.shape.drawn, 3, gl.DYNAMIC_DRAW);
    this.attribute(this.object, "normal", this.shape.normals, 3, gl.DYNAMIC_DRAW);
    this.attribute(this.object, "rest", this.shape.seen(surface.vertices), 3, gl.STATIC_DRAW);
    this.attribute(this.object, "value", new Float32Array(this.shape.at.length), 1, gl.DYNAMIC_DRAW);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, this.shape.triangles, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    this.parts = { beads: this.beads(0.0010), ball: this.mesh(...ballMesh()), rod: this.mesh(...rodMesh(0.5, 0.5)), cone: this.mesh(...rodMesh(1, 0)), disc: this.mesh(...discMesh()) };
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.CULL_FACE);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    if (this.values) this.colourBy(this.values);
  }

  program(vertex, fragment) {
    const { gl } = this, made = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS) && !gl.isContextLost()) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    const at = {};
    for (let i = gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS) - 1; i >= 0; i--) {
      const { name } = gl.getActiveUniform(made, i);
      at[name] = gl.getUniformLocation(made, name);
    }
    return { made, at };
  }

  attribute({ made }, name, values, width, use) {
    const { gl } = this, where = gl.getAttribLocation(made, name), buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, values, use);
    if (where >= 0) {
      gl.enableVertexAttribArray(where);
      gl.vertexAttribPointer(where, width, gl.FLOAT, false, 0, 0);
    }
    this.buffers[name] = buffer;
  }

  mesh(points, normals, triangles) {
    const { gl } = this, made = gl.createVertexArray(), kept = this.buffers;
    this.buffers = {};
    gl.bindVertexArray(made);
    this.attribute(this.plain, "point", new Float32Array(points), 3, gl.STATIC_DRAW);
    this.attribute(this.plain, "normal", new Float32Array(normals), 3, gl.STATIC_DRAW);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, new Uint32Array(triangles), gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    this.buffers = kept;
    return { made, count: triangles.length };
  }

  // A small ball at every place that was pressed, as one part.
  beads(radius) {
    const [points, normals, triangles] = ballMesh(6, 9), all = [[], [], []];
    this.dots.forEach((dot_, i) => {
      for (let k = 0; k < points.length; k++) all[0].push(dot_[k % 3] + radius * points[k]);
      all[1].push(...normals);
      all[2].push(...triangles.map((t) => t + i * points.length / 3));
    });
    return this.mesh(...all);
  }

  // The object by a value from 0 to 1 at each vertex; null: plain.
  colourBy(values) {
    this.values = values;
    if (!values) return;
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, this.buffers.value);
    this.gl.bufferSubData(this.gl.ARRAY_BUFFER, 0, Float32Array.from(this.shape.at, (v) => values[v]));
  }

  upload() {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers.point);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, this.shape.drawn);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers.normal);
    gl.bufferSubData(gl.ARRAY_BUFFER, 0, this.shape.normals);
  }

  fit() {
    const { canvas } = this;
    const width = Math.max(1, Math.round(canvas.clientWidth * this.ratio)), height = Math.max(1, Math.round(canvas.clientHeight * this.ratio));
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    return width / height;
  }

  // view: a Camera. scene: {tip, normal, radius, hover, force, newton_m, chosen}.
  draw(view, scene) {
    const { gl, colours } = this, aspect = this.fit();
    if (gl.isContextLost()) return;
    const camera = view.matrix(aspect), { eye } = view, up = view.up, light = unit(plus(plus(times(view.right, -0.45), up, 0.8), view.back, 0.55));
    gl.viewport(0, 0, this.canvas.width, this.canvas.height);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const set = ({ made, at }, values) => {
      gl.useProgram(made);
      for (const [name, value] of Object.entries({ eye, light, up, ...values })) {
        if (!at[name]) continue;
        if (typeof value === "number") gl.uniform1f(at[name], value);
        else if (value.length === 3) gl.uniform3fv(at[name], value);
        else if (value.length === 4) gl.uniform4fv(at[name], value);
        else gl.uniformMatrix4fv(at[name], false, value);
      }
    };
    const part = ({ made, count }, place, paint, floor_ = 0) => {
      set(this.plain, { camera, place, paint, floor_ });
      gl.bindVertexArray(made);
      gl.drawElements(gl.TRIANGLES, count, gl.UNSIGNED_INT, 0);
    };
    gl.enable(gl.BLEND);
    gl.depthMask(false);
    const wide = view.size * 1.25;
    part(this.parts.disc, standing(view.floor, up, wide, wide), [...linear(colours.shadow), 0.42], 1);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
    set(this.object, {
      camera, ball: scene.tip, radius: scene.hover ? scene.radius * 0.6 : scene.radius, coloured: this.values ? 1 : 0,
      colour: linear(colours.object), low: linear(colours.low), middle: linear(colours.middle), high: linear(colours.high),
    });
    gl.bindVertexArray(this.whole);
    gl.drawElements(gl.TRIANGLES, this.shape.triangles.length, gl.UNSIGNED_INT, 0);
    part(this.parts.beads, WHERE_IT_IS, [...linear(colours.touch), 1]);
    const chosen = this.dots[scene.chosen];
    if (chosen) part(this.parts.ball, standing(chosen, up, 0.0018, 0.0018), [...linear(colours.chosen), 1]);
    if (scene.radius > 0) {
      const alpha = scene.hover ? 0.45 : 1, steel = [...linear(colours.tip), alpha], { radius, tip, normal } = scene;
      if (scene.hover) gl.enable(gl.BLEND);
      part(this.parts.ball, standing(tip, normal, radius, radius), steel);
      part(this.parts.rod, standing(plus(tip, normal, radius * 0.6), normal, radius * 0.7, view.size * 0.35), steel);
      gl.disable(gl.BLEND);
      const pull = size(scene.force);
      if (!scene.hover && pull > 1e-3) {
        const way = times(scene.force, 1 / pull), long = Math.min(pull * scene.newton_m, 0.6 * view.size), head = Math.min(0.4 * long, radius * 1.3);
        const paint = [...linear(colours.fem), 1], side = plus(tip, plus(view.right, up, 0), radius * 1.35);
        part(this.parts.rod, standing(side, way, radius * 0.34, Math.max(long - head, 1e-5)), paint);
        part(this.parts.cone, standing(plus(side, way, Math.max(long - head, 0)), way, head * 0.42, head), paint);
      }
    }
    gl.bindVertexArray(null);
  }
}

// Whether the processor draws, not a graphics card: then edges are not smoothed, which costs most.
function drawnBySoftware() {
  const gl = document.createElement("canvas").getContext("webgl2"), info = gl && gl.getExtension("WEBGL_debug_renderer_info");
  const name = info ? gl.getParameter(info.UNMASKED_RENDERER_WEBGL) : "";
  if (gl && gl.getExtension("WEBGL_lose_context")) gl.getExtension("WEBGL_lose_context").loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}

// A matrix that stands a part of unit size on `foot`, its z along the unit vector `way`.
function standing(foot, way, wide, long) {
  const aside = unit(cross(Math.abs(way[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0], way)), third = cross(way, aside);
  return [...times(aside, wide), 0, ...times(third, wide), 0, ...times(way, long), 0, ...foot, 1];
}

function ballMesh(rows = 16, around = 24) {
  const points = [], triangles = [];
  for (let i = 0; i <= rows; i++) {
    for (let j = 0; j <= around; j++) {
      const a = Math.PI * i / rows, b = 2 * Math.PI * j / around;
      points.push(Math.sin(a) * Math.cos(b), Math.sin(a) * Math.sin(b), Math.cos(a));
    }
  }
  for (let i = 0; i < rows; i++) {
    for (let j = 0; j < around; j++) {
      const a = i * (around + 1) + j, b = a + around + 1;
      triangles.push(a, b, a + 1, b, b + 1, a + 1);
    }
  }
  return [points, points, triangles];
}

function rodMesh(below, above, around = 24) {
  const points = [], normals = [], triangles = [];
  for (let j = 0; j <= around; j++) {
    const b = 2 * Math.PI * j / around, out = unit([Math.cos(b), Math.sin(b), below - above]);
    points.push(below * Math.cos(b), below * Math.sin(b), 0, above * Math.cos(b), above * Math.sin(b), 1);
    normals.push(...out, ...out);
    if (j < around) triangles.push(2 * j, 2 * j + 2, 2 * j + 1, 2 * j + 1, 2 * j + 2, 2 * j + 3);
  }
  const first = points.length / 3;
  for (const [height, wide, way] of [[0, below, -1], [1, above, 1]]) {
    const middle = points.length / 3;
    points.push(0, 0, height);
    normals.push(0, 0, way);
    for (let j = 0; j <= around; j++) {
      const b = 2 * Math.PI * j / around;
      points.push(wide * Math.cos(b), wide * Math.sin(b), height);
      normals.push(0, 0, way);
      if (j < around) triangles.push(...(way > 0 ? [middle, middle + 1 + j, middle + 2 + j] : [middle, middle + 2 + j, middle + 1 + j]));
    }
  }
  return [points, normals, triangles, first];
}

// Its normals say how far from the middle a point is: the floor fades by that.
function discMesh(around = 48) {
  const points = [0, 0, 0], normals = [0, 0, 1], triangles = [];
  for (let j = 0; j <= around; j++) {
    const b = 2 * Math.PI * j / around;
    points.push(Math.cos(b), Math.sin(b), 0);
    normals.push(Math.cos(b), Math.sin(b), 1);
    if (j < around) triangles.push(0, 1 + j, 2 + j);
  }
  return [points, normals, triangles];
}

// An eye that looks at the middle of the object from an azimuth and elevation about its support's normal.
class Camera {
  constructor(vertices, up, floor, start) {
    Object.assign(this, { up, start });
    const low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
    for (let i = 0; i < vertices.length; i++) {
      low[i % 3] = Math.min(low[i % 3], vertices[i]);
      high[i % 3] = Math.max(high[i % 3], vertices[i]);
    }
    this.middle = times(plus(low, high), 0.5);
    this.size = 0.5 * size(plus(high, low, -1));
    this.floor = plus(this.middle, up, -dot(plus(this.middle, floor, -1), up));
    const least = up.map(Math.abs).indexOf(Math.min(...up.map(Math.abs)));
    const aside = unit(cross(up, [0, 1, 2].map((axis) => (axis === least ? 1 : 0))));
    this.level = [aside, cross(up, aside)];
    this.reset();
  }

  reset() {
    [this.azimuth, this.elevation, this.zoom] = [...this.start, 1];
    this.look();
  }

  turn(azimuth, elevation) {
    this.azimuth += azimuth;
    this.elevation = Math.min(1.5, Math.max(-0.1, this.elevation + elevation));
    this.look();
  }

  nearer(by) {
    this.zoom = Math.min(6, Math.max(0.5, this.zoom * by));
    this.look();
  }

  look() {
    const { azimuth: a, elevation: e } = this;
    const level = plus(times(this.level[0], Math.cos(a)), this.level[1], Math.sin(a));
    this.back = plus(times(level, Math.cos(e)), this.up, Math.sin(e));
    this.right = unit(cross(this.up, this.back));
    this.top = cross(this.back, this.right);
  }

  matrix(aspect) {
    const open = 0.26, fit = Math.min(0.94, aspect); // half the angle, and the narrower side holds the object
    this.distance = 0.92 * this.size / Math.sin(open) / fit / this.zoom;
    this.aspect = aspect;
    this.eye = plus(this.middle, this.back, this.distance);
    this.scale = 1 / Math.tan(open);
    const near = Math.max(this.distance - 3 * this.size, 0.05 * this.size), far = this.distance + 4 * this.size;
    const { right: r, top: t, back: b } = this, s = this.scale, z = (far + near) / (near - far), w = 2 * far * near / (near - far);
    const [x, y, d] = [-dot(r, this.eye), -dot(t, this.eye), -dot(b, this.eye)];
    return [
      r[0] * s / aspect, t[0] * s, b[0] * z, -b[0], r[1] * s / aspect, t[1] * s, b[1] * z, -b[1],
      r[2] * s / aspect, t[2] * s, b[2] * z, -b[2], x * s / aspect, y * s, d * z + w, -d,
    ];
  }

  // Unit vector from the eye through a point of the picture, -1 to 1 rightwards and upwards.
  ray(x, y) {
    return unit(plus(plus(times(this.back, -this.scale), this.right, x * this.aspect), this.top, y));
  }
}
