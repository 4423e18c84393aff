// What the page holds: one compressed block of arrays, and an index that says where each is and how it is scaled.

// The block as bytes; null where the browser is too old to unpack it (before 2023).
async function unpacked(text) {
  if (typeof DecompressionStream === "undefined") return null;
  const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip"));
  return new Response(stream).arrayBuffer();
}

const KINDS = { u2: Uint16Array, u4: Uint32Array, i2: Int16Array, f4: Float32Array };

// Reads arrays by name, row after row (the block holds column after column).
function reader(bytes, index) {
  return (name, Kind = Float32Array) => {
    const { at, kind, shape, low, step } = index[name];
    const rows = shape[0], columns = shape.length > 1 ? shape[1] : 1;
    const raw = new KINDS[kind](bytes, at, rows * columns);
    const out = new Kind(rows * columns);
    for (let c = 0; c < columns; c++) {
      const from = low ? low[c] : 0, by = step ? step[c] : 1;
      for (let r = 0; r < rows; r++) out[r * columns + c] = from + by * raw[c * rows + r];
    }
    return out;
  };
}
