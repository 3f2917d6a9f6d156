// SPDX-License-Identifier: BSD-3-Clause
// Drawing with WebGL 2 (kShaders: the text of this folder's *.vert and *.frag): round splats, eye-dome lighting (Boucheny 2009), lines that are seen through what hides them.

class Painter {
  constructor(canvas) {
    const gl = canvas.getContext('webgl2', { antialias: false, alpha: false, depth: false });
    if (!gl) throw new Error('no WebGL 2');
    this.canvas = canvas;
    this.gl = gl;
    this.points = this.program(kShaders['points.vert'], kShaders['points.frag']);
    this.light = this.program(kShaders['screen.vert'], kShaders['light.frag']);
    this.lines = this.program(kShaders['lines.vert'], kShaders['lines.frag']);
    this.nothing = gl.createVertexArray();
    this.setPalette(new Uint8Array(768));
    this.targets = [null, null];
    this.front = 0;
  }

  program(vertex, fragment) {
    const gl = this.gl, program = gl.createProgram(), at = {};
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    const count = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS);
    for (let i = 0; i < count; ++i) {
      const name = gl.getActiveUniform(program, i).name;
      at[name.slice(2)] = gl.getUniformLocation(program, name);
    }
    return { program, at };
  }

  /** Selects a program and sets its uniforms: numbers, vectors and matrices; `textures`: on units 0, 1 ... */
  use({ program, at }, values, textures = {}) {
    const gl = this.gl;
    gl.useProgram(program);
    for (const [name, v] of Object.entries(values)) {
      if (typeof v === 'number') gl.uniform1f(at[name], v);
      else if (v.length === 16) gl.uniformMatrix4fv(at[name], false, new Float32Array(v));
      else gl[`uniform${v.length}fv`](at[name], v);
    }
    Object.entries(textures).forEach(([name, texture], unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.uniform1i(at[name], unit);
    });
  }

  /** Selects the target; null: the canvas. */
  into(target) {
    const { gl } = this, { width, height } = target || this.canvas;
    gl.bindFramebuffer(gl.FRAMEBUFFER, target && target.buffer);
    gl.viewport(0, 0, width, height);
  }

  texture(inner, width, height, format, type, bytes) {
    const gl = this.gl, t = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, t);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage2D(gl.TEXTURE_2D, 0, inner, width, height, 0, format, type, bytes);
    for (const f of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, f, gl.NEAREST);
    return t;
  }

  /** A picture of colour and depth, of this size. */
  target(which, width, height) {
    const gl = this.gl, old = this.targets[which];
    if (old && old.width === width && old.height === height) return old;
    if (old) [old.color, old.depth].forEach((t) => gl.deleteTexture(t));
    const made = { width, height, buffer: old ? old.buffer : gl.createFramebuffer() };
    made.color = this.texture(gl.RGBA8, width, height, gl.RGBA, gl.UNSIGNED_BYTE, null);
    made.depth = this.texture(gl.DEPTH_COMPONENT24, width, height, gl.DEPTH_COMPONENT, gl.UNSIGNED_INT, null);
    gl.bindFramebuffer(gl.FRAMEBUFFER, made.buffer);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, made.color, 0);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, made.depth, 0);
    return this.targets[which] = made;
  }

  /** 256 colours, three bytes each. */
  setPalette(bytes) {
    const { gl } = this;
    if (this.palette) gl.deleteTexture(this.palette);
    this.palette = this.texture(gl.RGB8, 256, 1, gl.RGB, gl.UNSIGNED_BYTE, bytes);
  }

  /** A buffer with numbers, and its attributes by location: [size, type, normalised, offset]. */
  fill(array, buffer, numbers, stride, places, first = 0, divisor = 0) {
    const { gl } = this;
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, numbers, gl.STATIC_DRAW);
    places.forEach(([size, type, normalised, offset], k) => {
      gl.enableVertexAttribArray(first + k);
      gl.vertexAttribPointer(first + k, size, type, normalised, stride, offset);
      gl.vertexAttribDivisor(first + k, divisor);
    });
    gl.bindVertexArray(null);
  }

  upload(chunk) {
    const { gl } = this;
    if (!chunk.array) {
      chunk.array = gl.createVertexArray();
      chunk.buffers = [gl.createBuffer(), gl.createBuffer()];
      this.fill(chunk.array, chunk.buffers[1], chunk.colors, 4, [[4, gl.UNSIGNED_BYTE, true, 0]], 1);
    }
    this.fill(chunk.array, chunk.buffers[0], chunk.places, 8, [[4, gl.UNSIGNED_SHORT, false, 0]]);
    chunk.stale = false;
  }

  begin(which, width, height) {
    const { gl } = this;
    this.into(this.target(which, width, height));
    gl.clearColor(0, 0, 0, 0);
    gl.depthMask(true);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  }

  /** Draws chunks of one cloud into a target. `look`: view matrix, splat sizes, cut, colours. */
  drawPoints(which, cloud, chunks, look) {
    const { gl } = this;
    this.into(this.targets[which]);
    gl.enable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    this.use(this.points, {
      view: look.matrix, origin: cloud.origin, low: look.low, high: look.high, eye: look.eye, tint: look.tint, round: look.round ? 1 : 0,
      size: [cloud.step, look.size, look.least, look.most], look: [look.mode, look.from, look.cull, look.per],
    }, { palette: this.palette });
    for (const chunk of chunks) {
      if (!chunk.array || chunk.stale) this.upload(chunk);
      gl.bindVertexArray(chunk.array);
      gl.drawArrays(gl.POINTS, 0, chunk.count);
    }
    gl.bindVertexArray(null);
  }

  /** Draws the front target with lighting on the canvas, and lines over it. */
  compose(lens, ground, sets, look) {
    const { gl, canvas } = this, { width, height, color, depth } = this.targets[this.front], scale = [width / canvas.width, height / canvas.height];
    this.into(null);
    gl.disable(gl.DEPTH_TEST);
    gl.disable(gl.BLEND);
    this.use(this.light, { lens, ground, scale }, { color, depth });
    gl.bindVertexArray(this.nothing);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
    for (const set of sets) {
      this.use(this.lines, { scale, view: look.matrix, low: look.low, high: look.high, window: [canvas.width / 2, canvas.height / 2, set.width * look.ratio / 2] }, { depth });
      gl.bindVertexArray(set.array);
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, set.count);
    }
    gl.bindVertexArray(null);
  }

  /** Segments of ten numbers: from, to, red, green, blue, alpha. */
  lineSet(numbers, width, old) {
    const { gl } = this, set = old || { array: gl.createVertexArray(), buffer: gl.createBuffer() };
    Object.assign(set, { width, count: numbers.length / 10 });
    this.fill(set.array, set.buffer, new Float32Array(numbers), 40, [[3, gl.FLOAT, false, 0], [3, gl.FLOAT, false, 12], [4, gl.FLOAT, false, 24]], 0, 1);
    return set;
  }
}
