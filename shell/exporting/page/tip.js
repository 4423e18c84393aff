// One tip, and what is seen of it: readout, chart and picture follow it.

const DOWN_M_PER_S = 0.012, UP_M_PER_S = 0.05, KEY_M = 0.001, DEEPER_M = 0.0005, MOUSE_M_PER_S = 0.05;
const SLOW_MS = 34; // a frame that takes longer is drawn with fewer pixels
const $ = (name) => document.getElementById(name);
const about = JSON.parse($("about").textContent);
const mm = (m, digits = 1) => (1e3 * m).toFixed(digits);
const NOT_YET = [...$("parts").children].map((each) => each.textContent);
const newtons = (n) => (Math.abs(n) < 9.995 ? n.toFixed(2) : n.toFixed(1));

class SeenTip {
  constructor(bytes) {
    const read = reader(bytes, about.arrays);
    const at = read("seen_at", Uint32Array), triangles = read("seen_triangles", Uint32Array);
    this.surface = new Surface(read("vertices", Float64Array), read("normals"), triangles.map((i) => at[i]), read("free", Uint8Array));
    this.tables = new Tables(read, about);
    this.presses = { points: read("press_points", Float64Array), normals: read("press_normals", Float64Array), depth: read("press_depth"), force: read("press_force"), starts: about.presses.starts };
    this.presser = new Presser(this.surface, this.tables, about, this.presses);
    this.shape = new Shape(this.surface, read, about, at, triangles);
    this.touch = new Touch(this.surface, this.tables, about.tip_radius_m, about.friction);
    this.mouse = new SpaceMouse(about.spacemouse);
    Object.assign(this, { place: null, goal: 0, depth: 0, held: false, greeting: null, pointers: new Map(), trail: [], peak: null, dirty: true, spent: [], asked: [] });
    this.wanted = about.first_depth_m;
    this.camera = new Camera(this.surface.vertices, about.support_normal, about.support_point, about.view);
    this.chart = new Chart($("chart"), this.colours());
    this.controls();
    this.view();
    window.addEventListener("hashchange", () => this.followLink());
    this.followLink();
    if (!this.curve) this.lookAt(this.topPlace());
    this.greet();
    requestAnimationFrame((now) => this.frame(now));
  }

  colours() {
    const style = getComputedStyle(document.documentElement);
    const names = ["object", "touch", "chosen", "tip", "shadow", "low", "middle", "high", "soft", "line", "paper", "measured", "fem", "hunt-crossley"];
    return Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
  }

  // The picture, where the browser can: else the page says so, and everything but the picture works.
  view() {
    try {
      this.drawing = new Drawing($("stage"), this.surface, this.shape, this.colours(), this.dots);
      document.documentElement.dataset.state = "live";
    } catch (problem) {
      this.drawing = null;
      document.documentElement.dataset.state = "flat";
      this.say(`${problem.message}, so the object cannot be turned here: press a place in the table below instead.`);
    }
    const scheme = window.matchMedia("(prefers-color-scheme: dark)");
    scheme.addEventListener("change", () => {
      this.chart.colours = this.colours();
      if (this.drawing) this.drawing.colours = this.colours();
      this.dirty = true;
    });
  }

  say(words) {
    $("say").textContent = words;
  }

  // --- the tip ---

  centre(place, depth) {
    const { point, normal } = this.surface.at(place);
    return plus(point, normal, about.tip_radius_m - depth);
  }

  // Begins a press at a place of the surface; `held`: until it is let go by a key or button, not by a finger.
  begin(place, held) {
    this.place = place;
    this.touch.hold(place);
    Object.assign(this, { depth: 0, goal: this.wanted, held, trail: [], peak: null, began: performance.now(), first: this.surface.at(place) });
    this.dirty = true;
  }

  end() {
    Object.assign(this, { goal: 0, held: false });
  }

  // Where nobody asked for a press, the tip shows by itself, once, what it does; the first thing that a person does
  // ends that.
  greet() {
    if (!this.drawing || this.place || window.matchMedia("(prefers-reduced-motion: reduce)").matches) return;
    this.begin(this.topPlace(), false);
    this.greeting = "down";
  }

  // The greeting's course: down, a moment at rest, up, and away as if nothing had been.
  goOnGreeting() {
    if (this.greeting === "down" && this.depth === this.goal) [this.greeting, this.rested] = ["rest", performance.now()];
    else if (this.greeting === "rest" && performance.now() - this.rested > 500) [this.greeting, this.goal] = ["up", 0];
    else if (this.greeting === "up" && !this.touch.touching) this.endGreeting();
  }

  endGreeting() {
    if (!this.greeting) return;
    Object.assign(this, { greeting: null, place: null, depth: 0, goal: 0, trail: [], peak: null, dirty: true });
    this.touch.release();
    for (const [name, words] of [["force", "– N"], ["band", ""]]) $(name).textContent = words;
    this.parts(NOT_YET);
  }

  // A straight press at once, as a link, the table or a script asks for it.
  pressAt(at, depth) {
    this.endGreeting();
    const { touch } = this.presser.press(at, depth);
    this.touch = touch;
    this.place = touch.touching ? touch.place : null;
    const found = this.surface.at(this.surface.nearest(at).place);
    Object.assign(this, { depth: touch.depth, goal: touch.depth, held: true, trail: [], peak: null, first: { point: at, normal: found.normal }, began: performance.now() - 1e5 * depth });
    this.straight = { at, depth };
    this.note();
    this.dirty = true;
  }

  advance(seconds) {
    const [right, away, high] = this.mouse.deflection;
    if (right || away || high) this.byMouse(right, away, high, seconds);
    if (this.greeting) this.goOnGreeting();
    if (!this.place || (this.depth === this.goal && !this.moved)) return;
    this.moved = false;
    this.straight = null;
    const most = (this.goal > this.depth ? this.quick || DOWN_M_PER_S : UP_M_PER_S) * seconds;
    this.depth += Math.min(Math.max(this.goal - this.depth, -most), most);
    if (this.depth <= 0 && this.goal <= 0) {
      this.depth = 0;
      this.touch.release();
      if (!this.tipStays) this.place = null;
    } else {
      if (!this.touch.touching) this.touch.hold(this.place);
      this.touch.moveTo(this.centre(this.place, this.depth));
      this.note();
    }
    this.dirty = true;
  }

  // Keeps the path for the CSV, and the greatest force of this press.
  note() {
    const { touch } = this;
    if (!touch.touching) return;
    if (this.trail.length < 50000) this.trail.push([(performance.now() - this.began) / 1e3, ...touch.tip, touch.depth, ...touch.force]);
    const pull = size(touch.force);
    if (!this.peak || pull >= this.peak.pull) this.peak = { pull, band: bandOf(this.tables, touch), depth: touch.depth };
  }

  byMouse(right, away, high, seconds) {
    this.endGreeting();
    this.tipStays = true;
    if (!this.place) this.begin(this.topPlace(), true);
    const far = MOUSE_M_PER_S * seconds, level = unit(across(times(this.camera.back, -1), about.support_normal));
    this.place = this.surface.walk(this.place, plus(times(this.camera.right, right * far), level, away * far));
    this.goal = Math.min(this.tables.most, Math.max(0, this.goal - high * far));
    this.quick = MOUSE_M_PER_S;
    this.moved = true;
  }

  topPlace() {
    const { vertices } = this.surface, up = about.support_normal;
    const middle = plus(this.camera.middle, up, 2 * this.camera.size);
    return this.surface.ray(middle, times(up, -1)) || this.surface.nearest(middle).place;
  }

  // --- what is shown ---

  frame(now) {
    const gone = Math.min((now - (this.last || now)) / 1e3, 0.1);
    this.last = now;
    this.advance(gone);
    if (this.dirty || this.always) {
      this.dirty = false;
      this.show();
      this.keepPace(gone);
    }
    this.frames = (this.frames || 0) + 1;
    requestAnimationFrame((next) => this.frame(next));
  }

  keepPace(gone) {
    if (!this.drawing || !gone) return;
    this.spent.push(1e3 * gone);
    if (this.spent.length < 12) return;
    const mean = this.spent.reduce((a, b) => a + b) / this.spent.length;
    this.spent = [];
    if (mean > SLOW_MS && this.drawing.ratio > 0.75) this.drawing.ratio *= 0.8;
  }

  show() {
    const { touch, place } = this;
    const at = touch.touching ? touch : place ? this.surface.at(place) : null;
    const here = at ? this.nearestPress(at.point) : null;
    if (this.drawing) {
      if (this.shape.update(touch) || this.always) this.drawing.upload();
      const hover = !touch.touching;
      const tip = touch.touching ? touch.tip : at ? plus(at.point, at.normal, about.tip_radius_m + 0.0015) : [0, 0, 0];
      this.drawing.draw(this.camera, {
        tip, normal: at ? at.normal : [0, 0, 1], radius: at ? about.tip_radius_m : 0, hover, force: touch.force,
        newton_m: 0.5 * this.camera.size / Math.max(this.strongest, 0.2), chosen: here ? here.index : -1,
      });
    }
    this.readout();
  }

  get dots() {
    return this.dots_ ??= Array.from({ length: about.presses.count }, (_, i) => [...this.presses.points.slice(3 * i, 3 * i + 3)]);
  }

  // The force of the deepest press on the top, N: the arrow's scale. At the foot forces are many times as great.
  get strongest() {
    const { triangle, weights } = this.topPlace(), corners = this.surface.triangles.subarray(3 * triangle, 3 * triangle + 3);
    return this.strongest_ ??= this.tables.response_(corners, weights, this.tables.most)[0] * this.tables.most;
  }

  nearestPress(point) {
    let index = -1, far = Infinity;
    this.dots.forEach((dot_, i) => {
      const away = size(plus(dot_, point, -1));
      if (away < far && this.presses.starts[i + 1] > this.presses.starts[i]) [index, far] = [i, away];
    });
    return index < 0 ? null : { index, far };
  }

  curves(corners, weights) {
    const depths = Array.from({ length: 33 }, (_, i) => this.tables.most * (i / 32) ** 1.5);
    const force = depths.map((d) => this.tables.response_(corners, weights, d)[0] * d);
    const band = depths.map((d, i) => force[i] * this.tables.bandShare(corners, weights, d));
    return {
      depths, force, low: force.map((f, i) => f - band[i]), high: force.map((f, i) => f + band[i]),
      oneD: this.tables.oneD && depths.map((d) => this.tables.oneDForce(corners, weights, d)),
    };
  }

  // The chart's curves are those of a place, until another one is looked at.
  lookAt(place) {
    this.curve = this.curves(this.surface.triangles.subarray(3 * place.triangle, 3 * place.triangle + 3), place.weights);
    this.beside = this.nearestPress(this.surface.at(place).point);
  }

  readout() {
    const { touch, place, tables } = this, shown = touch.touching ? touch : null;
    if (place) this.lookAt((shown || this).place);
    let measured = null;
    if (this.beside) {
      const [a, b] = [this.presses.starts[this.beside.index], this.presses.starts[this.beside.index + 1]];
      measured = { depth: this.presses.depth.subarray(a, b), force: this.presses.force.subarray(a, b) };
    }
    this.chart.draw(this.curve, measured, shown && [touch.depth, touch.normalForce], tables.most);
    $("measured-name").textContent = this.beside ? `${about.presses.word}, press ${this.beside.index + 1}, ${mm(this.beside.far)} mm away` : `${about.presses.word} press nearest by`;
    if (shown) {
      const sideways = size(across(touch.force, touch.normal));
      $("force").textContent = `${newtons(size(touch.force))} N`;
      $("band").textContent = `± ${newtons(Math.max(bandOf(tables, touch), 0.005))} N`;
      const parts = [`${mm(touch.depth)} mm deep`, `${newtons(touch.normalForce)} N inwards`, `${newtons(sideways)} N sideways${touch.slipping ? ", sliding" : ""}`];
      if (tables.oneD) parts.push(`${about.one_d_words}: ${newtons(tables.oneDForce(touch.corners, touch.place.weights, touch.depth))} N`);
      this.parts(parts);
    } else if (this.peak) {
      $("force").textContent = `${newtons(this.peak.pull)} N`;
      $("band").textContent = `± ${newtons(Math.max(this.peak.band, 0.005))} N`;
      this.parts(["greatest of the last press,", `${mm(this.peak.depth)} mm deep`]);
    }
    for (const name of ["copy", "save"]) $(name).disabled = !this.trail.length;
    $("let-go").disabled = !shown;
    this.tell(shown);
  }

  // A line or part of one for each.
  parts(words) {
    $("parts").replaceChildren(...words.flatMap((text, i) => {
      const part = document.createElement("span");
      part.textContent = text;
      return i ? [" ", part] : [part];
    }));
  }

  // For screen readers: once a press has come to rest.
  tell(shown) {
    clearTimeout(this.telling);
    if (shown) this.telling = setTimeout(() => ($("live").textContent = `${$("force").textContent} ${$("parts").textContent}`), 700);
  }
}
