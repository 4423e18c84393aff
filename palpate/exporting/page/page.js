// The page: pointer, pen, fingers, keys and links move one tip; readout, chart and picture follow it.

const DOWN_M_PER_S = 0.012, UP_M_PER_S = 0.05, KEY_M = 0.001, DEEPER_M = 0.0005, MOUSE_M_PER_S = 0.05;
const SLOW_MS = 34; // a frame that takes longer is drawn with fewer pixels
const $ = (name) => document.getElementById(name);
const about = JSON.parse($("about").textContent);
const mm = (m, digits = 1) => (1e3 * m).toFixed(digits);
const newtons = (n) => (Math.abs(n) < 9.995 ? n.toFixed(2) : n.toFixed(1));

class PressPage {
  constructor(bytes) {
    const read = reader(bytes, about.arrays);
    this.surface = new Surface(read("vertices", Float64Array), read("normals"), read("triangles", Uint32Array), read("free", Uint8Array));
    this.tables = new Tables(read, about);
    this.presses = { points: read("press_points", Float64Array), normals: read("press_normals", Float64Array), depth: read("press_depth"), force: read("press_force"), starts: about.presses.starts };
    this.presser = new Presser(this.surface, this.tables, about, this.presses);
    this.shape = new Shape(this.surface, read, about);
    this.touch = new Touch(this.surface, this.tables, about.tip_radius_m, about.friction);
    this.mouse = new SpaceMouse(about.spacemouse);
    Object.assign(this, { place: null, goal: 0, depth: 0, held: false, greeting: null, pointers: new Map(), trail: [], peak: null, dirty: true, spent: [], asked: [] });
    this.wanted = Math.min(0.6 * this.tables.most, about.tip_radius_m);
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
    const names = ["object", "dot", "chosen", "tip", "arrow", "shadow", "low", "middle", "high", "soft", "line", "paper", "measured", "rendered", "oneD"];
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
    this.parts(["not pressed yet"]);
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

  // About the greatest force that this page shows, N: the arrow's scale.
  get strongest() {
    return this.strongest_ ??= Math.max(...[0, 0.25, 0.5, 0.75].map((share) => {
      const v = Math.floor(share * this.surface.vertices.length / 3);
      return this.tables.response_([v, v, v], [1, 0, 0], this.tables.most)[0] * this.tables.most;
    }));
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
      if (tables.oneD) parts.push(`1D model: ${newtons(tables.oneDForce(touch.corners, touch.place.weights, touch.depth))} N`);
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

  // --- what a person does ---

  controls() {
    const stage = $("stage"), depth = $("depth");
    for (const kind of ["down", "move", "up", "cancel", "leave"]) stage.addEventListener(`pointer${kind}`, (event) => this[kind](event));
    stage.addEventListener("contextmenu", (event) => event.preventDefault());
    stage.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    stage.addEventListener("keydown", (event) => this.key(event));
    stage.addEventListener("focus", () => this.showTip());
    depth.max = String(+mm(this.tables.most, 2));
    depth.addEventListener("input", () => this.setDepth(+depth.value / 1e3));
    this.setDepth(this.wanted);
    $("copy").addEventListener("click", () => this.copyLink());
    $("save").addEventListener("click", () => this.saveCurve());
    $("let-go").addEventListener("click", () => this.end());
    $("reset").addEventListener("click", () => { this.camera.reset(); this.dirty = true; });
    $("colour").addEventListener("change", () => this.colour($("colour").checked));
    for (const row of document.querySelectorAll("[data-at]")) {
      row.addEventListener("click", () => this.tryPress(row.dataset.at.split(",").map(Number), this.wanted));
    }
    if (navigator.hid) {
      $("connect").hidden = false;
      $("connect").addEventListener("click", () => this.connect());
    }
    new ResizeObserver(() => (this.dirty = true)).observe(stage);
  }

  setDepth(depth) {
    this.wanted = Math.min(this.tables.most, Math.max(0.0002, depth));
    $("depth").value = mm(this.wanted, 2);
    $("depth-now").textContent = `${mm(this.wanted)} mm`;
    if (this.place && (this.held || this.pressing !== undefined) && this.goal > 0) this.goal = this.wanted;
    if (this.held && this.straight) this.tryPress(this.straight.at, this.wanted);
  }

  // The ray through a pointer, from the eye.
  rayOf(event) {
    const box = $("stage").getBoundingClientRect();
    this.camera.matrix(box.width / box.height);
    return this.camera.ray(2 * (event.clientX - box.left) / box.width - 1, 1 - 2 * (event.clientY - box.top) / box.height);
  }

  under(event) {
    const place = this.surface.ray(this.camera.eye, this.rayOf(event));
    return place && this.surface.free[place.triangle] ? place : null;
  }

  down(event) {
    if (!this.drawing) return;
    this.endGreeting();
    const stage = $("stage");
    stage.focus({ preventScroll: true });
    stage.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
    const place = this.pointers.size === 1 && event.button === 0 && !event.shiftKey ? this.under(event) : null;
    if (this.pointers.size > 1 && this.pressing !== undefined) { // a second finger turns instead
      this.pressing = undefined;
      this.end();
    }
    if (place) {
      this.pressing = event.pointerId;
      this.tipStays = event.pointerType === "mouse";
      this.begin(place, false);
      this.pen(event);
      $("hint").classList.add("done");
    }
  }

  pen(event) {
    this.quick = 0;
    if (event.pointerType !== "pen" || !(event.pressure > 0)) return;
    this.goal = event.pressure * this.tables.most;
    this.quick = 0.1;
  }

  move(event) {
    if (!this.drawing) return;
    const last = this.pointers.get(event.pointerId);
    if (!last) return this.hover(event);
    const now = [event.clientX, event.clientY], by = [now[0] - last[0], now[1] - last[1]];
    if (this.pressing === event.pointerId) {
      const place = this.under(event);
      if (place) [this.place, this.moved] = [place, true];
      this.pen(event);
    } else if (this.pointers.size === 2) {
      const other = [...this.pointers].find(([id]) => id !== event.pointerId)[1];
      const before = Math.hypot(last[0] - other[0], last[1] - other[1]), after = Math.hypot(now[0] - other[0], now[1] - other[1]);
      if (before > 0) this.camera.nearer(after / before);
      this.camera.turn(-by[0] * 0.004, by[1] * 0.004);
      this.dirty = true;
    } else {
      this.camera.turn(-by[0] * 0.008, by[1] * 0.008);
      this.dirty = true;
    }
    this.pointers.set(event.pointerId, now);
  }

  hover(event) {
    if (event.pointerType === "touch" || this.held || this.touch.touching) return;
    this.place = this.under(event);
    $("stage").style.cursor = this.place ? "none" : "grab";
    this.dirty = true;
  }

  up(event) {
    this.pointers.delete(event.pointerId);
    if (this.pressing === event.pointerId) {
      this.pressing = undefined;
      this.end();
    }
  }

  cancel(event) {
    this.up(event);
  }

  leave(event) {
    if (this.pointers.has(event.pointerId) || this.held || this.touch.touching) return;
    this.place = null;
    this.dirty = true;
  }

  wheel(event) {
    if (this.pressing !== undefined || this.held) {
      event.preventDefault();
      this.setDepth(this.wanted - Math.sign(event.deltaY) * DEEPER_M);
    } else if (document.activeElement === $("stage") || event.ctrlKey) {
      event.preventDefault();
      this.camera.nearer(Math.exp(-event.deltaY * (event.ctrlKey ? 0.01 : 0.0015)));
      this.dirty = true;
    }
  }

  // By keyboard the tip stands over the object from the moment that the picture has the focus.
  showTip() {
    if (this.place || this.pointers.size || !$("stage").matches(":focus-visible")) return;
    this.tipStays = true;
    this.place = this.topPlace();
    this.dirty = true;
  }

  key(event) {
    const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
    if (event.altKey || event.ctrlKey || event.metaKey) return;
    this.endGreeting();
    if (steps && event.shiftKey) this.camera.turn(-0.12 * steps[0], 0.12 * steps[1]);
    else if (steps) this.stepTip(steps);
    else if (event.key === " " || event.key === "Enter") this.toggle();
    else if (event.key === "+" || event.key === "=") this.setDepth(this.wanted + DEEPER_M);
    else if (event.key === "-") this.setDepth(this.wanted - DEEPER_M);
    else if (event.key === "Escape") this.end();
    else if (event.key === "0") this.camera.reset();
    else if (event.key === "[" || event.key === "]") this.camera.nearer(event.key === "]" ? 1.15 : 1 / 1.15);
    else if ((event.key === "n" || event.key === "p") && this.dots.length) this.goToPress(event.key === "n" ? 1 : -1);
    else return;
    event.preventDefault();
    this.dirty = true;
  }

  stepTip([right, up]) {
    this.tipStays = true;
    this.place ??= this.topPlace();
    const move = times(plus(times(this.camera.right, right), this.camera.top, up), KEY_M), { normal } = this.surface.at(this.place);
    const flat = across(move, normal), way = size(flat) > 0.2 * KEY_M ? flat : across(plus(move, this.camera.back, -up * KEY_M), normal);
    this.place = this.surface.walk(this.place, times(unit(way), KEY_M));
    this.moved = true;
  }

  toggle() {
    this.tipStays = true;
    if (this.held) return this.end();
    return this.begin(this.place || this.topPlace(), true);
  }

  goToPress(by) {
    this.number = ((this.number ?? (by > 0 ? -1 : 0)) + by + this.dots.length) % this.dots.length;
    this.tryPress(this.dots[this.number], this.wanted);
  }

  tryPress(at, depth) {
    try {
      this.tipStays = true;
      this.pressAt(at, depth);
      this.say("");
    } catch (problem) {
      this.say(`${problem.message}.`);
    }
  }

  async connect() {
    try {
      const name = await this.mouse.connect();
      if (name) this.say(`${name}: push the cap sideways to move the tip, down to press, up to let go.`);
    } catch (problem) {
      this.say(`The SpaceMouse could not be opened: ${problem.message}`);
    }
  }

  // --- links, files, colours ---

  // "#press=x,y,z,depth", in metres, device frame.
  followLink() {
    const asked = /^#press=(.*)$/.exec(location.hash), numbers = asked ? asked[1].split(",").map(Number) : about.opens;
    if (!numbers) return;
    if (numbers.length !== 4 || !numbers.every(Number.isFinite)) {
      this.say("The link's press must be four numbers in metres: #press=x,y,z,depth");
      return;
    }
    this.setDepth(numbers[3]);
    this.tryPress(numbers.slice(0, 3), numbers[3]);
    this.faceTip();
  }

  // Turns the view so that the tip is in front.
  faceTip() {
    if (!this.first) return;
    const { normal } = this.first, level = this.camera.level.map((axis) => dot(axis, normal));
    if (Math.hypot(...level) > 0.3) this.camera.azimuth = Math.atan2(level[1], level[0]) - 0.45;
    this.camera.look();
    this.dirty = true;
  }

  get link() {
    const deep = this.straight ? this.straight.depth : this.touch.touching ? this.touch.depth : this.peak ? this.peak.depth : 0;
    const numbers = [...(this.straight ? this.straight.at : this.first.point), deep].map((m) => +m.toFixed(6));
    return `#press=${numbers.join(",")}`;
  }

  async copyLink() {
    const { link } = this, address = location.href.split("#")[0] + link;
    history.replaceState(null, "", link);
    try {
      await navigator.clipboard.writeText(address);
      this.say("The link is copied: it opens this page on this press.");
    } catch {
      this.say("The link stands in the address bar: copy it from there.");
    }
  }

  // The columns of `palpate press`, so that `palpate press --expect` reads it.
  get csv() {
    const rows = this.trail.map((row) => row.map((v, i) => +v.toFixed(i ? 9 : 6)).join(","));
    return ["t,x,y,z,depth,fx,fy,fz", ...rows].join("\n") + "\n";
  }

  saveCurve() {
    const file = document.createElement("a");
    file.href = URL.createObjectURL(new Blob([this.csv], { type: "text/csv" }));
    file.download = `${about.name}-press.csv`;
    file.click();
    setTimeout(() => URL.revokeObjectURL(file.href), 10000);
    this.say(`Saved ${this.trail.length} samples: t,x,y,z,depth,fx,fy,fz in s, m and N.`);
  }

  colour(by) {
    if (!this.drawing) return;
    $("scale").hidden = !by;
    if (!by) this.drawing.colourBy(null);
    else {
      const at = 1e-3, count = this.surface.vertices.length / 3;
      const values = Float32Array.from({ length: count }, (_, v) => this.tables.response_([v, v, v], [1, 0, 0], at)[0]);
      const sorted = values.slice().sort(), low = sorted[Math.floor(0.02 * count)], high = sorted[Math.floor(0.98 * count)];
      $("low").textContent = `${low.toPrecision(3)}`;
      $("high").textContent = `${Math.max(high, 1.3 * low).toPrecision(3)} N/m`;
      this.drawing.colourBy(values.map((v) => Math.min(1, Math.max(0, (v - low) / Math.max(high - low, 0.3 * low)))));
    }
    this.dirty = true;
  }

  // Frames a second with everything drawn anew each time, over some seconds.
  async measure(seconds) {
    this.always = true;
    const [first, start] = [this.frames, performance.now()];
    await new Promise((done) => setTimeout(done, 1e3 * seconds));
    this.always = false;
    return 1e3 * (this.frames - first) / (performance.now() - start);
  }
}

// For scripts: window.palpate.press([x, y, z], depth_m, [direction]) -> {force_n: [fx, fy, fz], error_n}, N on the tool,
// device frame, straight along the inward normal there unless a direction is given.
(async () => {
  const bytes = await unpacked($("block").textContent);
  if (!bytes) {
    $("say").textContent = "This browser is from before 2023 and cannot unpack this page; the picture and the table stay.";
    return;
  }
  const page = new PressPage(bytes);
  window.palpate = {
    page,
    ready_ms: performance.now(), // since the page began to load
    press(at, depth_m, direction = null) {
      const { force_n, error_n } = page.presser.press(at, depth_m, direction);
      return { force_n: [...force_n], error_n };
    },
    frames: (seconds) => page.measure(seconds),
  };
})();
