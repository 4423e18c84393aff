// Force over depth: the straight press here with its band, the 1D model, the measured press nearest by, and where the
// tip is now.

class Chart {
  constructor(canvas, colours) {
    this.canvas = canvas;
    this.colours = colours;
  }

  // curves: {depths, force, low, high, oneD} in m and N; measured: {depth, force} or null; now: [m, N] or null.
  draw(curves, measured, now, most) {
    const { canvas, colours } = this, ratio = window.devicePixelRatio || 1;
    const wide = canvas.clientWidth, tall = canvas.clientHeight;
    if (!wide || !tall) return;
    if (canvas.width !== Math.round(wide * ratio)) canvas.width = Math.round(wide * ratio);
    if (canvas.height !== Math.round(tall * ratio)) canvas.height = Math.round(tall * ratio);
    const pen = canvas.getContext("2d");
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, wide, tall);
    const left = 40, right = 12, top = 22, bottom = 34;
    let peak = 0.1;
    if (curves) peak = Math.max(peak, ...curves.high);
    if (measured) peak = Math.max(peak, ...measured.force);
    if (now) peak = Math.max(peak, now[1]);
    const [stepX, stepY] = [niceStep(1e3 * most, 5), niceStep(peak * 1.05, 4)];
    const endY = Math.ceil(peak * 1.02 / stepY) * stepY;
    const x = (m) => left + (wide - left - right) * m / most, y = (n) => tall - bottom - (tall - top - bottom) * n / endY;
    pen.font = "12px system-ui, sans-serif";
    pen.lineWidth = 1;
    pen.fillStyle = colours.soft;
    pen.strokeStyle = colours.line;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    for (let n = 0; n <= endY + 1e-9; n += stepY) {
      pen.beginPath();
      pen.moveTo(left, y(n));
      pen.lineTo(wide - right, y(n));
      pen.stroke();
      pen.fillText(String(+n.toFixed(3)), left - 6, y(n));
    }
    pen.textAlign = "center";
    pen.textBaseline = "top";
    for (let mm = 0; mm <= 1e3 * most + 1e-9; mm += stepX) pen.fillText(String(+mm.toFixed(2)), x(mm / 1e3), tall - bottom + 5);
    pen.fillText("depth, mm", (left + wide - right) / 2, tall - 14);
    pen.textAlign = "left";
    pen.fillText("force along the normal, N", 4, 2);
    pen.save();
    pen.beginPath();
    pen.rect(left, top, wide - left - right, tall - top - bottom + 1);
    pen.clip();
    const line = (depths, forces, colour, width, dash = []) => {
      pen.beginPath();
      depths.forEach((m, i) => pen.lineTo(x(m), y(forces[i])));
      pen.strokeStyle = colour;
      pen.lineWidth = width;
      pen.setLineDash(dash);
      pen.stroke();
      pen.setLineDash([]);
    };
    if (measured) line([...measured.depth], [...measured.force], colours.measured, 2.4);
    if (curves) {
      pen.beginPath();
      curves.depths.forEach((m, i) => pen.lineTo(x(m), y(curves.high[i])));
      for (let i = curves.depths.length - 1; i >= 0; i--) pen.lineTo(x(curves.depths[i]), y(curves.low[i]));
      pen.fillStyle = colours.fem;
      pen.globalAlpha = 0.2;
      pen.fill();
      pen.globalAlpha = 1;
      line(curves.depths, curves.force, colours.fem, 2);
      if (curves.oneD) line(curves.depths, curves.oneD, colours["hunt-crossley"], 1.8, [6, 4]);
    }
    pen.restore();
    if (now) {
      pen.beginPath();
      pen.arc(x(now[0]), y(now[1]), 5.5, 0, 2 * Math.PI);
      pen.fillStyle = colours.fem;
      pen.strokeStyle = colours.paper;
      pen.lineWidth = 2;
      pen.fill();
      pen.stroke();
    }
  }
}

function niceStep(range, parts) {
  const rough = range / parts, power = 10 ** Math.floor(Math.log10(rough)), share = rough / power;
  return power * (share > 5 ? 10 : share > 2 ? 5 : share > 1 ? 2 : 1);
}
