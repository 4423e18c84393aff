// The object in 3D: turned, coloured, asked. One call a section.view3d; docs/decisions/0140 says why so.
(function () {
"use strict";
const THREE = window.THREE;
const RAD = Math.PI / 180;
const FIELD_DEG = 28, LOWEST_DEG = -5, HIGHEST_DEG = 89, TURN_DEG = 8;
const UNNAMED = 8;  // of the table of colours, for curves that are compared once
const NAMES = {into: "force into the surface [N]", sideways: "force sideways [N]",
  "into less": "less the measured force, into the surface [N]", "sideways less": "less the measured force, sideways [N]"};

const bytes = text => Uint8Array.from(atob(text), c => c.charCodeAt(0)).buffer;
const floats = text => new Float32Array(bytes(text));
const shares = text => Float32Array.from(new Int16Array(bytes(text)), whole => whole / 32767);
const whole = text => new Uint32Array(bytes(text));
const said = (value, digits = 3) => !Number.isFinite(value) ? "–" : Number(value.toPrecision(digits)).toString();
const el = (tag, attributes = {}, text = "") => {
  const made = tag === "svg" || el.drawn.has(tag)
    ? document.createElementNS("http://www.w3.org/2000/svg", tag) : document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  if (text) made.textContent = text;
  return made;
};
el.drawn = new Set(["path", "line", "text", "g", "title"]);

function ramp(stops) {
  const colours = stops.map(hex => new THREE.Color(hex));
  return (share, into) => {
    const at = Math.min(Math.max(share, 0), 1) * (colours.length - 1), k = Math.min(Math.floor(at), colours.length - 2);
    return into.copy(colours[k]).lerp(colours[k + 1], at - k);
  };
}

function start(root) {
  const data = JSON.parse(root.querySelector("script.data").textContent);
  const part = name => root.querySelector("." + name);
  const stage = part("stage"), tip = part("tip"), by = part("by"), axis = part("axis");
  const points = shares(data.points).map(share => share * data.reach);
  const triangles = data.wide ? whole(data.triangles) : new Uint16Array(bytes(data.triangles));
  const up = new THREE.Vector3(...data.up), aside = new THREE.Vector3(...data.aside);
  const across = new THREE.Vector3().crossVectors(up, aside);
  const places = floats(data.places), count = places.length / 3;
  const place = k => new THREE.Vector3().fromArray(places, 3 * k);
  const colourings = data.colourings.map(c => ({...c, ramp: ramp(c.stops), surface: c.surface && floats(c.surface),
    known: c.known && Array.from(new Uint8Array(bytes(c.known)), v => v / 255), presses: c.presses && floats(c.presses)}));
  const style = name => getComputedStyle(root).getPropertyValue(name).trim();

  const renderer = new THREE.WebGLRenderer({antialias: true, alpha: true});
  stage.prepend(renderer.domElement);
  renderer.domElement.setAttribute("aria-hidden", "true");
  const scene = new THREE.Scene(), camera = new THREE.PerspectiveCamera(FIELD_DEG, 1, 1, 1e5);
  // brightness goes evenly with the normal, all around: a lamp ends where a surface turns away, and leaves a band there
  const sky = new THREE.HemisphereLight(0xffffff, 0x7d7d80, 1.05);
  sky.position.set(-0.4, 0.75, 0.53).multiplyScalar(1e9);  // far off, over the eye's shoulder
  camera.add(sky);
  scene.add(camera);

  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(points, 3));
  const shade = new Float32Array(points.length);
  geometry.setAttribute("color", new THREE.BufferAttribute(shade, 3));
  geometry.setAttribute("normal", new THREE.BufferAttribute(shares(data.normals), 3));
  geometry.setIndex(new THREE.BufferAttribute(triangles, 1));
  geometry.computeBoundingSphere();
  const middle = geometry.boundingSphere.center.clone(), size = geometry.boundingSphere.radius;
  const body = new THREE.Mesh(geometry, new THREE.MeshPhongMaterial({vertexColors: true, shininess: 18, specular: 0x151515}));
  scene.add(body);
  floor();
  const dot = 0.03 * size;
  const dots = new THREE.InstancedMesh(new THREE.SphereGeometry(dot, 20, 14), new THREE.MeshPhongMaterial({shininess: 30, specular: 0x222222}), Math.max(count, 1));
  dots.count = count;
  for (let k = 0; k < count; k++) dots.setMatrixAt(k, new THREE.Matrix4().setPosition(place(k)));
  scene.add(dots);
  const halo = new THREE.Mesh(new THREE.SphereGeometry(1.75 * dot, 24, 16), new THREE.MeshBasicMaterial({side: THREE.BackSide}));
  halo.visible = false;
  scene.add(halo);

  function floor() {  // seen from above alone, with the shade of what stands on it
    const turn = new THREE.Quaternion().setFromRotationMatrix(new THREE.Matrix4().makeBasis(aside, across, up));
    const foot = middle.clone().addScaledVector(up, data.floor - middle.dot(up) - 0.002 * size);
    const plane = new THREE.Mesh(new THREE.CircleGeometry(1.75 * size, 64), new THREE.MeshBasicMaterial());
    const canvas = el("canvas", {width: 128, height: 128}), ink = canvas.getContext("2d");
    const fade = ink.createRadialGradient(64, 64, 20, 64, 64, 64);
    fade.addColorStop(0, "rgba(10,15,25,.42)");
    fade.addColorStop(1, "rgba(10,15,25,0)");
    ink.fillStyle = fade;
    ink.fillRect(0, 0, 128, 128);
    const reach = [0, 0];
    for (let k = 0; k < points.length; k += 3) {
      const off = new THREE.Vector3().fromArray(points, k).sub(middle);
      reach[0] = Math.max(reach[0], Math.abs(off.dot(aside)));
      reach[1] = Math.max(reach[1], Math.abs(off.dot(across)));
    }
    const shadow = new THREE.Mesh(new THREE.PlaneGeometry(2.7 * reach[0], 2.7 * reach[1]),
      new THREE.MeshBasicMaterial({map: new THREE.CanvasTexture(canvas), transparent: true, depthWrite: false}));
    plane.quaternion.copy(turn);
    shadow.quaternion.copy(turn);
    plane.position.copy(foot);
    shadow.position.copy(foot).addScaledVector(up, 0.002 * size);
    scene.add(plane, shadow);
    floor.plane = plane;
  }

  // ---- what is seen
  const usual = {azimuth: data.azimuth, elevation: data.elevation, distance: 1.12 * size / Math.sin(FIELD_DEG * RAD / 2)};
  const look = {...usual};
  let selected = -1, waiting = false;
  function draw() {
    waiting = false;
    const narrow = Math.max(1, 1.05 / camera.aspect);
    const [a, e] = [look.azimuth * RAD, look.elevation * RAD];
    camera.position.copy(middle).addScaledVector(aside, narrow * look.distance * Math.cos(e) * Math.cos(a))
      .addScaledVector(across, narrow * look.distance * Math.cos(e) * Math.sin(a))
      .addScaledVector(up, narrow * look.distance * Math.sin(e));
    camera.up.copy(up);
    camera.near = look.distance / 100;
    camera.far = 20 * look.distance;
    camera.lookAt(middle);
    camera.updateProjectionMatrix();
    renderer.render(scene, camera);
    for (const key of Object.keys(look)) stage.dataset[key] = look[key].toFixed(2);
  }
  const redraw = () => { if (!waiting) { waiting = true; requestAnimationFrame(draw); } };
  function turn(azimuth, elevation) {
    look.azimuth += azimuth;
    look.elevation = Math.min(Math.max(look.elevation + elevation, LOWEST_DEG), HIGHEST_DEG);
    redraw();
  }
  function zoom(factor) {
    look.distance = Math.min(Math.max(look.distance * factor, 0.25 * usual.distance), 3 * usual.distance);
    redraw();
  }
  const reset = () => { Object.assign(look, usual); redraw(); };
  function resize() {
    const {clientWidth: w, clientHeight: h} = stage;
    if (!w || !h) return;
    renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    renderer.setSize(w, h, false);
    camera.aspect = w / h;
    draw();  // a canvas of a new size is blank: a frame later would be seen
  }

  // ---- colours
  function colour() {
    const chosen = colourings[by.selectedIndex], plain = new THREE.Color(style("--object")), unknown = new THREE.Color(style("--unknown")), mix = new THREE.Color();
    const share = value => (value - chosen.low) / (chosen.high - chosen.low || 1);
    for (let k = 0; k < points.length / 3; k++) {
      const value = chosen.surface ? chosen.surface[k] : NaN;
      if (Number.isFinite(value)) {
        chosen.ramp(share(value), mix);
        if (chosen.known) mix.lerp(unknown, 1 - chosen.known[k]);
      } else mix.copy(chosen.surface ? unknown : plain);
      mix.toArray(shade, 3 * k);
    }
    geometry.attributes.color.needsUpdate = true;
    const unmarked = new THREE.Color(style("--touch"));
    for (let k = 0; k < count; k++) {
      const value = chosen.presses ? chosen.presses[k] : NaN;
      dots.setColorAt(k, Number.isFinite(value) ? chosen.ramp(share(value), mix) : unmarked);
    }
    if (dots.instanceColor) dots.instanceColor.needsUpdate = true;
    floor.plane.material.color.set(style("--floor"));
    halo.material.color.set(style("--ink"));
    part("ramp").style.background = `linear-gradient(to right, ${chosen.stops.join(",")})`;
    const unit = chosen.unit ? " " + chosen.unit : "";
    part("low").textContent = (chosen.cut_low ? "≤ " : "") + said(chosen.low) + unit;
    part("high").textContent = (chosen.cut_high ? "≥ " : "") + said(chosen.high) + unit;
    part("words").textContent = chosen.words;
    redraw();
  }

  // ---- what is under the pointer
  const ray = new THREE.Raycaster();
  function under(event) {
    const box = renderer.domElement.getBoundingClientRect();
    const at = new THREE.Vector2(2 * (event.clientX - box.left) / box.width - 1, 1 - 2 * (event.clientY - box.top) / box.height);
    ray.setFromCamera(at, camera);
    const hit = ray.intersectObjects([dots, body])[0];
    if (!hit) return null;
    if (hit.object === dots) return {press: hit.instanceId, point: place(hit.instanceId)};
    const corner = [hit.face.a, hit.face.b, hit.face.c], bary = new THREE.Vector3();
    const [a, b, c] = corner.map(k => new THREE.Vector3().fromArray(points, 3 * k));
    THREE.Triangle.getBarycoord(hit.point, a, b, c, bary);
    return {press: -1, point: hit.point, corner, weight: bary.toArray()};
  }
  function nearest(point) {
    let best = -1, least = Infinity;
    for (let k = 0; k < count; k++) {
      const d = place(k).distanceToSquared(point);
      if (d < least) [best, least] = [k, d];
    }
    return best;
  }
  function numbers(hit) {
    const at = hit.point.toArray().map((v, k) => (v + data.middle[k]).toFixed(0)).join(", ");
    const lines = [hit.press < 0 ? `(${at}) mm` : `press ${hit.press + 1} at (${at}) mm`];
    for (const c of colourings) {
      let value = NaN, faint = false;
      if (hit.press >= 0 && c.presses) value = c.presses[hit.press];
      else if (hit.corner && c.surface) {
        value = hit.corner.reduce((sum, k, i) => sum + hit.weight[i] * c.surface[k], 0);
        faint = c.known && Math.max(...hit.corner.map(k => c.known[k])) < 0.3;
      }
      if (Number.isFinite(value)) lines.push(`${c.name}: ` + (faint ? "nobody touched near" : said(value) + (c.unit ? " " + c.unit : "")));
    }
    return lines;
  }
  function hover(event) {
    const hit = under(event);
    stage.style.cursor = hit ? "pointer" : "grab";
    tip.hidden = !hit;
    if (!hit) return;
    tip.replaceChildren(...numbers(hit).map((line, k) => el(k ? "div" : "strong", {}, line)));
    const box = stage.getBoundingClientRect(), x = event.clientX - box.left, y = event.clientY - box.top;
    tip.style.left = Math.max(0, Math.min(x + 14, box.width - tip.offsetWidth - 4)) + "px";
    tip.style.top = (y + tip.offsetHeight + 20 > box.height ? y - tip.offsetHeight - 10 : y + 16) + "px";
  }

  // ---- one press: its numbers and its curve
  const curves = data.curves && {...data.curves, starts: whole(data.curves.starts), depth: floats(data.curves.depth),
    time: floats(data.curves.time), lines: data.curves.lines.map((line, k) => ({...line, into: floats(line.into), sideways: floats(line.sideways), depth: line.depth && floats(line.depth),
      colour: style("--" + line.kind) ? `var(--${line.kind})` : `var(--unnamed-${k % UNNAMED})`}))};
  function select(k, told = true) {
    if (!(k >= 0 && k < count)) return;
    selected = k;
    root.dataset.selected = k + 1;
    halo.position.copy(place(k));
    halo.visible = true;
    const row = data.table.rows[k];
    part("press-name").textContent = `Press ${k + 1}`;
    part("numbers").textContent = data.table.head.slice(1).map((name, i) => {
      const [, what, unit] = name.match(/^(.*?)(?: \[(.*)\])?$/);
      return `${what.replace("at x, y, z", "at")} ${row[i + 1]}${unit ? "\u00a0" + unit : ""}`;
    }).join("; ");
    part("numbers").setAttribute("aria-live", told ? "polite" : "off");
    for (const other of root.querySelectorAll("tr[aria-selected]")) other.removeAttribute("aria-selected");
    root.querySelectorAll("details.presses tbody tr")[k]?.setAttribute("aria-selected", "true");
    plot();
    redraw();
  }
  function plot() {
    if (!curves) return;  // the page has no curves, nor a place for them
    const svg = part("curve");
    svg.replaceChildren();
    if (selected < 0) return;
    const [a, b] = [curves.starts[selected], curves.starts[selected + 1]];
    const over = (line, k) => axis.value === "time" ? curves.time[k] : (line.depth || curves.depth)[k];
    const [part_of, less] = part("what").value.split(" "), measured = curves.lines.find(line => line.kind === "measured");
    const shown = curves.lines.filter(line => line.shown && !(less && line === measured));
    const at = (line, k) => less ? line[part_of][k] - measured[part_of][k] : line[part_of][k];
    let [x0, x1, y0, y1] = [Infinity, -Infinity, 0, less ? 0.02 : 0.1];
    for (let k = a; k < b; k++) {
      for (const line of shown) [x0, x1] = [Math.min(x0, over(line, k)), Math.max(x1, over(line, k))];
      for (const line of shown) if (Number.isFinite(at(line, k))) [y0, y1] = [Math.min(y0, at(line, k)), Math.max(y1, at(line, k))];
    }
    const [W, H, L, B, T] = [440, 270, 46, 40, 10];
    const X = x => L + (W - L - 8) * (x - x0) / (x1 - x0 || 1), Y = y => H - B - (H - B - T) * (y - y0) / (y1 - y0 || 1);
    for (const y of ticks(y0, y1, 5)) {
      svg.append(el("line", {x1: L, x2: W - 8, y1: Y(y), y2: Y(y), class: "grid"}), el("text", {x: L - 6, y: Y(y) + 4, class: "left"}, said(y)));
    }
    for (const x of ticks(x0, x1, 6)) svg.append(el("text", {x: X(x), y: H - B + 17, class: "mid"}, said(x)));
    svg.append(el("text", {x: (L + W) / 2, y: H - 5, class: "mid name"}, axis.value === "time" ? "time since first touch [s]" : "depth [mm]"));
    svg.append(el("text", {x: 12, y: (H - B) / 2, class: "mid name", transform: `rotate(-90 12 ${(H - B) / 2})`}, NAMES[part("what").value]));
    for (const line of shown) {
      let d = "";
      for (let k = a; k < b; k++) if (Number.isFinite(at(line, k))) d += (d ? "L" : "M") + X(over(line, k)).toFixed(1) + " " + Y(at(line, k)).toFixed(1);
      const path = el("path", {d, class: "line " + line.kind});
      path.style.stroke = line.colour;
      svg.append(path);
    }
    svg.setAttribute("aria-label", `Force of press ${selected + 1}: ` + shown.map(line => {
      let most = -Infinity;
      for (let k = a; k < b; k++) if (at(line, k) > most) most = at(line, k);
      return `${line.name} up to ${said(most)} N`;
    }).join(", "));
  }
  function ticks(low, high, about) {
    const raw = (high - low) / about || 1, power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].map(m => m * power).find(s => s >= raw), found = [];
    for (let v = Math.ceil(low / step) * step; v <= high + 1e-9 * step; v += step) found.push(Math.abs(v) < 1e-9 * step ? 0 : v);
    return found;
  }
  for (const line of curves ? curves.lines : []) {
    const label = el("label", {class: "line-of"}), box = el("input", {type: "checkbox"}), swatch = el("span", {class: "swatch " + line.kind});
    box.checked = line.shown;
    swatch.style.borderColor = line.colour;
    box.addEventListener("change", () => { line.shown = box.checked; plot(); });
    label.append(box, swatch, line.name);
    part("lines").append(label);
  }

  // ---- hands: pointer, keys, buttons, table
  const held = new Map();
  let moved = 0, spread = 0;
  stage.addEventListener("pointerdown", event => {
    held.set(event.pointerId, event);
    moved = 0;
    stage.setPointerCapture(event.pointerId);
    if (held.size === 2) spread = apart();
  });
  const apart = () => { const [p, q] = [...held.values()]; return Math.hypot(p.clientX - q.clientX, p.clientY - q.clientY) || 1; };
  stage.addEventListener("pointermove", event => {
    const before = held.get(event.pointerId);
    if (!before) return hover(event);
    held.set(event.pointerId, event);
    const [dx, dy] = [event.clientX - before.clientX, event.clientY - before.clientY];
    moved += Math.abs(dx) + Math.abs(dy);
    tip.hidden = true;
    if (held.size === 2) { const now = apart(); zoom(spread / now); spread = now; }
    else turn(-0.45 * dx, event.pointerType === "touch" ? 0 : 0.35 * dy);
  });
  stage.addEventListener("pointerup", event => {
    if (held.delete(event.pointerId) && moved < 6) {
      const hit = under(event);
      if (hit) { select(hit.press >= 0 ? hit.press : nearest(hit.point)); hover(event); }
    }
  });
  stage.addEventListener("pointercancel", event => held.delete(event.pointerId));
  stage.addEventListener("pointerleave", () => { tip.hidden = true; });
  stage.addEventListener("wheel", event => {  // a page that is scrolled past does not zoom
    if (!event.ctrlKey && document.activeElement !== stage) return;
    event.preventDefault();
    zoom(Math.exp(0.0012 * event.deltaY));
  }, {passive: false});
  const keys = {ArrowLeft: () => turn(-TURN_DEG, 0), ArrowRight: () => turn(TURN_DEG, 0), ArrowUp: () => turn(0, TURN_DEG),
    ArrowDown: () => turn(0, -TURN_DEG), "+": () => zoom(0.88), "=": () => zoom(0.88), "-": () => zoom(1.14), Home: reset, "0": reset,
    n: () => select((selected + 1) % count), p: () => select((selected + count - 1) % count)};
  stage.addEventListener("keydown", event => {
    const act = !event.ctrlKey && !event.metaKey && !event.altKey && keys[event.key];
    if (act) { event.preventDefault(); act(); }
  });
  part("reset").addEventListener("click", reset);
  part("nearer").addEventListener("click", () => zoom(0.8));
  part("farther").addEventListener("click", () => zoom(1.25));
  part("next").addEventListener("click", keys.n);
  part("previous").addEventListener("click", keys.p);
  by.addEventListener("change", colour);
  axis?.addEventListener("change", plot);
  part("what")?.addEventListener("change", plot);
  root.querySelectorAll("details.presses tbody tr").forEach((row, k) => row.addEventListener("click", () => select(k)));
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", colour);
  renderer.domElement.addEventListener("webglcontextlost", () => { root.dataset.state = "still"; });

  root.dataset.state = "live";
  colour();  // before anything is drawn: three.js compiles what draws the dots once, with colours or without
  new ResizeObserver(resize).observe(stage);
  resize();
  if (curves) part("what").value = data.force;
  select(data.selected, false);
}

for (const root of document.querySelectorAll("section.view3d")) {
  try { start(root); } catch (error) {  // no WebGL: the picture stays
    root.dataset.state = "still";
    root.dataset.why = String(error);
  }
}
})();
