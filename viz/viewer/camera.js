// SPDX-License-Identifier: BSD-3-Clause
// The camera, and how mouse, fingers and keys move it; z is up.
const kFieldOfView = 2 * Math.tan(Math.PI / 6);
const kEyeHeight_m = 1.6;

class Camera {
  constructor() {
    this.mode = 'orbit';
    this.target = [0, 0, 0];
    this.yaw = -2.2;
    this.pitch = -0.6;
    this.distance = 5;
  }

  get flat() { return this.mode === 'top'; }
  get ahead() {
    const c = Math.cos(this.pitch);
    return [Math.cos(this.yaw) * c, Math.sin(this.yaw) * c, Math.sin(this.pitch)];
  }
  get right() { return [Math.sin(this.yaw), -Math.cos(this.yaw), 0]; }
  get up() { return cross(this.right, this.ahead); }
  get eye() { return sub(this.target, mul(this.ahead, this.distance)); }
  get height() { return kFieldOfView * (this.flat ? this.distance : 1); }

  /** Moves the eye; the distance to the target stays. */
  set eye(place) { this.target = add(place, mul(this.ahead, this.distance)); }

  look(mode) {
    const eye = this.eye;
    if (mode === 'top' && !this.flat) [this.yaw, this.pitch] = [Math.PI / 2, -Math.PI / 2];
    else if (this.flat && mode !== 'top') [this.yaw, this.pitch] = [-2.2, mode === 'walk' ? 0 : -0.6];
    this.mode = mode;
    if (mode === 'walk') {
      this.distance = 2;
      this.eye = eye;
    }
  }

  turn(yaw, pitch) {
    if (this.flat) return;
    const eye = this.eye;
    this.yaw += yaw;
    this.pitch = clamp(this.pitch + pitch, -Math.PI / 2, Math.PI / 2);
    if (this.mode === 'walk') this.eye = eye;
  }

  /** Pans by shares of the picture's height, at the distance of the target. */
  pan(x, y) {
    const s = this.distance * kFieldOfView;
    this.target = add(this.target, add(mul(this.right, -x * s), mul(this.up, y * s)));
  }

  /** Zooms by `factor` towards a place, which stays where it is in the picture. */
  zoom(factor, anchor) {
    const next = clamp(this.distance * factor, 0.05, 2000);
    factor = next / this.distance;
    this.target = add(anchor, mul(sub(this.target, anchor), factor));
    this.distance = next;
  }

  /** Moves in the horizontal plane and up, metres. */
  walk(ahead, right, up) {
    const way = [Math.cos(this.yaw), Math.sin(this.yaw), 0];
    this.target = add(this.target, add(add(mul(way, ahead), mul(this.right, right)), [0, 0, up]));
  }

  /** Matrix and other data that a picture needs, for a scene within `radius` of `middle`. */
  lens(aspect, middle, radius) {
    const eye = this.eye, back = mul(this.ahead, -1), reach = length(sub(eye, middle)) + radius;
    const depth = dot(sub(middle, eye), this.ahead);
    const near = this.flat ? depth - radius - 1 : Math.max(0.03, depth - radius, reach / 4000);
    const far = this.flat ? depth + radius + 1 : Math.max(near * 2, reach * 1.02);
    const matrix = product(projection(this.height, aspect, near, far, this.flat), viewing(eye, this.right, this.up, back));
    return { matrix, near, far, eye: this.flat ? back : eye, flat: this.flat };
  }

  /** Ray through a place of the picture, -1 to 1 from left to right and from bottom to top. */
  ray(x, y, aspect) {
    const h = this.height / 2, offset = add(mul(this.right, x * h * aspect), mul(this.up, y * h));
    if (this.flat) return { from: add(this.eye, offset), way: this.ahead };
    return { from: this.eye, way: unit(add(this.ahead, offset)) };
  }

  get state() { return [this.mode, ...this.target, this.yaw, this.pitch, this.distance]; }
  set state(s) {
    [this.mode, this.yaw, this.pitch, this.distance] = [s[0], s[4], s[5], s[6]];
    this.target = s.slice(1, 4);
  }
}

/** Passes actions of pointers, wheel and keys to a view. */
class Controls {
  constructor(view, canvas) {
    this.view = view;
    this.canvas = canvas;
    this.fingers = new Map();
    this.keys = new Set();
    const on = (what, then, options) => canvas.addEventListener(what, then, options);
    on('contextmenu', (e) => e.preventDefault());
    on('pointerdown', (e) => this.down(e));
    on('pointermove', (e) => this.move(e));
    for (const end of ['pointerup', 'pointercancel']) on(end, (e) => this.up(e, end === 'pointerup'));
    on('wheel', (e) => this.wheel(e), { passive: false });
    on('dblclick', (e) => view.doubleClick(...this.place(e)));
    on('keydown', (e) => this.key(e));
    on('keyup', (e) => this.keys.delete(e.code));
    on('blur', () => this.keys.clear());
  }

  /** Position relative to the canvas's corner, page pixels. */
  place(e) {
    const box = this.canvas.getBoundingClientRect();
    return [e.clientX - box.left, e.clientY - box.top];
  }

  down(e) {
    this.canvas.focus({ preventScroll: true });
    this.canvas.setPointerCapture(e.pointerId);
    const at = this.place(e);
    this.fingers.set(e.pointerId, at);
    this.most = Math.max(this.fingers.size, this.fingers.size > 1 ? this.most : 0);
    this.button = e.button;
    this.began = at;
    this.far = 0;
    this.handle = this.fingers.size === 1 ? this.view.grab(...at) : null;
  }

  move(e) {
    const at = this.place(e), before = this.fingers.get(e.pointerId), { camera } = this.view;
    if (!before) return;
    const h = this.canvas.clientHeight, dx = (at[0] - before[0]) / h, dy = (at[1] - before[1]) / h;
    const others = [...this.fingers].filter(([id]) => id !== e.pointerId).map(([, p]) => p);
    this.fingers.set(e.pointerId, at);
    this.far = Math.max(this.far, Math.hypot(at[0] - this.began[0], at[1] - this.began[1]));
    if (this.handle) {
      this.view.drag(this.handle, ...at);
    } else if (others.length === 0) {
      const pans = this.button > 0 || e.shiftKey || camera.flat;
      if (pans) camera.pan(dx, dy);
      else if (camera.mode === 'walk') camera.turn(dx * 1.6, dy * 1.6);
      else camera.turn(-dx * 3, -dy * 3);
    } else if (others.length === 1) {
      const span = (p) => Math.hypot(p[0] - others[0][0], p[1] - others[0][1]) + 1;
      camera.pan(dx / 2, dy / 2);
      camera.zoom(span(before) / span(at), this.view.anchor((at[0] + others[0][0]) / 2, (at[1] + others[0][1]) / 2));
    } else {
      camera.walk(dy * camera.distance, -dx * camera.distance, 0);
    }
    this.view.changed();
  }

  up(e, clicked) {
    if (!this.fingers.delete(e.pointerId)) return;
    if (this.handle) this.view.drop();
    else if (clicked && this.most === 1 && this.button === 0 && this.far < 5) this.view.click(...this.place(e));
    this.handle = null;
  }

  wheel(e) {
    if (!e.ctrlKey && !e.metaKey && this.view.inPage && document.activeElement !== this.canvas) return;
    e.preventDefault();
    const { camera } = this.view, step = e.deltaY * (e.deltaMode ? 30 : 1);
    if (camera.mode === 'walk') camera.walk(-step / 200, 0, 0);
    else camera.zoom(Math.exp(step / 600), this.view.anchor(...this.place(e)));
    this.view.changed();
  }

  key(e) {
    if (e.ctrlKey || e.metaKey || e.altKey) return;
    const { camera } = this.view, turn = 0.06, letter = e.key.toLowerCase();
    const arrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[e.key];
    if (arrows && (e.shiftKey || camera.flat)) camera.pan(-arrows[0] * 0.05, arrows[1] * 0.05);
    else if (arrows) camera.turn(-arrows[0] * turn, arrows[1] * turn);
    else if ('+=-_'.includes(e.key)) camera.zoom('+='.includes(e.key) ? 0.9 : 1 / 0.9, camera.target);
    else if ('wasdqe'.includes(letter)) this.keys.add(e.code);
    else if (!this.view.command(e.key)) return;
    e.preventDefault();
    this.view.changed();
  }

  /** Applies the held keys for `seconds`; true if any is held. */
  held(seconds) {
    const on = (a, b) => (this.keys.has('Key' + a) ? 1 : 0) - (this.keys.has('Key' + b) ? 1 : 0);
    const { camera } = this.view, way = [on('W', 'S'), on('D', 'A'), on('E', 'Q')];
    if (!way.some((v) => v)) return false;
    const step = seconds * (camera.mode === 'walk' ? 2 : camera.distance * 0.8);
    if (camera.flat) camera.pan(-way[1] * step / camera.distance, way[0] * step / camera.distance);
    else camera.walk(way[0] * step, way[1] * step, way[2] * step);
    return true;
  }
}
