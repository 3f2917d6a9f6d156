// SPDX-License-Identifier: BSD-3-Clause
// The scene as stored in the page, and unpacking of points (README.md describes the format).

/** Unit vectors of the 16 x 16 directions that points are drawn with: three numbers each. */
const kDirections = new Float32Array(256 * 3);
for (let i = 0; i < 256; ++i) kDirections.set(unfolded((i & 15) / 7 - 1, (i >> 4) / 7 - 1), 3 * i);

/** A unit vector from its place on the unfolded octahedron. */
function unfolded(u, v) {
  const z = 1 - Math.abs(u) - Math.abs(v);
  if (z >= 0) return unit([u, v, z]);
  return unit([(1 - Math.abs(v)) * (u < 0 ? -1 : 1), (1 - Math.abs(u)) * (v < 0 ? -1 : 1), z]);
}

function bytesOf(base64) {
  const text = atob(base64), bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes;
}

async function inflated(bytes, size) {
  const reader = new Blob([bytes]).stream().pipeThrough(new DecompressionStream('deflate-raw')).getReader();
  const out = new Uint8Array(size);
  for (let at = 0; ;) {
    const { done, value } = await reader.read();
    if (done) return out;
    out.set(value.subarray(0, size - at), at);
    at += value.length;
  }
}

/** One cloud; `data` returns the packed bytes of a piece by its number, once only. */
class CloudData {
  constructor(json, data, base) {
    Object.assign(this, json);
    this.data = data;
    this.origin = sub(json.origin, base);
    this.visible = true;
    this.ready = 0;
    for (const chunk of this.chunks) {
      chunk.low = add(this.origin, mul(chunk.low, this.step));
      chunk.high = add(this.origin, mul(chunk.high, this.step));
    }
  }

  /** Reads position, colour and direction of the chunk's points. */
  async open(chunk) {
    const n = chunk.count, bytes = await inflated(this.data(chunk.data[0]), (this.colored ? 9 : 6) * n);
    const folds = chunk.data[1] < 0 ? null : await inflated(this.data(chunk.data[1]), 2 * n);
    const places = new Uint16Array(4 * n), way = new Uint16Array(folds ? n : 0), colors = new Uint8Array(4 * n);
    for (let k = 0; k < 3; ++k) {
      for (let i = 0, at = 0, low = 2 * k * n, high = low + n; i < n; ++i) {
        const z = bytes[low + i] | bytes[high + i] << 8;
        at += (z >> 1) ^ -(z & 1);
        places[4 * i + k] = at;
      }
    }
    for (let i = 0, y = 0, o = 0, g = 0, u = 0, v = 0; i < n; ++i) {
      let r = 176, gr = 176, b = 176;
      if (this.colored) {
        y = (y + bytes[6 * n + i]) & 255;
        o = (o + bytes[7 * n + i]) << 24 >> 24;
        g = (g + bytes[8 * n + i]) << 24 >> 24;
        r = clamp(y - 2 * g + 2 * o, 0, 255);
        gr = clamp(y + 2 * g, 0, 255);
        b = clamp(y - 2 * g - 2 * o, 0, 255);
      }
      colors[4 * i] = r;
      colors[4 * i + 1] = gr;
      colors[4 * i + 2] = b;
      colors[4 * i + 3] = 255;
      if (folds) {
        u = (u + folds[i]) & 255;
        v = (v + folds[n + i]) & 255;
        way[i] = u | v << 8;
        if (u) colors[4 * i + 3] = Math.round((u - 1) * 14 / 30) | Math.round((v - 1) * 14 / 30) << 4;
      }
    }
    if (folds) chunk.folds = way;
    chunk.places = places;
    chunk.colors = colors;
    this.ready += n;
  }

  /** Values of a layer for the chunk's points: 0 not known, else 1, 2, ... */
  async values(chunk, layer) {
    chunk.kept = chunk.kept || {};
    if (!chunk.kept[layer]) {
      const n = chunk.count, wide = this.layers[layer].scale === 'view';
      const bytes = await inflated(this.data(chunk.data[2 + layer]), (wide ? 2 : 1) * n);
      const values = wide ? new Uint16Array(n) : bytes;
      for (let i = 0, at = 0; i < n; ++i) values[i] = wide ? bytes[i] | bytes[n + i] << 8 : (at = (at + bytes[i]) & 255);
      chunk.kept[layer] = values;
    }
    return chunk.kept[layer];
  }

  layer(key) { return this.layers.findIndex((layer) => layer.key === key); }
  place(chunk, i) {
    const p = chunk.places;
    return add(this.origin, mul([p[4 * i], p[4 * i + 1], p[4 * i + 2]], this.step));
  }
}

/** Value of a layer's step. */
function valueOf(layer, step) {
  if (step === 0) return NaN;
  if (layer.scale === 'category' || layer.scale === 'view') return step - 1;
  const share = (step - 1) / layer.steps;
  return layer.scale === 'log' ? layer.low * (layer.high / layer.low) ** share : layer.low + share * (layer.high - layer.low);
}
