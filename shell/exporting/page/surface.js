// The surface that is touched: nearest place, ray, walk, first touch. Geometry alone, as in render/surface/walking.py and
// render/press.py; lengths in metres, device frame. A place is {triangle, weights: [w0, w1, w2]}.

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const plus = (a, b, by = 1) => [a[0] + by * b[0], a[1] + by * b[1], a[2] + by * b[2]];
const times = (a, by) => [a[0] * by, a[1] * by, a[2] * by];
const size = (a) => Math.hypot(a[0], a[1], a[2]);
const unit = (a) => times(a, 1 / (size(a) || 1));
const across = (a, n) => plus(a, n, -dot(a, n)); // what of a is at right angles to the unit vector n

class Surface {
  constructor(vertices, normals, triangles, free) {
    Object.assign(this, { vertices, normals, triangles, free });
    this.count = triangles.length / 3;
    this.neighbours = this.acrossEdges();
    this.spheres = this.around();
  }

  corner(triangle, c) {
    const at = 3 * this.triangles[3 * triangle + c], v = this.vertices;
    return [v[at], v[at + 1], v[at + 2]];
  }

  // The triangle beyond the edge from corner c to c + 1, -1 where there is none.
  acrossEdges() {
    const owner = new Map(), t = this.triangles, most = this.vertices.length;
    const beyond = new Int32Array(t.length).fill(-1);
    for (let i = 0; i < t.length; i++) owner.set(t[i] * most + t[i % 3 === 2 ? i - 2 : i + 1], i);
    for (let i = 0; i < t.length; i++) {
      const other = owner.get(t[i % 3 === 2 ? i - 2 : i + 1] * most + t[i]);
      if (other !== undefined) beyond[i] = Math.floor(other / 3);
    }
    return beyond;
  }

  // A sphere around each triangle: x, y, z, radius; by them most triangles are passed over in a search.
  around() {
    const out = new Float32Array(4 * this.count);
    for (let i = 0; i < this.count; i++) {
      const p = [0, 1, 2].map((c) => this.corner(i, c));
      const middle = times(plus(plus(p[0], p[1]), p[2]), 1 / 3);
      out.set([...middle, Math.max(...p.map((q) => size(plus(q, middle, -1))))], 4 * i);
    }
    return out;
  }

  // Point and unit contact normal at a place.
  at(place) {
    const point = [0, 0, 0], normal = [0, 0, 0];
    for (let c = 0; c < 3; c++) {
      const v = 3 * this.triangles[3 * place.triangle + c], w = place.weights[c];
      for (let k = 0; k < 3; k++) {
        point[k] += w * this.vertices[v + k];
        normal[k] += w * this.normals[v + k];
      }
    }
    return { point, normal: unit(normal) };
  }

  // Triangles of which a part lies within `reach` of the line through `at` along the unit vector `way`.
  along(at, way, reach) {
    const found = [], s = this.spheres;
    for (let i = 0; i < this.count; i++) {
      const off = [s[4 * i] - at[0], s[4 * i + 1] - at[1], s[4 * i + 2] - at[2]];
      if (size(across(off, way)) <= reach + s[4 * i + 3]) found.push(i);
    }
    return found;
  }

  // The place nearest to a point, and its distance; among some triangles, or all.
  nearest(point, among = null) {
    let best = Infinity, place = null;
    const s = this.spheres, total = among ? among.length : this.count;
    for (let j = 0; j < total; j++) {
      const i = among ? among[j] : j;
      const least = Math.hypot(s[4 * i] - point[0], s[4 * i + 1] - point[1], s[4 * i + 2] - point[2]) - s[4 * i + 3];
      if (least >= best) continue;
      const weights = nearestInTriangle(point, this.corner(i, 0), this.corner(i, 1), this.corner(i, 2));
      const distance = size(plus(point, this.at_(i, weights), -1));
      if (distance < best) [best, place] = [distance, { triangle: i, weights }];
    }
    return { place, distance: best };
  }

  at_(triangle, w) {
    return plus(plus(times(this.corner(triangle, 0), w[0]), this.corner(triangle, 1), w[1]), this.corner(triangle, 2), w[2]);
  }

  // Where a ray from `eye` along the unit vector `way` first meets the outside, at rest; null where it misses.
  ray(eye, way) {
    let best = Infinity, place = null;
    const { triangles: t, vertices: points, spheres: m } = this;
    for (let i = 0; i < this.count; i++) {
      const x = m[4 * i] - eye[0], y = m[4 * i + 1] - eye[1], z = m[4 * i + 2] - eye[2];
      const ahead = x * way[0] + y * way[1] + z * way[2];
      if (x * x + y * y + z * z - ahead * ahead > 1.01 * m[4 * i + 3] ** 2 + 1e-12) continue;
      const [a, b, c] = [0, 1, 2].map((k) => 3 * t[3 * i + k]);
      const e1 = [points[b] - points[a], points[b + 1] - points[a + 1], points[b + 2] - points[a + 2]];
      const e2 = [points[c] - points[a], points[c + 1] - points[a + 1], points[c + 2] - points[a + 2]];
      const h = cross(way, e2), det = dot(e1, h);
      if (det <= 1e-14) continue; // from behind, or along it
      const s = [eye[0] - points[a], eye[1] - points[a + 1], eye[2] - points[a + 2]];
      const u = dot(s, h) / det;
      if (u < 0 || u > 1) continue;
      const q = cross(s, e1), v = dot(way, q) / det;
      if (v < 0 || u + v > 1) continue;
      const far = dot(e2, q) / det;
      if (far > 0 && far < best) [best, place] = [far, { triangle: i, weights: [1 - u - v, u, v] }];
    }
    return place;
  }

  // Carries a place along the surface by `move`, unfolding it over edges; the base cannot be entered.
  walk(place, move) {
    let { triangle } = place;
    let weights = [...place.weights];
    for (let step = 0; step < 64; step++) {
      const v = [0, 1, 2].map((c) => this.corner(triangle, c));
      const a = plus(v[1], v[0], -1), b = plus(v[2], v[0], -1);
      const aa = dot(a, a), ab = dot(a, b), bb = dot(b, b), ma = dot(move, a), mb = dot(move, b);
      const det = aa * bb - ab * ab, r1 = (bb * ma - ab * mb) / det, r2 = (aa * mb - ab * ma) / det;
      const rate = [-r1 - r2, r1, r2];
      let part = 1, leaving = -1;
      for (let c = 0; c < 3; c++) {
        if (rate[c] < 0 && -weights[c] > rate[c] * part) [part, leaving] = [-weights[c] / rate[c], c];
      }
      weights = weights.map((w, c) => Math.max(w + part * rate[c], 0));
      const total = weights[0] + weights[1] + weights[2];
      weights = weights.map((w) => w / total);
      if (leaving < 0) break;
      const edge = (leaving + 1) % 3, next = (edge + 1) % 3;
      const other = this.neighbours[3 * triangle + edge];
      const e = plus(v[next], v[edge], -1), length = dot(e, e), along = dot(move, e), rest = 1 - part;
      if (other < 0 || !this.free[other]) { // at the rim of the base the rest goes along it
        move = times(e, rest * along / length);
        if (rest * Math.abs(along) <= 1e-12 * length) break;
        continue;
      }
      // the rest turns with the surface: what crosses the edge goes on inwards in the neighbour's plane
      const inPlane = times(plus(times(a, r1), b, r2), rest);
      const over = size(plus(inPlane, e, -rest * along / length));
      const start = this.triangles[3 * triangle + edge], end = this.triangles[3 * triangle + next];
      const names = [0, 1, 2].map((c) => this.triangles[3 * other + c]);
      const third = names.findIndex((name) => name !== start && name !== end);
      const to = plus(this.corner(other, third), v[edge], -1);
      const inward = plus(to, e, -dot(to, e) / length);
      move = plus(times(e, rest * along / length), inward, over / size(inward));
      weights = names.map((name) => (name === start ? weights[edge] : name === end ? weights[next] : 0));
      triangle = other;
    }
    return { triangle, weights };
  }

  // Walks to where the contact normal points at `tip`.
  foot(place, tip) {
    for (let step = 0; ; step++) {
      const { point, normal } = this.at(place);
      const off = plus(tip, point, -1), height = dot(off, normal), move = across(off, normal);
      if (dot(move, move) < 1e-20 || step === 11) return { place, point, normal, height };
      place = this.walk(place, times(move, step > 3 ? 0.5 : 1));
    }
  }

  // Where the centre of a ball of this radius, on its way through `at` along the unit vector `way`, first touches;
  // null where it misses, or meets the base first.
  firstTouch(at, way, radius) {
    const near = this.along(at, way, radius + 1e-3);
    if (!near.length) return null;
    const s = this.spheres;
    const reach = Math.max(...near.map((i) => size(plus([s[4 * i], s[4 * i + 1], s[4 * i + 2]], at, -1)))) + 2 * radius;
    for (let step = 0, go = -reach; step < 400 && go <= reach; step++) {
      const centre = plus(at, way, go);
      const { place, distance } = this.nearest(centre, near);
      let gap = distance - radius;
      if (gap <= 1e-8) {
        if (!this.free[place.triangle]) return null;
        const found = this.foot(place, centre);
        gap = found.height - radius;
        if (gap <= 1e-8) return { ...found, centre };
      }
      go += Math.max(gap, 1e-8);
    }
    return null;
  }
}

// Barycentric weights of the point of a triangle that is nearest to p (Ericson, Real-Time Collision Detection, 5.1.5).
function nearestInTriangle(p, a, b, c) {
  const ab = plus(b, a, -1), ac = plus(c, a, -1), ap = plus(p, a, -1);
  const d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return [1, 0, 0];
  const bp = plus(p, b, -1), d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return [0, 1, 0];
  const vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return [1 - d1 / (d1 - d3), d1 / (d1 - d3), 0];
  const cp = plus(p, c, -1), d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return [0, 0, 1];
  const vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return [1 - d2 / (d2 - d6), 0, d2 / (d2 - d6)];
  const va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0) {
    const w = (d4 - d3) / (d4 - d3 + d5 - d6);
    return [0, 1 - w, w];
  }
  const sum = va + vb + vc;
  return [va / sum, vb / sum, vc / sum];
}
