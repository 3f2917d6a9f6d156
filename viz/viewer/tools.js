// SPDX-License-Identifier: BSD-3-Clause
// Measuring at full detail, cutting, saving.
const kTools = {
  point: { label: 'Point: coordinates', points: 1 },
  distance: { label: 'Distance of two points', points: 2 },
  height: { label: 'Height above the floor', points: 1 },
  line: { label: 'Length of a line (Enter ends it)', points: Infinity, least: 2 },
  area: { label: 'Area (Enter ends it)', points: Infinity, least: 3 },
  plane: { label: 'Plane: flatness, thickness', points: 1 },
};

/** "1.234 m" */
const metres = (v, digits = 3) => `${v.toFixed(digits)} m`;
const millimetres = (v) => `${(1000 * v).toFixed(v < 0.01 ? 1 : 0)} mm`;
const coordinates = (p) => p.map((v) => v.toFixed(3)).join(', ');

class Measuring {
  constructor(view) {
    this.view = view;
    this.tool = '';
    this.list = [];
    this.open = null;
  }

  choose(tool) {
    this.end();
    this.tool = tool;
  }

  /** Adds the point at a place of the picture. */
  async add(x, y) {
    const hit = this.view.pick(x, y);
    if (!hit) return null;
    const tool = this.tool || 'point', point = { p: hit.p, sigma: await this.sigma(hit), seen: await this.seen(hit) };
    if (!this.tool) return { ...point, text: this.textOfPoint(point) };
    if (!this.open) {
      this.open = { tool, points: [] };
      this.list.push(this.open);
    }
    this.open.points.push(point);
    this.describe(this.open);
    if (this.open.points.length >= kTools[tool].points) this.open = null;
    this.view.told('measured');
    return point;
  }

  /** Ends a line or an area; one that is too short is dropped. */
  end() {
    const open = this.open;
    this.open = null;
    if (open && open.points.length < (kTools[open.tool].least || kTools[open.tool].points)) this.remove(open);
    this.view.told('measured');
  }
  remove(what) {
    if (this.open === what) this.open = null;
    this.list = this.list.filter((m) => m !== what);
    this.view.told('measured');
  }

  /** Standard deviation of a point according to the map; NaN: unknown. */
  async sigma({ cloud, chunk, i }) {
    const at = cloud.layer('sigma');
    return at < 0 ? NaN : valueOf(cloud.layers[at], (await cloud.values(chunk, at))[i]);
  }
  /** The keyframe that saw the point best; -1: unknown. */
  async seen({ cloud, chunk, i }) {
    const at = cloud.layer('view');
    return at < 0 ? -1 : (await cloud.values(chunk, at))[i] - 1;
  }

  textOfPoint({ p, sigma }) { return `point ${coordinates(this.view.ofMap(p))}${Number.isFinite(sigma) ? ` (σ ${millimetres(sigma)})` : ''}`; }

  /** Motions of a point with the keyframe that saw it, one for each sample of the poses' errors; null: not known. */
  motions({ p, seen }) {
    const k = this.view.scene.keyframes[seen];
    if (!k || !k.s) return null;
    k.steps = k.steps || new Int16Array(bytesOf(k.s).buffer);
    const arm = sub(p, this.view.local(k.p)), all = [];
    for (let i = 0; i < k.steps.length; i += 6) {
      const part = (at, step) => [0, 1, 2].map((a) => k.steps[at + a] * step);
      all.push(add(part(i, k.e[0]), cross(part(i + 3, k.e[1]), arm)));
    }
    return all;
  }

  /** RMS by which the samples of the poses' errors change the length of a line; NaN: not known. */
  spread(points, way) {
    const all = points.map((q) => this.motions(q));
    if (!all.every((q) => q)) return NaN;
    let sum = 0;
    for (let s = 0; s < all[0].length; ++s) {
      const moved = points.map(({ p }, i) => add(p, all[i][s]));
      sum += (wayOf(moved) - way) ** 2;
    }
    return Math.sqrt(sum / all[0].length);
  }

  describe(m) {
    const p = m.points.map((point) => point.p), sum = m.points.reduce((s, { sigma }) => s + sigma ** 2, 0), { view } = this;
    const step = view.clouds[0].step, error = Math.sqrt(sum + m.points.length * step * step / 12);
    let within = Number.isFinite(error) ? ` ± ${millimetres(error)}` : '';
    const way = wayOf(p), spread = m.tool === 'distance' || m.tool === 'line' ? this.spread(m.points, way) : NaN;
    if (Number.isFinite(spread)) within = ` ± ${millimetres(2.04 * Math.hypot(spread, error || 0))} (95 %)`;
    m.value = m.tool === 'area' ? areaOf(p) : way;
    if (m.tool === 'point') m.text = this.textOfPoint(m.points[0]);
    if (m.tool === 'height') {
      m.value = p[0][2] - view.floor;
      m.text = `height ${metres(m.value)}${within} above the floor`;
    }
    if (m.tool === 'distance') {
      const d = p.length > 1 ? sub(p[1], p[0]) : [0, 0, 0];
      m.text = `distance ${metres(way)}${within} (level ${metres(Math.hypot(d[0], d[1]))}, height ${metres(Math.abs(d[2]))})`;
    }
    if (m.tool === 'line') m.text = `length ${metres(way)}${within} over ${p.length} points`;
    if (m.tool === 'area') m.text = `area ${m.value.toFixed(3)} m²${p.length > 2 ? ` within ${metres(way + length(sub(p[0], p[p.length - 1])), 2)}` : ''}`;
    if (m.tool === 'plane') this.describePlane(m, p[0]);
    m.error = error;
  }

  /** A plane through the points near a place: fitted, then fitted again to the points near the plane. */
  describePlane(m, place) {
    let plane = planeOf(this.view.around(place, 0.12)), off = [];
    for (const band of [0.05, 0.03]) {
      const near = this.view.around(place, 0.5).filter((q) => plane && Math.abs(dot(plane.normal, sub(q, plane.middle))) < band);
      plane = planeOf(near);
      if (plane) off = near.map((q) => dot(plane.normal, sub(q, plane.middle))).sort((a, b) => a - b);
    }
    if (!plane) {
      m.text = 'plane: too few points here';
      return;
    }
    const rms = Math.sqrt(off.reduce((s, v) => s + v * v, 0) / off.length);
    const thick = off[Math.floor(0.95 * (off.length - 1))] - off[Math.floor(0.05 * (off.length - 1))];
    const tilt = Math.asin(clamp(Math.abs(plane.normal[2]), 0, 1)) * 180 / Math.PI;
    m.value = rms;
    m.plane = plane;
    m.text = `plane flat to ${millimetres(rms)} (rms of ${off.length} points), 90 % within ${millimetres(thick)}, ` +
      `${tilt > 45 ? `${(90 - tilt).toFixed(1)}° from level` : `${tilt.toFixed(1)}° from upright`}`;
  }

  text() { return this.list.map((m) => m.text + this.flagOf(m)).join('\n'); }
  /** A distance as `adjust` takes it. */
  flagOf({ tool, points, value }) {
    const at = ({ p }) => `"${this.view.ofMap(p).map((v) => v.toFixed(4)).join(',')}"`;
    return tool === 'distance' && points[1] ? `\n  --length ${points.map(at).join(' ')} ${value.toFixed(4)}m` : '';
  }
}

/** Length of a line through points. */
const wayOf = (p) => p.slice(1).reduce((sum, q, i) => sum + length(sub(q, p[i])), 0);

/** Area of a polygon in space, seen along the direction in which it is largest. */
function areaOf(p) {
  let sum = [0, 0, 0];
  for (let i = 2; i < p.length; ++i) sum = add(sum, cross(sub(p[i - 1], p[0]), sub(p[i], p[0])));
  return length(sum) / 2;
}

/** Best plane through points; null: fewer than ten. */
function planeOf(points) {
  if (points.length < 10) return null;
  const middle = mul(points.reduce(add, [0, 0, 0]), 1 / points.length), s = [0, 0, 0, 0, 0, 0];
  for (const q of points) {
    const [x, y, z] = sub(q, middle);
    [x * x, x * y, x * z, y * y, y * z, z * z].forEach((v, k) => { s[k] += v; });
  }
  return { middle, normal: flattest(s) };
}

/** The six initial numbers of a cut of this kind. */
function startOfCut(view, kind) {
  const cut = { kind, low: [-1e9, -1e9, -1e9], high: [1e9, 1e9, 1e9] };
  if (kind === 'box') [cut.low, cut.high] = [view.inmost[0].slice(), view.inmost[1].slice()];
  if (kind === 'slab') [cut.low[2], cut.high[2]] = [view.scene.up ? view.floor - 0.1 : view.inmost[0][2], view.scene.up ? view.floor + 1.8 : view.middle[2]];
  return cut;
}

/** Positions of a cut's handles: the middles of the faces of its box. */
function handlesOf(view) {
  const { kind, low, high } = view.cut;
  if (kind === 'none') return [];
  const from = low.map((v, k) => Math.max(v, view.low[k])), to = high.map((v, k) => Math.min(v, view.high[k]));
  const middle = mul(add(from, to), 0.5), all = [];
  for (const axis of kind === 'slab' ? [2] : [0, 1, 2]) {
    for (const side of ['low', 'high']) {
      const p = middle.slice();
      p[axis] = (side === 'low' ? from : to)[axis];
      all.push({ axis, side, p });
    }
  }
  return all;
}

/** Edges of the box that is cut out, as pairs of positions. */
function edgesOfCut(view) {
  if (view.cut.kind === 'none') return [];
  const from = view.cut.low.map((v, k) => Math.max(v, view.low[k])), to = view.cut.high.map((v, k) => Math.min(v, view.high[k]));
  const corner = (c) => kBox.map((_, k) => (c >> k & 1 ? to[k] : from[k])), edges = [];
  for (let c = 0; c < 8; ++c) {
    for (let k = 0; k < 3; ++k) if (!(c >> k & 1)) edges.push([corner(c), corner(c | 1 << k)]);
  }
  return edges;
}

/** The visible points at full detail, as binary PLY in the frame of the map's files. */
function plyOf(view) {
  const parts = [];
  let count = 0;
  for (const cloud of view.clouds) {
    if (!cloud.visible) continue;
    for (const chunk of cloud.chunks) {
      if (!chunk.places) continue;
      const data = new DataView(new ArrayBuffer(15 * chunk.count));
      let at = 0;
      for (let i = 0; i < chunk.count; ++i) {
        const p = cloud.place(chunk, i);
        if (!view.shows(p)) continue;
        view.ofMap(p).forEach((v, k) => data.setFloat32(at + 4 * k, v, true));
        for (let k = 0; k < 3; ++k) data.setUint8(at + 12 + k, chunk.colors[4 * i + k]);
        at += 15;
        ++count;
      }
      parts.push(new Uint8Array(data.buffer, 0, at));
    }
  }
  const head = ['ply', 'format binary_little_endian 1.0', `comment ${view.scene.frame}`, `element vertex ${count}`,
    ...['x', 'y', 'z'].map((k) => `property float ${k}`), ...['red', 'green', 'blue'].map((k) => `property uchar ${k}`), 'end_header', ''];
  return { count, blob: new Blob([head.join('\n'), ...parts]) };
}

function saveAs(blob, name) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

async function copyText(text) {
  try {
    await navigator.clipboard.writeText(text);
  } catch (e) {
    const box = document.createElement('textarea');
    box.value = text;
    document.body.append(box);
    box.select();
    document.execCommand('copy');
    box.remove();
  }
}
