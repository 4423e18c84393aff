// The shape that is drawn: the far field moves the whole surface (the compliance's strongest modes), and under the
// tip a dent is drawn that clears the ball, as render/base.py draws it. Drawing alone: no force comes from here.

class Shape {
  constructor(surface, read, about, at, triangles) {
    Object.assign(this, { surface, at, triangles });
    this.modes = read("far");
    this.nodes = read("nodes", Uint32Array);
    this.weights = read("node_weights");
    this.modulus = about.young_modulus_pa;
    this.corners = this.nodes.reduce((most, n) => Math.max(most, n), 0) + 1;
    const rows = about.arrays.far.shape[0];
    this.rank = about.arrays.far.shape[1];
    this.corners = Math.max(this.corners, rows / 3 + 1); // the last one is the base, which does not move
    this.moved = new Float32Array(3 * this.corners);
    this.points = Float32Array.from(surface.vertices);
    this.drawn = this.seen(this.points);
    // by what show/light.py lights it: smooth but for creases, and turned as the facets turn
    this.facets = Float32Array.from(this.normalsOf(this.drawn));
    this.rest = read("seen_normals");
    this.normals = Float32Array.from(this.rest);
    this.still = true;
  }

  // Points and normals under a touch; at rest where there is none. Whether anything changed.
  update(touch) {
    if (!touch.touching) {
      if (this.still) return false;
      this.seen(this.surface.vertices, this.drawn);
      this.normals.set(this.rest);
      this.still = true;
      return true;
    }
    this.still = false;
    this.far(touch);
    this.dent(touch);
    const now = this.normalsOf(this.seen(this.points, this.drawn));
    for (let i = 0; i < now.length; i++) this.normals[i] = this.rest[i] + now[i] - this.facets[i];
    return true;
  }

  far(touch) {
    const { modes, rank, moved } = this, base = modes.length / (3 * rank), load = new Float64Array(rank);
    touch.corners.forEach((vertex, c) => {
      for (let j = 0; j < 3; j++) {
        const node = this.nodes[3 * vertex + j], weight = touch.place.weights[c] * this.weights[3 * vertex + j];
        if (node >= base) continue;
        for (let k = 0; k < 3; k++) {
          const by = -weight * touch.force[k] / this.modulus, row = (3 * node + k) * rank;
          for (let r = 0; r < rank; r++) load[r] += by * modes[row + r];
        }
      }
    });
    for (let i = 0; i < 3 * base; i++) {
      let sum = 0;
      for (let r = 0, row = i * rank; r < rank; r++) sum += modes[row + r] * load[r];
      moved[i] = sum;
    }
    const { vertices } = this.surface, { nodes, weights, points } = this;
    for (let v = 0; v < points.length; v += 3) {
      const [a, b, c] = [3 * nodes[v], 3 * nodes[v + 1], 3 * nodes[v + 2]];
      const p = weights[v], q = weights[v + 1], s = weights[v + 2];
      for (let k = 0; k < 3; k++) {
        points[v + k] = vertices[v + k] + p * moved[a + k] + q * moved[b + k] + s * moved[c + k];
      }
    }
  }

  dent({ point, normal, radius, depth, tip }) {
    const { vertices } = this.surface, { points } = this, near = [];
    let best = Infinity, lacks = depth;
    for (let v = 0; v < points.length; v += 3) {
      const squared = (vertices[v] - point[0]) ** 2 + (vertices[v + 1] - point[1]) ** 2 + (vertices[v + 2] - point[2]) ** 2;
      if (squared >= 16 * radius * radius) continue;
      near.push(v, squared);
      if (squared < best) {
        best = squared;
        lacks = depth;
        for (let k = 0; k < 3; k++) lacks += (points[v + k] - vertices[v + k]) * normal[k];
      }
    }
    for (let i = 0; i < near.length; i += 2) {
      const v = near[i], by = lacks * Math.exp(-near[i + 1] / (2 * radius * radius));
      for (let k = 0; k < 3; k++) points[v + k] -= by * normal[k];
      const away = [points[v] - tip[0], points[v + 1] - tip[1], points[v + 2] - tip[2]];
      const height = dot(away, normal), flat = dot(away, away) - height * height;
      const floor = -Math.sqrt(Math.max(radius * radius - flat, 0));
      if (flat < radius * radius && height > floor && height < radius) {
        for (let k = 0; k < 3; k++) points[v + k] += (floor - height) * normal[k];
      }
    }
  }

  // What is drawn of rows of three numbers a vertex, each once on either side of a crease.
  seen(rows, out = new Float32Array(3 * this.at.length)) {
    this.at.forEach((v, i) => {
      for (let k = 0; k < 3; k++) out[3 * i + k] = rows[3 * v + k];
    });
    return out;
  }

  // Unit normals of the facets around each point that is drawn.
  normalsOf(p) {
    const t = this.triangles, out = (this.sums ??= new Float32Array(p.length)).fill(0);
    for (let i = 0; i < t.length; i += 3) {
      const a = 3 * t[i], b = 3 * t[i + 1], c = 3 * t[i + 2];
      const ux = p[b] - p[a], uy = p[b + 1] - p[a + 1], uz = p[b + 2] - p[a + 2];
      const vx = p[c] - p[a], vy = p[c + 1] - p[a + 1], vz = p[c + 2] - p[a + 2];
      const x = uy * vz - uz * vy, y = uz * vx - ux * vz, z = ux * vy - uy * vx;
      out[a] += x; out[a + 1] += y; out[a + 2] += z;
      out[b] += x; out[b + 1] += y; out[b + 2] += z;
      out[c] += x; out[c + 1] += y; out[c + 2] += z;
    }
    for (let i = 0; i < out.length; i += 3) {
      const by = 1 / (Math.hypot(out[i], out[i + 1], out[i + 2]) || 1);
      out[i] *= by; out[i + 1] *= by; out[i + 2] *= by;
    }
    return out;
  }
}
