// The force of a touch, interpolated in the tables that the renderer made (tables.py says what they hold). A touch
// follows a path by its table: the straight press at this place and depth, plus what each sideways move changes, on
// Coulomb's cone. Forces in N on the tool, device frame. What it leaves out: memory of the material and of the order
// in which one pressed, other tips, and the support beside the object.

const CHANNELS = 14;
const STEPS = 160; // of a straight press
const WALKS = 10; // of the place that holds a tip, in one step
const STEEPNESS = 1 / 1.3; // about: forces go as the depth to the power of 1.3

class Tables {
  constructor(read, about) {
    this.depths = about.depths_m;
    this.most = about.depths_m[about.depths_m.length - 1];
    this.response = { weights: read("response_weights"), basis: read("response_basis") };
    this.oneD = about.one_d ? { weights: read("one_d_weights"), basis: read("one_d_basis") } : null;
    this.band = { weights: read("band_weights"), basis: read("band_basis") };
    this.out = new Float64Array(CHANNELS);
    const bends = read("bends", Uint32Array), first = about.arrays.vertices.shape[0];
    this.bends = new Map();
    for (let i = 0; i < bends.length; i += 2) this.bends.set(bends[i] * first + bends[i + 1], first + i / 2);
    this.first = first;
    this.six = { rows: [], weights: [] };
  }

  // The rows of the response's modes that speak for a place, and how much: its corners, and the middles of those of
  // its edges over which the surface bends (quadratic between them).
  spoken(corners, weights) {
    const { rows, weights: shares } = this.six;
    rows.length = shares.length = 0;
    for (let c = 0; c < 3; c++) {
      rows.push(corners[c]);
      shares.push(weights[c]);
      const a = corners[c], b = corners[(c + 1) % 3], by = 4 * weights[c] * weights[(c + 1) % 3];
      const middle = by > 0 ? this.bends.get(a < b ? a * this.first + b : b * this.first + a) : undefined;
      if (middle === undefined) continue;
      rows.push(middle);
      shares.push(by);
    }
    return this.six;
  }

  // Values of some modes (columns for each depth) at a place and depth; the depths go as squares of their number.
  mixed(modes, columns, corners, weights, depth, out, fromZero = true) {
    const count = this.depths.length, rank = modes.basis.length / (count * columns);
    const position = Math.sqrt(Math.max(depth, 0) / this.most) * count;
    const upper = Math.min(Math.max(Math.ceil(position), 1), count), share = position - (upper - 1);
    out.fill(0);
    for (let r = 0; r < rank; r++) {
      let weight = 0;
      for (let c = 0; c < corners.length; c++) weight += weights[c] * modes.weights[corners[c] * rank + r];
      const row = r * count * columns, high = row + (upper - 1) * columns, low = high - columns;
      for (let k = 0; k < columns; k++) {
        const below = upper > 1 ? modes.basis[low + k] : fromZero ? 0 : modes.basis[high + k];
        out[k] += weight * (below + share * (modes.basis[high + k] - below));
      }
    }
    return out;
  }

  response_(corners, weights, depth) {
    const spoken = this.spoken(corners, weights);
    return this.mixed(this.response, CHANNELS, spoken.rows, spoken.weights, depth, this.out);
  }

  // Normal force, N, of the 1D model.
  oneDForce(corners, weights, depth) {
    if (!this.oneD || depth <= 0) return 0;
    return depth * this.mixed(this.oneD, 1, corners, weights, depth, [0], false)[0];
  }

  // 95 % half width of the force, over the force.
  bandShare(corners, weights, depth) {
    return this.mixed(this.band, 1, corners, weights, depth, [0], false)[0];
  }
}

class Touch {
  constructor(surface, tables, radius, friction) {
    Object.assign(this, { surface, tables, radius, friction });
    this.release();
  }

  release() {
    this.place = null;
    this.depth = 0;
    this.force = [0, 0, 0];
    this.normalForce = 0;
    this.slipping = false;
  }

  // Holds a tip at a place of the surface, with its centre straight above by the tip's radius, or nearly so.
  hold(place, tip = null) {
    this.place = place;
    this.settle();
    this.tip = tip || plus(this.point, this.normal, this.radius);
    this.depth = 0;
    this.offset = this.from(this.tip).offset;
    this.stuck = [0, 0, 0]; // sideways force of sideways moves
    this.lifted = 0; // normal force of sideways moves
    this.force = [0, 0, 0];
    this.normalForce = 0;
    this.slipping = false;
  }

  settle() {
    Object.assign(this, this.surface.at(this.place));
    const first = 3 * this.place.triangle, t = this.surface.triangles;
    this.corners = [t[first], t[first + 1], t[first + 2]];
  }

  get touching() {
    return this.place !== null;
  }

  // Moves the tip's centre, in steps short beside the table's.
  moveTo(tip) {
    const way = plus(tip, this.tip, -1), parts = Math.max(1, Math.ceil(size(way) / (this.tables.most / 64)));
    const from = this.tip;
    for (let i = 1; i <= parts && this.place; i++) this.step(plus(from, way, i / parts));
  }

  step(tip) {
    this.tip = tip;
    this.slipping = false;
    const { depth, offset } = this.from(tip);
    if (depth <= 0) return this.depth > 0 || depth < -1e-5 ? this.release() : undefined; // or not yet in
    this.shift(depth, offset);
    return this.balance();
  }

  // The same place at another depth and sideways offset, both from where the tip first touched.
  shift(depth, offset) {
    const { tables, corners, normal } = this, weights = this.place.weights;
    if (depth < this.depth) { // what the shrinking contact lets go of
      const before = tables.response_(corners, weights, this.depth)[4];
      const left = Math.min(1, Math.max(0, tables.response_(corners, weights, depth)[4] / before));
      this.stuck = times(this.stuck, left);
      this.lifted *= left;
    }
    const move = plus(offset, this.offset, -1);
    if (dot(move, move) > 0) {
      // as stiff as where the straight press has this normal force
      const middle = 0.5 * (depth + this.depth), straight = tables.response_(corners, weights, middle)[0] * middle;
      const deeper = Math.min(Math.max(1 + this.lifted / straight, 0.3), 2) ** STEEPNESS || 1;
      const now = tables.response_(corners, weights, middle * deeper);
      this.stuck = plus(this.stuck, across(stiffness(now, move), normal), -1);
      this.lifted += dot([now[11], now[12], now[13]], move);
    }
    this.depth = depth;
    this.offset = offset;
  }

  from(tip) {
    const off = plus(tip, this.point, -1), height = dot(off, this.normal);
    return { depth: this.radius - height, offset: plus(off, this.normal, -height) };
  }

  // Force from the table and what has gathered sideways; where that is too much for Coulomb's cone, the place that
  // holds the tip walks after it.
  balance() {
    for (let walk = 0; ; walk++) {
      const now = this.tables.response_(this.corners, this.place.weights, this.depth);
      const own = across([now[1] * this.depth, now[2] * this.depth, now[3] * this.depth], this.normal);
      const push = Math.max(now[0] * this.depth + this.lifted, 0);
      let sideways = plus(own, this.stuck);
      const pull = size(sideways), most = this.friction * push;
      if (pull > most * 1.001 + 1e-9) {
        this.slipping = true;
        const along = times(sideways, 1 / pull);
        if (walk < WALKS && push > 0) {
          const stiff = Math.max(dot(along, stiffness(now, along)), 1e-3);
          // never farther than it is stretched, however soft the first touch is
          const far = Math.min(0.9 * (pull - most) / stiff, size(this.offset) + 0.2 * this.depth);
          const before = this.place;
          this.place = this.surface.walk(before, times(along, -far));
          this.settle();
          const { depth, offset } = this.from(this.tip);
          if (depth > 0) {
            this.stuck = across(this.stuck, this.normal); // along the surface where it holds now, not where it did
            this.shift(depth, offset);
            continue;
          }
          this.place = before; // it would walk out from under the tip
          this.settle();
        }
        sideways = times(along, most);
        this.stuck = plus(sideways, own, -1);
      }
      this.normalForce = push;
      this.force = plus(times(this.normal, push), sideways);
      return undefined;
    }
  }
}

// Sideways stiffness times a sideways move, N.
function stiffness(c, s) {
  return [
    c[4] * s[0] + c[5] * s[0] + c[8] * s[1] + c[9] * s[2],
    c[4] * s[1] + c[8] * s[0] + c[6] * s[1] + c[10] * s[2],
    c[4] * s[2] + c[9] * s[0] + c[10] * s[1] + c[7] * s[2],
  ];
}

// A straight press, as `palpate press` makes it: the tip's centre aimed at `at` along `way`, in by `depth` along the
// normal. Without a way: the inward normal there, of a measured press where one was made, else of the surface.
// Throws RangeError where it misses the object or goes deeper than the tables.
class Presser {
  constructor(surface, tables, about, presses) {
    Object.assign(this, { surface, tables, about, presses });
  }

  inward(at) {
    const { points, normals } = this.presses;
    let best = 1e-4, found = -1;
    for (let i = 0; i < points.length; i += 3) {
      const far = Math.hypot(points[i] - at[0], points[i + 1] - at[1], points[i + 2] - at[2]);
      if (far < best) [best, found] = [far, i];
    }
    if (found >= 0) return [-normals[found], -normals[found + 1], -normals[found + 2]];
    return times(this.surface.at(this.surface.nearest(at).place).normal, -1);
  }

  press(at, depth, way = null) {
    if (!(depth >= 0 && depth <= this.tables.most * 1.0001)) {
      throw new RangeError(`depth is ${depth} m; this page presses 0 to ${this.tables.most.toPrecision(4)} m`);
    }
    const into = unit(way || this.inward(at)), radius = this.about.tip_radius_m;
    const found = this.surface.firstTouch(at, into, radius);
    const steep = found ? -dot(found.normal, into) : 0;
    if (steep < Math.cos(80 * Math.PI / 180)) throw new RangeError("the press misses the object or grazes it");
    const touch = new Touch(this.surface, this.tables, radius, this.about.friction);
    touch.hold(found.place, found.centre);
    for (let i = 1; i <= STEPS && touch.touching; i++) {
      touch.step(plus(found.centre, into, depth * (i / STEPS) ** 2 / steep));
    }
    return { touch, found, force_n: touch.force, error_n: touch.touching ? bandOf(this.tables, touch) : 0 };
  }
}

// 95 % half width of a touch's force, N.
function bandOf(tables, touch) {
  return size(touch.force) * tables.bandShare(touch.corners, touch.place.weights, touch.depth);
}
