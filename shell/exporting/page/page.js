// The page: pointer, pen, fingers, keys and links move the tip (tip.js).

class PressPage extends SeenTip {
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
      row.addEventListener("click", () => {
        this.pressInSight(row.dataset.at.split(",").map(Number));
        stage.scrollIntoView({ block: "nearest" });
      });
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
    if ($("colour").checked) this.colour(true);
  }

  // The ray through a pointer, from the eye.
  rayOf(event) {
    const box = $("stage").getBoundingClientRect();
    this.camera.matrix(box.width / box.height);
    return this.camera.ray(2 * (event.clientX - box.left) / box.width - 1, 1 - 2 * (event.clientY - box.top) / box.height);
  }

  under(event) {
    const way = this.rayOf(event); // places the eye, as no frame may have been drawn yet
    const place = this.surface.ray(this.camera.eye, way);
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
    this.pressInSight(this.dots[this.number]);
  }

  // A press at a place of the table, which may lie on the far side.
  pressInSight(at) {
    this.tryPress(at, this.wanted);
    if (this.first && dot(this.first.normal, this.camera.back) < 0.2) this.faceTip();
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
      // at the depth of the next press: what lies deep shows where one presses deep
      const at = this.wanted, count = this.surface.vertices.length / 3;
      const values = Float32Array.from({ length: count }, (_, v) => this.tables.response_([v, v, v], [1, 0, 0], at)[0]);
      const sorted = values.slice().sort(), valueAt = (share) => sorted[Math.floor(share * (count - 1))];
      // Tukey's fence: a stiff rim would take all colours from what lies inside
      const fence = valueAt(0.75) + 1.5 * (valueAt(0.75) - valueAt(0.25)), low = valueAt(0.02), high = Math.min(valueAt(0.98), fence);
      $("stiffness").textContent = `stiffness at ${mm(at)} mm`;
      $("low").textContent = `${low.toPrecision(3)}`;
      $("high").textContent = `${high < valueAt(1) ? "≥ " : ""}${Math.max(high, 1.3 * low).toPrecision(3)} N/m`;
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
