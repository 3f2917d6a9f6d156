// SPDX-License-Identifier: BSD-3-Clause
// Buttons, legend, help, time, and the text over the picture.
const kHelp = [
  ['Drag', 'turn; in the top view move'],
  ['Right button, Shift, two fingers', 'move'],
  ['Wheel, pinch, + −', 'nearer (in a report click first)'],
  ['Double click', 'new middle'],
  ['W A S D, Q E', 'walk, lower, higher; or 3 fingers'],
  ['Arrows, with Shift', 'turn, move'],
  ['1, 2, 3', 'orbit, walk, top view'],
  ['Home', 'whole map'],
  ['Click', 'coordinates, the best picture'],
  ['M, Enter, Backspace', 'next tool, end a line, undo'],
  ['Space', 'a click in the middle of the picture'],
  ['C', 'next cut; drag its handles'],
  ['L', 'next colouring'],
  ['X', 'the other map'],
  ['P', 'fly along the path, stop'],
  ['?', 'this help'],
];

/** Makes an element with attributes and children. */
function element(name, attributes = {}, ...inside) {
  const made = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith('on')) made.addEventListener(key.slice(2), value);
    else if (value !== false && value !== undefined) made.setAttribute(key, value === true ? '' : value);
  }
  made.append(...inside);
  return made;
}

class Panel {
  constructor(root, scene, data) {
    this.root = root;
    this.scene = scene;
    this.canvas = element('canvas', { class: 'pv-canvas', tabindex: 0, 'aria-label': `Map of ${scene.name}; ? tells the keys` });
    this.overlay = element('canvas', { class: 'pv-over', 'aria-hidden': 'true' });
    root.append(this.canvas, this.overlay);
    this.view = new View(scene, data, this.canvas, this.overlay);
    this.measuring = new Measuring(this.view);
    this.view.inPage = !root.classList.contains('pv-whole');
    this.shows = { path: true, frames: false, lines: false, arcs: true, plan: false };
    Object.assign(this.view, {
      click: (x, y) => this.click(x, y), doubleClick: (x, y) => this.doubleClick(x, y), command: (key) => this.command(key),
      grab: (x, y) => this.grab(x, y), drag: (h, x, y) => this.drag(h, x, y),
      drop: () => this.fillCut(),
    });
    this.build();
    this.view.listeners.push((what) => this.hear(what));
    const dark = matchMedia('(prefers-color-scheme: dark)'), theme = () => {
      this.view.dark = dark.matches;
      this.view.again();
    };
    dark.addEventListener('change', theme);
    theme();
    this.buildSets();
    this.restore();
  }

  choice(label, options, chosen, then) {
    const list = element('select', { 'aria-label': label, title: label, onchange: () => then(list.value) },
      ...options.map(([value, text]) => element('option', { value, selected: value === chosen }, text)));
    return list;
  }
  button(text, title, then, more) { return element('button', { type: 'button', title: title || text, 'aria-label': title || text, onclick: then, ...more }, text); }
  check(label, on, then) {
    const box = element('input', { type: 'checkbox', onchange: () => then(box.checked) });
    box.checked = on;
    return element('label', {}, box, label);
  }

  build() {
    const { scene, view } = this, cloud = scene.clouds[0];
    const layers = [['photo', 'Colour: photo'], ['height', 'Colour: height'], ...(view.cull ? [['normal', 'Colour: normal']] : []),
      ...[...new Map(scene.clouds.flatMap((c) => c.layers).map((l) => [l.key, `Colour: ${l.label.toLowerCase()}`]))]];
    if (cloud && !cloud.colored) layers.push(layers.shift());
    if (scene.live) layers.push(['robot', 'Colour: robot']);
    this.modes = [['orbit', 'Orbit'], ['walk', 'Walk'], ['top', 'Top']].map(([mode, text], i) =>
      this.button(text, `${text} (${i + 1})`, () => this.look(mode), { 'data-mode': mode }));
    this.layers = this.choice('Colour by', layers, 'photo', (key) => view.setLayer(key));
    this.tools = this.choice('Measure', [['', 'Measure…'], ...Object.entries(kTools).map(([k, t]) => [k, t.label])], '', (tool) => this.tool(tool));
    this.cuts = this.choice('Cut', [['none', 'No cut'], ['slab', 'Cut: heights'], ['box', 'Cut: box']], 'none', (kind) => this.cutBy(kind));
    this.more = element('details', { class: 'pv-more' }, element('summary', { title: 'What is shown, saving' }, 'More'), this.moreBox());
    this.bar = element('div', { class: 'pv-bar', role: 'toolbar', 'aria-label': 'Map' }, element('span', { class: 'pv-modes' }, ...this.modes),
      this.layers, this.tools, this.cuts, this.more, this.button('?', 'Help (?)', () => this.help()));
    this.legend = element('div', { class: 'pv-legend' });
    this.told = element('div', { class: 'pv-told', role: 'status' });
    this.list = element('ol', { class: 'pv-list' });
    this.results = element('div', { class: 'pv-results', hidden: true }, this.list,
      this.button('Copy', 'Copy as text', () => this.copy(this.measuring.text(), 'measurements copied')));
    this.thumb = element('img', { class: 'pv-thumb', alt: 'picture of the keyframe', hidden: true });
    this.time = element('input', { type: 'range', min: 0, max: 1000, step: 1, value: 0, 'aria-label': 'Time along the path', oninput: () => this.goTo(this.time.value / 1000) });
    this.stamp = element('span');
    this.timeBar = element('div', { class: 'pv-time', hidden: !scene.paths.length }, this.button('▶', 'Fly (P)', () => this.fly()), this.time, this.stamp);
    this.dialog = element('dialog', { class: 'pv-help', 'aria-label': 'Keys' }, element('table', {}, ...kHelp.map(([keys, what]) =>
      element('tr', {}, element('th', {}, keys), element('td', {}, what)))), this.button('Close', '', () => this.dialog.close()));
    this.root.append(this.bar, element('div', { class: 'pv-low' }, this.thumb, this.results, scene.placing ? element('div', {}, `${scene.placing}. X shows the other, both.`) : '', this.told, this.legend, this.timeBar), this.dialog);
    this.mark();
    addEventListener('beforeprint', () => this.print());
    const thinned = scene.clouds.filter((c) => c.of > c.count).map((c) => `${c.count.toLocaleString('en')} of ${c.of.toLocaleString('en')} points`);
    if (thinned.length) this.say(`thinned: ${thinned.join(', ')}`);
  }

  moreBox() {
    const { scene, view, shows } = this, box = element('div', { class: 'pv-box' });
    const show = (key, label, there) => there && box.append(this.check(label, shows[key], (on) => this.show(key, on)));
    box.append(this.check('Points', true, (on) => this.visible(on)));
    show('path', 'Path of the camera', scene.paths.length);
    show('frames', 'Keyframes', scene.keyframes.length);
    show('arcs', 'Loops and merges', scene.arcs.length);
    show('lines', 'Lines', scene.lines.length);
    show('plan', 'Floor plan', scene.walls.length);
    if (view.cull) box.append(this.check('Hide what faces away', true, (on) => { view.cull = on; view.again(); }));
    if (scene.clouds.length > 1) {
      this.blends = this.choice('Two maps', [['a', scene.clouds[0].name], ['b', scene.clouds[1].name], ['both', 'Both, tinted']], 'a', (which) => this.blendBy(which));
      box.append(this.blends);
      this.blendBy('a');
    }
    const size = element('input', { type: 'range', min: -10, max: 10, value: 0, oninput: () => { view.size = 2 ** (size.value / 6); view.again(); } });
    box.append(element('label', {}, 'Size of points', size));
    this.cutBox = element('div', { class: 'pv-cut', hidden: true });
    box.append(this.cutBox, this.button('Save picture (PNG)', '', () => this.savePicture()),
      this.button('Save points (PLY)', '', () => this.savePoints()),
      this.button('Copy link to this view', '', () => this.copyLink()),
      this.button('Full screen', '', () => this.root.requestFullscreen()));
    return box;
  }

  say(text) {
    this.told.textContent = text;
    this.told.hidden = !text;
  }
  help() { this.dialog.open ? this.dialog.close() : this.dialog.showModal(); }
  mark() { this.modes.forEach((b) => b.setAttribute('aria-pressed', b.dataset.mode === this.view.camera.mode)); }
  look(mode) {
    this.stop();
    this.view.look(mode);
    this.mark();
    if (mode === 'top' && this.view.cut.kind === 'none' && this.scene.up && !this.view.cull) this.cutBy('slab');
  }

  next(list, then) {
    list.selectedIndex = (list.selectedIndex + 1) % list.options.length;
    then(list.value);
  }

  /** Handles a key; false if it has no function. */
  command(key) {
    const { view, measuring } = this, modes = { 1: 'orbit', 2: 'walk', 3: 'top' };
    const does = {
      '?': () => this.help(), Home: () => { this.stop(); view.home(); this.mark(); }, m: () => this.next(this.tools, (t) => this.tool(t)),
      l: () => this.next(this.layers, (k) => view.setLayer(k)), c: () => this.next(this.cuts, (k) => this.cutBy(k)), p: () => this.fly(),
      x: () => this.blends && this.next(this.blends, (w) => this.blendBy(w)), Enter: () => measuring.end(), Escape: () => { measuring.end(); this.tools.value = ''; this.tool(''); },
      Backspace: () => measuring.remove(measuring.list[measuring.list.length - 1]),
      ' ': () => this.click(this.canvas.clientWidth / 2, this.canvas.clientHeight / 2),
    }[key.length === 1 ? key.toLowerCase() : key];
    if (modes[key]) this.look(modes[key]);
    else if (does) does();
    else return false;
    return true;
  }

  tool(tool) {
    this.measuring.choose(tool);
    this.canvas.classList.toggle('pv-measures', tool !== '');
    this.say(tool ? `${kTools[tool].label}: click points of the map` : '');
  }

  async click(x, y) {
    const got = await this.measuring.add(x, y);
    if (!got) this.say('no point of the map is here');
    else if (got.text) this.say(got.text);
    if (got && !this.measuring.tool) {
      this.at = got.p;
      this.showKeyframe(this.scene.keyframes[got.seen]);
    }
    this.drawOver();
    return got;
  }
  doubleClick(x, y) {
    const hit = !this.measuring.tool && this.view.pick(x, y);
    if (this.measuring.open) this.measuring.end();
    else if (hit) {
      this.view.camera.target = hit.p;
      this.view.changed();
    }
  }

  showKeyframe(keyframe) {
    this.thumb.hidden = !keyframe || !keyframe.i;
    if (!this.thumb.hidden) {
      this.thumb.src = `data:image/jpeg;base64,${keyframe.i}`;
      this.thumb.title = `keyframe at ${keyframe.t.toFixed(3)} s`;
    }
  }

  visible(on) {
    this.pointsHidden = !on;
    this.blendBy(this.view.blend);
  }
  blendBy(which) {
    this.view.blend = which;
    this.view.clouds.forEach((c, k) => { c.visible = !this.pointsHidden && (which === 'both' || (which === 'b') === (k === 1)); });
    if (this.view.layer.key !== 'photo') this.view.setLayer(this.view.layer.key);
    this.view.again();
  }
  show(key, on) {
    this.shows[key] = on;
    this.buildSets();
  }

  // Cutting.

  cutBy(kind, cut) {
    this.view.cut = cut || startOfCut(this.view, kind);
    this.cuts.value = kind;
    this.fillCut();
    this.view.again();
  }
  fillCut() {
    const { view } = this, { cut } = view;
    this.cutBox.hidden = cut.kind === 'none';
    const axes = { none: [], slab: [2], box: [0, 1, 2] }[cut.kind];
    this.cutBox.replaceChildren(...axes.flatMap((k) => ['low', 'high'].map((side) => {
      const range = element('input', { type: 'range', min: view.low[k], max: view.high[k], step: 0.01, value: clamp(cut[side][k], view.low[k], view.high[k]),
        'data-cut': side + k, oninput: () => this.cutAt(k, side, Number(range.value)) });
      return element('label', {}, `${kBox[k]} ${side === 'low' ? 'from' : 'to'} ${(cut[side][k] + view.base[k]).toFixed(2)}`, range);
    })));
  }
  cutAt(axis, side, value) {
    const { cut } = this.view;
    cut[side][axis] = side === 'low' ? Math.min(value, cut.high[axis] - 0.02) : Math.max(value, cut.low[axis] + 0.02);
    this.view.changed();
    const label = this.cutBox.querySelector(`[data-cut=${side}${axis}]`);
    if (label) label.previousSibling.textContent = `${kBox[axis]} ${side === 'low' ? 'from' : 'to'} ${(cut[side][axis] + this.view.base[axis]).toFixed(2)}`;
  }
  grab(x, y) {
    return this.handles().find((h) => h.at && Math.hypot(h.at[0] - x, h.at[1] - y) < 14) || null;
  }
  handles() { return handlesOf(this.view).map((h) => ({ ...h, at: this.view.project(h.p) })); }
  /** Moves the handle along its axis to the point nearest to the pointer's ray. */
  drag(handle, x, y) {
    const { from, way } = this.view.ray(x, y), axis = [0, 0, 0];
    axis[handle.axis] = 1;
    const across = 1 - dot(way, axis) ** 2;
    if (across < 1e-4) return;
    const off = sub(from, handle.p);
    this.cutAt(handle.axis, handle.side, handle.p[handle.axis] + (dot(off, axis) - dot(off, way) * dot(way, axis)) / across);
  }

  // Lines in the scene.

  buildSets() {
    const { scene, view, shows } = this, sets = view.sets, local = (p) => view.local(p), out = { path: [], frames: [], lines: [], arcs: [], plan: [] };
    const segment = (key, a, b, color, alpha = 1) => out[key].push(...a, ...b, ...color.map((v) => v / 255), alpha);
    for (const path of scene.paths) {
      for (let i = 1; i < path.t.length; ++i) {
        const a = local(path.p.slice(3 * i - 3, 3 * i)), b = local(path.p.slice(3 * i, 3 * i + 3));
        if (length(sub(a, b)) < 1) segment('path', a, b, categoryColor(path.robot));
      }
    }
    for (const k of scene.keyframes) {
      const eye = local(k.p), corner = (x, y) => add(eye, turned(k.q, [x * 0.1, y * 0.075, 0.13])), c = [corner(-1, -1), corner(1, -1), corner(1, 1), corner(-1, 1)];
      c.forEach((p, i) => [[eye, p], [p, c[(i + 1) % 4]]].forEach(([a, b]) => segment('frames', a, b, categoryColor(k.robot), 0.7)));
    }
    for (let i = 0; i < scene.lines.length; i += 6) segment('lines', local(scene.lines.slice(i, i + 3)), local(scene.lines.slice(i + 3, i + 6)), [20, 90, 200]);
    for (const { a, b, merge } of scene.arcs) {
      const from = local(a), to = local(b), rise = 0.15 + 0.25 * length(sub(to, from));
      const at = (s) => add(add(from, mul(sub(to, from), s)), [0, 0, 4 * rise * s * (1 - s)]);
      for (let i = 0; i < 16; ++i) segment('arcs', at(i / 16), at((i + 1) / 16), merge ? [213, 94, 0] : [0, 158, 115]);
    }
    const walls = (numbers, color) => {
      for (let i = 0; i < numbers.length; i += 6) segment('plan', local(numbers.slice(i, i + 3)), local(numbers.slice(i + 3, i + 6)), color);
    };
    walls(scene.walls, view.dark ? [240, 240, 240] : [20, 20, 20]);
    walls(scene.doors, [213, 94, 0]);
    for (const key of Object.keys(out)) {
      sets[key] = view.painter.lineSet(out[key], { path: 2, plan: 3, arcs: 2 }[key] || 1, sets[key]);
      sets[key].shown = shows[key] && sets[key].count > 0;
    }
    view.again();
  }

  // Time.

  /** Moves the eye to the camera of the first path, at a share of its time. */
  goTo(share) {
    const path = this.scene.paths[0], n = path.t.length, t = path.t[0] + share * (path.t[n - 1] - path.t[0]), { camera } = this.view;
    let i = path.t.findIndex((v) => v > t) - 1;
    if (i < 0) i = share < 0.5 ? 0 : Math.max(0, n - 2);
    const j = Math.min(i + 1, n - 1), s = j > i ? clamp((t - path.t[i]) / (path.t[j] - path.t[i]), 0, 1) : 0;
    const a = path.p.slice(3 * i, 3 * i + 3), b = path.p.slice(3 * j, 3 * j + 3), q = path.q.slice(4 * i, 4 * i + 4), r = path.q.slice(4 * j, 4 * j + 4);
    const way = unit(add(mul(turned(q, [0, 0, 1]), 1 - s), mul(turned(r, [0, 0, 1]), s)));
    Object.assign(camera, { mode: 'walk', yaw: Math.atan2(way[1], way[0]), pitch: Math.asin(clamp(way[2], -1, 1)), distance: 2 });
    camera.eye = this.view.local(add(mul(a, 1 - s), mul(b, s)));
    this.time.value = Math.round(share * 1000);
    this.stamp.textContent = `${(t - path.t[0]).toFixed(1)} s`;
    const near = this.scene.keyframes.filter((k) => k.robot === path.robot).reduce((best, k) => (!best || Math.abs(k.t - t) < Math.abs(best.t - t) ? k : best), null);
    this.showKeyframe(near);
    this.mark();
    this.view.changed();
  }
  fly() {
    const path = this.scene.paths[0];
    if (this.view.fly || !path) {
      this.stop();
      return;
    }
    const whole = path.t[path.t.length - 1] - path.t[0] || 1;
    let share = this.time.value >= 1000 ? 0 : this.time.value / 1000;
    this.timeBar.firstChild.textContent = '⏸';
    this.view.fly = (seconds) => {
      share += seconds / whole;
      this.goTo(Math.min(share, 1));
      if (share >= 1) this.stop();
    };
  }
  stop() {
    this.view.fly = null;
    this.timeBar.firstChild.textContent = '▶';
  }

  // Text over the picture.

  hear(what) {
    if (what === 'drawn') this.drawOver();
    if (what === 'layer') this.fillLegend();
    if (what === 'measured') {
      this.results.hidden = !this.measuring.list.length;
      this.list.replaceChildren(...this.measuring.list.map((m) => element('li', {}, m.text, this.button('×', 'Take away', () => this.measuring.remove(m)))));
      this.drawOver();
    }
  }

  drawOver() {
    const { view, measuring } = this, g = this.overlay.getContext('2d'), ratio = view.ratio || 1;
    if (!view.lens) return;
    g.setTransform(ratio, 0, 0, ratio, 0, 0);
    g.clearRect(0, 0, this.overlay.width, this.overlay.height);
    [g.font, g.lineWidth, g.textAlign, g.textBaseline] = ['13px system-ui, sans-serif', 2, 'center', 'middle'];
    const ink = view.dark ? '#fff' : '#111', paper = view.dark ? 'rgba(0,0,0,.7)' : 'rgba(255,255,255,.8)';
    const label = (text, x, y) => {
      const w = g.measureText(text).width + 10;
      g.fillStyle = paper;
      g.fillRect(x - w / 2, y - 10, w, 20);
      g.fillStyle = ink;
      g.fillText(text, x, y);
    };
    const path = (places, closed, color) => {
      const at = places.map((p) => view.project(p));
      if (at.some((p) => !p)) return;
      g.strokeStyle = color;
      g.beginPath();
      at.forEach((p) => g.lineTo(p[0], p[1]));
      if (closed) g.closePath();
      g.stroke();
    };
    const spot = (p, color) => {
      const at = view.project(p);
      if (!at) return;
      [g.fillStyle, g.strokeStyle] = [color, '#fff'];
      g.beginPath();
      g.arc(at[0], at[1], 5, 0, 7);
      g.fill();
      g.stroke();
    };
    edgesOfCut(view).forEach((edge) => path(edge, false, '#e69f00'));
    handlesOf(view).forEach((h) => spot(h.p, '#e69f00'));
    for (const m of measuring.list) {
      const places = m.points.map((q) => q.p);
      if (m.tool === 'height') places.push([places[0][0], places[0][1], view.floor]);
      path(places, m.tool === 'area' && places.length > 2, '#d55e00');
      m.points.forEach((q) => spot(q.p, '#d55e00'));
      const at = view.project(mul(places.reduce(add, [0, 0, 0]), 1 / places.length));
      if (at && m.tool !== 'point') label(m.text.split(/ \(| ±| above| over| within/)[0], at[0], at[1] - 14);
    }
    if (this.at && !measuring.tool) spot(this.at, '#0072b2');
    if (this.shows.plan) {
      this.scene.rooms.forEach(([p, text]) => {
        const at = view.project(view.local(p));
        if (at) label(text, at[0], at[1]);
      });
    }
    (this.live || []).forEach((robot) => {
      const at = view.project(view.local(robot.p));
      if (at) spot(view.local(robot.p), `rgb(${categoryColor(robot.number)})`), label(robot.name, at[0], at[1] - 16);
    });
  }

  fillLegend() {
    const { view } = this, { layer } = view, parts = [];
    const bar = (from, to) => parts.push(element('span', {}, from), element('i', { class: 'pv-ramp' }), element('span', {}, to));
    const value = (v, unitName) => (unitName === 'm' && Math.abs(v) < 0.1 ? millimetres(v) : `${+v.toPrecision(3)} ${unitName}`.trim());
    if (layer.key === 'height') bar(...view.heights().map((v) => metres(v + view.base[2], 2)));
    else if (layer.key === 'normal') ['x', 'y', 'z'].forEach((k, i) => parts.push(element('b', { style: `background:rgb(${[0, 1, 2].map((j) => (i === j ? 255 : 128))})` }), element('span', {}, `towards ${k}`)));
    else if (layer.scale === 'category') layer.names.forEach((name, i) => parts.push(element('b', { style: `background:rgb(${categoryColor(i)})` }), element('span', {}, name)));
    else if (layer.scale === 'view') bar('0 s', `${(view.times()[1] - view.times()[0]).toFixed(0)} s`);
    else if (layer.scale) bar(value(layer.low, layer.unit), value(layer.high, layer.unit));
    this.layers.value = layer.key;
    if (layer.key === 'sigma') parts.push(element('span', {}, 'noise alone, true errors are larger'));
    this.legend.replaceChildren(...(parts.length ? [element('em', {}, layer.label || layer.key), ...parts] : []));
  }

  // Saving, and links.

  /** A copy of what is shown. */
  copied() {
    const { width, height, dataset } = this.canvas;
    this.view.finish(Number(dataset.pointsDrawn));
    const both = element('canvas', { width, height, class: 'pv-paper' }), g = both.getContext('2d');
    g.drawImage(this.canvas, 0, 0);
    g.drawImage(this.overlay, 0, 0);
    return both;
  }
  picture() { return new Promise((done) => this.copied().toBlob(done, 'image/png')); }
  /** Puts what is shown onto paper, where the view itself is not. */
  print() {
    if (this.view.dirty) this.view.quick(true);
    if (this.paper) this.paper.remove();
    this.paper = this.copied();
    if (this.view.first) this.root.after(this.paper);
  }
  async savePicture() { saveAs(await this.picture(), `${this.scene.name}.png`); }
  savePoints() {
    const { count, blob } = plyOf(this.view);
    saveAs(blob, `${this.scene.name}.ply`);
    this.say(`${count.toLocaleString('en')} points saved`);
  }
  async copy(text, what) {
    await copyText(text);
    this.say(what);
  }

  state() {
    const round = (v) => (typeof v === 'number' ? Math.round(v * 1e4) / 1e4 : v), { view } = this;
    return {
      c: view.camera.state.map(round), l: view.layer.key, s: this.shows, b: view.blend,
      k: view.cut.kind === 'none' ? undefined : [view.cut.kind, ...view.cut.low.map(round), ...view.cut.high.map(round)],
      m: this.measuring.list.map((m) => [m.tool, ...m.points.map((q) => [...q.p.map(round), Number.isFinite(q.sigma) ? round(q.sigma) : null, q.seen])]),
    };
  }
  link() { return `${location.href.replace(/#.*/, '')}#view=${encodeURIComponent(JSON.stringify(this.state()))}`; }
  async copyLink() {
    const link = this.link();
    location.hash = link.slice(link.indexOf('#'));
    await this.copy(link, 'link copied');
  }
  restore() {
    if (!location.hash.startsWith('#view=')) return;
    try {
      const s = JSON.parse(decodeURIComponent(location.hash.slice(6))), { view } = this;
      view.camera.state = s.c;
      Object.assign(this.shows, s.s);
      if (s.k) this.cutBy(s.k[0], { kind: s.k[0], low: s.k.slice(1, 4), high: s.k.slice(4, 7) });
      if (this.blends) this.blendBy(this.blends.value = s.b);
      for (const [tool, ...points] of s.m) {
        const m = { tool, points: points.map(([x, y, z, sigma, seen = -1]) => ({ p: [x, y, z], sigma: sigma ?? NaN, seen })) };
        this.measuring.list.push(m);
        this.measuring.describe(m);
      }
      this.mark();
      this.buildSets();
      this.hear('measured');
      if (s.l !== 'photo') view.setLayer(s.l);
    } catch (e) {
      this.say('damaged link: here is the whole map');
    }
  }
}
