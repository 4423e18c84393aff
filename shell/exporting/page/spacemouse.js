// A SpaceMouse by WebHID. How its reports are read comes from the program's own codec (about.spacemouse).

class SpaceMouse {
  constructor(about) {
    this.about = about;
    this.translation = [0, 0, 0];
    this.rotation = [0, 0, 0];
    this.heard = -Infinity;
  }

  // The report of an id, its bytes without that id (as WebHID hands it over).
  report(id, bytes) {
    const known = this.about.reports.filter((each) => each.report === id && bytes.byteLength >= each.bytes)[0];
    if (!known) return;
    for (const { at, of, axis, sign } of known.fields) {
      const share = sign * bytes.getInt16(at, true) / this.about.full_scale;
      this[of][axis] = Math.min(1, Math.max(-1, share)) + 0;
    }
    this.heard = performance.now();
  }

  // Deflection, shares of full: x right, y away, z up; nothing where a device that is held would have spoken.
  get deflection() {
    return performance.now() - this.heard < 200 ? this.translation : [0, 0, 0];
  }

  // Asks the person which; its product's name, or null where none was chosen.
  async connect() {
    const filters = this.about.products.map(([vendorId, productId]) => ({ vendorId, productId }));
    const [device] = await navigator.hid.requestDevice({ filters });
    if (!device) return null;
    if (!device.opened) await device.open();
    device.addEventListener("inputreport", (event) => this.report(event.reportId, event.data));
    return device.productName || "SpaceMouse";
  }
}
