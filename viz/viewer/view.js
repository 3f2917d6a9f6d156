// SPDX-License-Identifier: BSD-3-Clause
// The view of a scene: loads it level by level, draws less while it moves and all of it when it rests.
const kBox = ['x', 'y', 'z'];

class View {
  constructor(scene, data, canvas, overlay) {
    this.scene = scene;
    this.canvas = canvas;
    this.overlay = overlay;
    this.painter = new Painter(canvas);
    this.camera = new Camera();
    this.base = scene.clouds.length ? scene.clouds[0].origin.map((v) => Math.abs(v) > 5000 ? Math.round(v / 1000) * 1000 : 0) : [0, 0, 0];
    this.floor = scene.floor - this.base[2];
    this.clouds = scene.clouds.map((cloud) => new CloudData(cloud, data, this.base));
    this.cut = { kind: 'none', low: [-1e9, -1e9, -1e9], high: [1e9, 1e9, 1e9] };
    this.layer = { key: 'photo' };
    this.cull = this.clouds.some((c) => c.chunks.some((k) => k.data[1] >= 0));
    this.size = 1;
    this.blend = 'a';
    this.sets = {};
    this.budget = 250000;
    this.dirty = true;
    this.listeners = [];
    this.first = 0;
    this.loaded = 0;
    this.frames = 0;
    this.inPage = false;
    this.measure();
    this.home();
    this.controls = new Controls(this, canvas);
    new ResizeObserver(() => this.changed()).observe(canvas);
    requestAnimationFrame((now) => this.frame(now));
  }

  /** Extent of everything, and the region that holds most of it. */
  measure() {
    const reach = (side, best) => kBox.map((_, k) => best(...this.clouds.flatMap((c) => c.chunks.map((chunk) => chunk[side][k])), this.inmost[side === 'low' ? 0 : 1][k]));
    this.inmost = this.scene.inmost.map((p) => this.local(p));
    [this.low, this.high] = [reach('low', Math.min), reach('high', Math.max)];
    this.middle = mul(add(...this.inmost), 0.5);
    this.size0 = Math.max(1, length(sub(this.inmost[1], this.inmost[0])) / 2);
    this.radius = Math.max(1, ...[this.low, this.high].map((p) => length(sub(p, this.middle))));
  }

  /** Shows everything, from the side of the cameras, which the surfaces face. */
  home() {
    this.camera = new Camera();
    const { q } = this.scene.paths[0] || { q: [] };
    let ahead = [0, 0, 0];
    for (let i = 0; i < q.length; i += 4) ahead = add(ahead, turned(q.slice(i, i + 4), [0, 0, 1]));
    if (Math.hypot(ahead[0], ahead[1]) > q.length / 40) this.camera.yaw = Math.atan2(ahead[1], ahead[0]);
    this.camera.target = this.middle.slice();
    this.camera.distance = this.size0 * 1.9 / Math.min(1, this.canvas.clientWidth / this.canvas.clientHeight || 1);
    this.changed();
  }

  /** Switches to another mode of navigation. */
  look(mode) {
    const { camera } = this;
    if (mode === camera.mode) return;
    const outside = camera.eye.some((v, k) => v < this.inmost[0][k] || v > this.inmost[1][k]);
    camera.look(mode);
    if (mode === 'walk') {
      const start = this.startOfWalk(outside || camera.pitch < -0.5);
      camera.pitch = 0;
      camera.yaw = start.yaw;
      camera.eye = start.eye;
    } else if (mode === 'top') {
      camera.target = this.middle.slice();
      const { width, height } = this.canvas;
      const span = sub(this.inmost[1], this.inmost[0]);
      camera.distance = 1.1 * Math.max(span[1], span[0] * height / width) / kFieldOfView;
    } else {
      camera.target = this.middle.slice();
      camera.distance = this.size0 * 1.9 / Math.min(1, this.canvas.clientWidth / this.canvas.clientHeight || 1);
    }
    this.changed();
  }

  /** First position of the camera, at eye height; or the present position. */
  startOfWalk(elsewhere) {
    const path = this.scene.paths[0], { camera } = this;
    if (!elsewhere || !path || !path.t.length) {
      return { eye: [camera.eye[0], camera.eye[1], elsewhere ? this.floor + kEyeHeight_m : camera.eye[2]], yaw: camera.yaw };
    }
    const p = this.local(path.p.slice(0, 3)), way = turned(path.q.slice(0, 4), [0, 0, 1]);
    return { eye: [p[0], p[1], this.scene.up ? this.floor + kEyeHeight_m : p[2]], yaw: Math.atan2(way[1], way[0]) };
  }

  local(p) { return sub(p, this.base); }
  /** Coordinates in the frame of the map's files. */
  ofMap(p) {
    const q = add(p, this.base);
    return this.scene.up ? q : [q[0], -q[2], q[1]];
  }

  changed() {
    this.dirty = true;
    this.moved = performance.now();
    this.refining = null;
    this.stage = 0;
  }
  told(what) { this.listeners.forEach((then) => then(what)); }

  /** Reads all chunks, coarse ones of all clouds first. */
  async load() {
    const all = this.clouds.flatMap((cloud) => cloud.chunks.filter((k) => !k.places).map((chunk) => ({ cloud, chunk })));
    all.sort((a, b) => a.chunk.level - b.chunk.level);
    for (const { cloud, chunk } of all) {
      await cloud.open(chunk);
      if (this.layer.key !== 'photo') await this.paint(cloud, chunk);
      if (chunk.level === 0 || performance.now() - (this.shown || 0) > 700) {
        this.shown = performance.now();
        if (!this.refining || chunk.level === 0) this.again();
      }
    }
    this.loaded = performance.now();
    this.again();
    this.told('loaded');
  }

  /** Draws again without counting as movement. */
  again() {
    this.dirty = true;
    this.refining = null;
    this.stage = 0;
  }

  // Layers.

  async setLayer(key) {
    const first = this.clouds.find((c) => c.visible && c.layer(key) >= 0) || this.clouds[0];
    const found = (first && first.layers.find((l) => l.key === key)) || (this.scene.live && key === 'robot' && { scale: 'category', label: 'Robot', names: this.scene.paths.map((p) => p.name) });
    this.layer = { key, ...found };
    this.painter.setPalette(this.paletteOf(this.layer));
    for (const cloud of this.clouds) {
      for (const chunk of cloud.chunks) {
        if (chunk.places) await this.paint(cloud, chunk);
        if (this.layer.key !== key) return;
      }
    }
    this.again();
    this.told('layer');
  }

  /** Stores the layer's colour number of each point of a chunk. */
  async paint(cloud, chunk) {
    const { key } = this.layer, n = chunk.count, out = chunk.places, at = cloud.layer(key);
    if (chunk.painted === key || key === 'photo' || key === 'height') return;
    if (key === 'normal') {
      for (let i = 0; i < n; ++i) out[4 * i + 3] = chunk.folds ? chunk.folds[i] : 0;
    } else if (at < 0) {
      out.forEach((_, i) => { if (i % 4 === 3) out[i] = key === 'robot' && cloud.robot >= 0 ? cloud.robot + 1 : 0; });
    } else {
      const values = await cloud.values(chunk, at), table = this.colorNumbers(cloud.layers[at]);
      for (let i = 0; i < n; ++i) out[4 * i + 3] = table ? table[values[i]] : values[i];
    }
    chunk.painted = key;
    chunk.stale = true;
  }

  /** Number of the colour of each step; the palette's first colour means unknown. */
  colorNumbers(layer) {
    if (layer.scale === 'category') return null;
    if (layer.scale !== 'view') return Array.from({ length: 256 }, (_, s) => (s ? 1 + Math.round(254 * Math.min(1, (s - 1) / layer.steps)) : 0));
    const frames = this.scene.keyframes, [from, to] = this.times();
    return [0, ...frames.map((k) => 1 + Math.round(254 * (k.t - from) / Math.max(to - from, 1e-9)))];
  }

  times() {
    const all = this.scene.keyframes.map((k) => k.t);
    return all.length ? [Math.min(...all), Math.max(...all)] : [0, 1];
  }

  paletteOf(layer) {
    const out = new Uint8Array(768).fill(128);
    for (let i = 1; i < 256; ++i) {
      const color = layer.scale === 'category' ? categoryColor(i - 1) : rampColor((i - 1) / 254);
      out.set(color, 3 * i);
    }
    if (layer.key === 'height') out.set(rampColor(0), 0);
    return out;
  }

  heights() {
    const top = this.scene.up ? Math.min(this.high[2], this.floor + 3) : this.high[2];
    return [this.scene.up ? Math.max(this.low[2], this.floor - 0.1) : this.low[2], top];
  }

  // Drawing.

  look4(cloud, size) {
    const mode = { photo: 0, height: 1, normal: 3 }[this.layer.key] ?? 2, [from, to] = this.heights();
    const both = this.clouds.filter((c) => c.visible).length > 1 && this.blend === 'both' && mode === 0;
    return {
      matrix: this.lens.matrix, eye: this.lens.eye, low: this.cut.low, high: this.cut.high, mode, from,
      per: 1 / Math.max(to - from, 1e-6), cull: this.cull ? (this.lens.flat ? 2 : 1) : 0, size,
      least: this.ratio * 1.5, most: 64, round: this.rounds,
      tint: both ? (cloud === this.clouds[0] ? [0.7, 0.9, 1.25] : [1.25, 0.85, 0.6]) : [1, 1, 1],
    };
  }

  /** Chunks in the picture that add visible detail, coarse ones first, then those that add most. */
  wanted(level) {
    const m = this.lens.matrix, list = [], focal = this.focal;
    for (const cloud of this.clouds) {
      if (!cloud.visible) continue;
      for (const chunk of cloud.chunks) {
        if (!chunk.places || chunk.level > level || this.outside(chunk, m)) continue;
        const near = this.lens.flat ? 1 : Math.max(0.1, length(this.lens.eye.map((e, k) => Math.max(chunk.low[k] - e, e - chunk.high[k], 0))));
        const gain = chunk.level ? cloud.levels[chunk.level - 1] * focal / near : 1e9;
        if (gain > 1.2) list.push({ cloud, chunk, gain });
      }
    }
    return list.sort((a, b) => a.chunk.level - b.chunk.level || b.gain - a.gain);
  }

  outside(chunk, m) {
    const { low, high } = this.cut;
    if (chunk.low.some((v, k) => v > high[k]) || chunk.high.some((v, k) => v < low[k])) return true;
    let out = 63;
    for (let c = 0; c < 8 && out; ++c) {
      const p = kBox.map((_, k) => (c >> k & 1 ? chunk.high[k] : chunk.low[k]));
      const [x, y, z, w] = [0, 1, 2, 3].map((r) => m[r] * p[0] + m[4 + r] * p[1] + m[8 + r] * p[2] + m[12 + r]);
      out &= (x < -w ? 1 : 0) | (x > w ? 2 : 0) | (y < -w ? 4 : 0) | (y > w ? 8 : 0) | (z < -w ? 16 : 0) | (z > w ? 32 : 0);
    }
    return out !== 0;
  }

  /** Draws chunks until the budget is spent; returns the index of the next one, and the points drawn. */
  draw(which, list, from, level, budget) {
    let at = from, spent = 0;
    while (at < list.length && (spent < budget || spent === 0)) {
      const { cloud } = list[at], batch = [];
      for (; at < list.length && list[at].cloud === cloud && (spent < budget || spent === 0); ++at) {
        batch.push(list[at].chunk);
        spent += list[at].chunk.count;
      }
      const spacing = cloud.levels[Math.min(level, cloud.levels.length - 1)];
      this.painter.drawPoints(which, cloud, batch, this.look4(cloud, spacing * 1.8 * this.size * this.focal));
    }
    return { at, spent };
  }

  resize(share) {
    const ratio = Math.min(devicePixelRatio || 1, 2), { canvas } = this;
    const width = Math.max(1, Math.round(canvas.clientWidth * ratio)), height = Math.max(1, Math.round(canvas.clientHeight * ratio));
    for (const c of [canvas, this.overlay]) {
      if (c.width !== width || c.height !== height) [c.width, c.height] = [width, height];
    }
    this.ratio = ratio;
    this.inner = [Math.max(1, Math.round(width * share)), Math.max(1, Math.round(height * share))];
    this.lens = this.camera.lens(width / height, this.middle, this.radius);
    this.focal = this.inner[1] / this.camera.height;
  }

  frame(now) {
    requestAnimationFrame((t) => this.frame(t));
    const seconds = Math.min(0.1, (now - (this.before || now)) / 1000);
    this.before = now;
    if (this.controls.held(seconds)) this.changed();
    if (this.fly) this.fly(seconds);
    const { gl } = this.painter;
    if (this.fence) {
      if (gl.clientWaitSync(this.fence, 0, 0) === gl.TIMEOUT_EXPIRED) return;
      gl.deleteSync(this.fence);
      this.fence = null;
      this.took = now - this.sent;
      const factor = this.took > 85 ? 0.7 : this.took < 45 ? 1.2 : 1;
      this.budget = clamp(this.budget * factor, 20000, 4e6);
    }
    if (!this.dirty && !this.refining) return;
    const still = now - (this.moved || 0) > 180;
    if (this.dirty) this.quick(still);
    else if (still) this.refine();
    else return;
    this.fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    this.sent = performance.now();
  }

  /** Draws a picture within the budget, at once. */
  quick(still) {
    const share = still || this.budget > 60000 ? 1 : 0.6;
    this.resize(share);
    this.rounds = this.budget > 400000;
    this.painter.begin(this.painter.front, ...this.inner);
    const list = this.wanted(99), { at, spent } = this.draw(this.painter.front, list, 0, this.levelOf(list), this.budget);
    this.dirty = false;
    this.finish(spent);
    this.complete = at === list.length && this.rounds && share === 1;
    this.refining = this.complete ? null : { level: -1 };
  }

  /** The finest level that fits the budget as a whole. */
  levelOf(list) {
    let sum = 0, level = 0;
    for (const { chunk } of list) {
      sum += chunk.count;
      if (sum > this.budget && chunk.level > 0) return chunk.level - 1;
      level = chunk.level;
    }
    return level;
  }

  /** Draws a part of the next finer picture, which is shown when it is complete. */
  refine() {
    const job = this.refining;
    if (job.level < 0) {
      this.resize(1);
      job.list = this.wanted(99);
      job.finest = job.list.reduce((most, { chunk }) => Math.max(most, chunk.level), 0);
      job.level = this.levelOf(job.list);
    }
    const back = 1 - this.painter.front;
    if (!job.at) {
      job.part = job.list.filter(({ chunk }) => chunk.level <= job.level);
      job.at = job.spent = 0;
      this.rounds = true;
      this.painter.begin(back, ...this.inner);
    }
    const done = this.draw(back, job.part, job.at, job.level, this.budget);
    job.at = done.at;
    job.spent += done.spent;
    if (job.at < job.part.length) return;
    this.painter.front = back;
    this.finish(job.spent);
    job.at = 0;
    if (++job.level > job.finest) {
      this.refining = null;
      this.complete = true;
    }
  }

  finish(points) {
    const ground = this.dark ? [0.08, 0.09, 0.106] : [0.955, 0.962, 0.97];
    const lens = [this.lens.near, this.lens.far, this.lens.flat ? 1 : 0, Math.max(1, Math.round(this.ratio * 1.3))];
    this.painter.compose(lens, ground, Object.values(this.sets).filter((s) => s.shown), { ...this.look4(null, 0), ratio: this.ratio });
    this.canvas.dataset.pointsDrawn = points;
    this.canvas.dataset.frames = ++this.frames;
    if (points && !this.first) {
      this.first = performance.now();
      this.canvas.dataset.firstMs = Math.round(this.first);
    }
    this.told('drawn');
  }

  // Positions in the picture.

  /** Position in page pixels, and the distance; null: behind the eye. */
  project(p) {
    const m = this.lens.matrix, w = m[3] * p[0] + m[7] * p[1] + m[11] * p[2] + m[15];
    if (w <= 0) return null;
    const [x, y] = [0, 1].map((r) => (m[r] * p[0] + m[4 + r] * p[1] + m[8 + r] * p[2] + m[12 + r]) / w);
    return [(x + 1) / 2 * this.canvas.clientWidth, (1 - y) / 2 * this.canvas.clientHeight, w];
  }
  ray(x, y) {
    const { clientWidth: w, clientHeight: h } = this.canvas;
    return this.camera.ray(2 * x / w - 1, 1 - 2 * y / h, w / h);
  }
  shows(p) { return p.every((v, k) => v >= this.cut.low[k] && v <= this.cut.high[k]); }

  /** The point at a place of the picture, of levels up to `level`; null: none is near. */
  pick(x, y, level = 99, reach = 5) {
    const m = this.lens.matrix, w = this.canvas.clientWidth / 2, h = this.canvas.clientHeight / 2, found = [];
    const tx = x / w - 1, ty = 1 - y / h, { from, way } = this.ray(x, y);
    for (const cloud of this.clouds) {
      if (!cloud.visible) continue;
      for (const chunk of cloud.chunks) {
        if (!chunk.places || chunk.level > level || !this.nearRay(chunk, from, way, reach)) continue;
        const s = cloud.step, o = cloud.origin, places = chunk.places;
        const row = (r) => [m[r] * s, m[4 + r] * s, m[8 + r] * s, m[r] * o[0] + m[4 + r] * o[1] + m[8 + r] * o[2] + m[12 + r]];
        const [a, b, d, c] = [0, 1, 2, 3].map(row);
        for (let i = 0, n = chunk.count; i < n; ++i) {
          const px = places[4 * i], py = places[4 * i + 1], pz = places[4 * i + 2];
          const pw = c[0] * px + c[1] * py + c[2] * pz + c[3];
          if (pw <= 0) continue;
          const dx = ((a[0] * px + a[1] * py + a[2] * pz + a[3]) / pw - tx) * w;
          if (dx > reach || dx < -reach) continue;
          const dy = ((b[0] * px + b[1] * py + b[2] * pz + b[3]) / pw - ty) * h;
          if (dx * dx + dy * dy > reach * reach) continue;
          const p = cloud.place(chunk, i), depth = dot(sub(p, from), way);
          if (depth > 0 && this.shows(p) && !this.away(chunk, i, p)) found.push({ cloud, chunk, i, p, depth, off: Math.hypot(dx, dy) });
        }
      }
    }
    if (!found.length) return reach < 12 && level > 1 ? this.pick(x, y, level, 12) : null;
    const nearest = Math.min(...found.map((f) => f.depth));
    return found.filter((f) => f.depth < nearest * 1.01 + 0.04).reduce((best, f) => (f.off < best.off ? f : best));
  }

  away(chunk, i, p) {
    const fold = chunk.colors[4 * i + 3];
    if (!this.cull || fold === 255) return false;
    const n = kDirections.subarray(3 * fold, 3 * fold + 3);
    return dot(n, this.lens.flat ? this.lens.eye : sub(this.lens.eye, p)) < 0;
  }

  nearRay(chunk, from, way, reach) {
    const middle = mul(add(chunk.low, chunk.high), 0.5), radius = length(sub(chunk.high, chunk.low)) / 2;
    const off = sub(middle, from), along = dot(off, way);
    const slack = reach / this.canvas.clientHeight * (this.lens.flat ? this.camera.height : Math.max(0, along + radius) * kFieldOfView);
    return length(sub(off, mul(way, along))) < radius + slack && along > -radius;
  }

  /** Target of a zoom. */
  anchor(x, y) {
    const coarse = this.pick(x, y, 1, 9);
    if (coarse) return coarse.p;
    const { from, way } = this.ray(x, y);
    return add(from, mul(way, this.camera.distance));
  }

  /** Points of all visible clouds within `reach` of a place, at full detail. */
  around(p, reach) {
    const out = [];
    for (const cloud of this.clouds) {
      if (!cloud.visible) continue;
      const low = mul(sub(sub(p, [reach, reach, reach]), cloud.origin), 1 / cloud.step);
      const high = mul(sub(add(p, [reach, reach, reach]), cloud.origin), 1 / cloud.step);
      for (const chunk of cloud.chunks) {
        if (!chunk.places || p.some((v, k) => chunk.low[k] > v + reach || chunk.high[k] < v - reach)) continue;
        const q = chunk.places;
        for (let i = 0; i < chunk.count; ++i) {
          if (q[4 * i] < low[0] || q[4 * i] > high[0] || q[4 * i + 1] < low[1] || q[4 * i + 1] > high[1]) continue;
          const place = cloud.place(chunk, i);
          if (length(sub(place, p)) <= reach) out.push(place);
        }
      }
    }
    return out;
  }
}

function rampColor(s) {
  const stops = [[68, 1, 84], [71, 44, 122], [59, 81, 139], [44, 113, 142], [33, 144, 141], [39, 173, 129], [92, 200, 99], [170, 220, 50], [253, 231, 37]];
  const at = clamp(s, 0, 1) * 8, i = Math.min(7, Math.floor(at));
  return stops[i].map((v, k) => Math.round(v + (stops[i + 1][k] - v) * (at - i)));
}
function categoryColor(i) {
  return [[0, 114, 178], [213, 94, 0], [0, 158, 115], [170, 68, 153], [230, 159, 0], [86, 180, 233], [136, 34, 85], [90, 90, 90]][i % 8];
}
