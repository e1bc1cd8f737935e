// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// A small WebGL2 renderer: one cloud of points between two states, lines and faces likewise.
const POINT_SHADER = `#version 300 es
in vec3 a; in vec3 b; in vec3 rgb; in vec4 value; in float s;
uniform mat4 matrix; uniform vec3 centre; uniform float reach;
uniform float t, mode, size, dim, far, weak; uniform vec3 r0, r1, r2, r3, k0, k1, at;
out vec3 colour;
// Grey up to four times the noise, then the accent.
vec3 ramp(float x) {
  return x < .375 ? mix(r0, r1, x / .375) : x < .45 ? mix(r1, r2, (x - .375) / .075) : mix(r2, r3, (x - .45) / .55);
}
void main() {
  vec3 p = centre + (mix(b, a, t) * 2. - 1.) * reach;
  gl_Position = matrix * vec4(p, 1.);
  float depth = gl_Position.w, e = mix(value.y, value.x, t), grow = 1.;
  if (mode < .5) colour = rgb;
  else if (mode < 1.5) {
    colour = ramp(e); grow = 1. + .9 * smoothstep(.38, .7, e); gl_Position.z -= .0006 * e * depth;
  } else if (mode < 2.5) { colour = mix(k0, k1, value.z); grow = .8 + .6 * value.z; }
  else { colour = ramp(value.w); grow = 1. + .6 * smoothstep(.38, .7, value.w); }
  if (s > 1.5) { colour = at; grow = 4.; gl_Position.z -= .002 * depth; }
  else if (s > .5) grow *= 1.5;
  else if (dim > .5) { colour = mix(colour, k0, .78); grow *= .8; }
  gl_PointSize = clamp(size * grow * far / max(.0001, depth), 1., 14.);
}`;
const POINT_COLOUR = `#version 300 es
precision mediump float; in vec3 colour; out vec4 drawn;
void main() { vec2 d = gl_PointCoord - .5; if (dot(d, d) > .26) discard; drawn = vec4(colour, 1.); }`;
const LINE_SHADER = `#version 300 es
in vec3 a; in vec3 b; in vec2 tone; uniform mat4 matrix; uniform float t; uniform vec3 ink, grey, at;
out vec4 colour;
void main() {
  colour = vec4(tone.x > .75 ? at : mix(grey, ink, tone.x * 2.), tone.y);
  gl_Position = matrix * vec4(mix(b, a, t), 1.);
}`;
const LINE_COLOUR = `#version 300 es
precision mediump float; in vec4 colour; out vec4 drawn;
void main() { drawn = vec4(colour.rgb * colour.a, colour.a); }`;

class Renderer {
  constructor(canvas) {
    // Without a graphics processor, smooth edges cost half of the frames.
    const probe = document.createElement('canvas').getContext('webgl2');
    if (!probe) throw new Error('no WebGL');
    const info = probe.getExtension('WEBGL_debug_renderer_info');
    const name = probe.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : probe.RENDERER);
    const lost = probe.getExtension('WEBGL_lose_context');
    if (lost) lost.loseContext();
    this.software = /swiftshader|llvmpipe|software|basic render/i.test(name);
    const gl = canvas.getContext('webgl2', { antialias: !this.software, preserveDrawingBuffer: true, powerPreference: 'low-power' });
    if (!gl) throw new Error('no WebGL');
    this.gl = gl;
    this.points = this.program(POINT_SHADER, POINT_COLOUR);
    this.lines = this.program(LINE_SHADER, LINE_COLOUR);
    gl.enable(gl.DEPTH_TEST);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  }
  program(vertex, fragment) {
    const gl = this.gl;
    const p = gl.createProgram();
    for (const [type, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, text);
      gl.compileShader(shader);
      if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
      gl.attachShader(p, shader);
    }
    gl.linkProgram(p);
    if (!gl.getProgramParameter(p, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(p));
    const uniforms = {};
    for (let i = 0; i < gl.getProgramParameter(p, gl.ACTIVE_UNIFORMS); i++) {
      const { name } = gl.getActiveUniform(p, i);
      uniforms[name] = gl.getUniformLocation(p, name);
    }
    return { p, uniforms };
  }
  // Numbers of one kind for each vertex; what is not a float counts from 0 to 1 unless it is raw.
  attribute(program, name, array, width, stride, raw) {
    const gl = this.gl;
    const place = gl.getAttribLocation(program.p, name);
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, array, gl.DYNAMIC_DRAW);
    if (place < 0) return buffer;
    const type = array instanceof Uint8Array ? gl.UNSIGNED_BYTE : array instanceof Uint16Array ? gl.UNSIGNED_SHORT : gl.FLOAT;
    gl.enableVertexAttribArray(place);
    gl.vertexAttribPointer(place, width, type, !raw, stride, 0);
    return buffer;
  }
  update(buffer, array) {
    this.gl.bindBuffer(this.gl.ARRAY_BUFFER, buffer);
    this.gl.bufferSubData(this.gl.ARRAY_BUFFER, 0, array);
  }
  cloud(after, before, rgb, value, order) {
    const gl = this.gl;
    const out = { vao: gl.createVertexArray(), count: order.length, chosen: new Uint8Array(value.length / 4) };
    gl.bindVertexArray(out.vao);
    this.attribute(this.points, 'a', after, 3, 8);
    this.attribute(this.points, 'b', before, 3, 8);
    this.attribute(this.points, 'rgb', rgb, 3, 4);
    this.attribute(this.points, 'value', value, 4, 4);
    out.buffer = this.attribute(this.points, 's', out.chosen, 1, 1, true);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, order, gl.STATIC_DRAW);
    gl.bindVertexArray(null);
    return out;
  }
  // after, before: three numbers for each end; tones: what colour (0 grey, 127 ink, 255 accent), how solid.
  segments(after, before, faces) {
    const gl = this.gl;
    const n = after.length / 3;
    const out = { vao: gl.createVertexArray(), count: n, after, before, tone: new Uint8Array(2 * n), visible: true, kind: faces ? gl.TRIANGLES : gl.LINES };
    gl.bindVertexArray(out.vao);
    out.a = this.attribute(this.lines, 'a', after, 3, 12);
    out.b = this.attribute(this.lines, 'b', before, 3, 12);
    out.k = this.attribute(this.lines, 'tone', out.tone, 2, 2);
    gl.bindVertexArray(null);
    return out;
  }
  changed(lines) {
    this.update(lines.a, lines.after);
    this.update(lines.b, lines.before);
    this.update(lines.k, lines.tone);
  }
  set(program, values) {
    const gl = this.gl;
    gl.useProgram(program.p);
    for (const k in values) {
      const v = values[k];
      const place = program.uniforms[k];
      if (place === undefined) continue;
      if (typeof v === 'number') gl.uniform1f(place, v);
      else if (v.length === 3) gl.uniform3fv(place, v);
      else gl.uniformMatrix4fv(place, false, v);
    }
  }
  draw(values, cloud, count, lines) {
    const gl = this.gl;
    gl.viewport(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (count > 0) {
      this.set(this.points, values);
      gl.bindVertexArray(cloud.vao);
      gl.drawElements(gl.POINTS, count, gl.UNSIGNED_INT, 0);
    }
    this.set(this.lines, values);
    gl.enable(gl.BLEND);
    gl.depthMask(false);
    for (const l of lines)
      if (l.visible && l.count > 0) {
        gl.bindVertexArray(l.vao);
        gl.drawArrays(l.kind, 0, l.count);
      }
    gl.depthMask(true);
    gl.disable(gl.BLEND);
    gl.bindVertexArray(null);
    gl.deleteSync(this.fence);
    this.fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
  }
  // Whether what was asked for last is drawn.
  done() {
    const gl = this.gl;
    return !this.fence || gl.isContextLost() || gl.getSyncParameter(this.fence, gl.SYNC_STATUS) === gl.SIGNALED;
  }
}

// Looks at a target from a distance; up is y.
class Orbit {
  constructor() {
    Object.assign(this, { target: [0, 0, 0], distance: 1, yaw: 0.34, pitch: 0.38, fov: 38, aspect: 1 });
    this.matrix = new Float32Array(16);
  }
  axes() {
    const [cy, sy, cp, sp] = [Math.cos(this.yaw), Math.sin(this.yaw), Math.cos(this.pitch), Math.sin(this.pitch)];
    return { right: [cy, 0, -sy], up: [-sp * sy, cp, -sp * cy], back: [cp * sy, sp, cp * cy] };
  }
  eye() {
    const { back } = this.axes();
    return this.target.map((v, k) => v + this.distance * back[k]);
  }
  update() {
    const { right, up, back } = this.axes();
    const eye = this.eye();
    const f = 1 / Math.tan((this.fov * Math.PI) / 360);
    const near = this.distance / 200;
    const far = this.distance * 40 + 20 * meta.radius;
    const rows = [right.map((v) => (v * f) / this.aspect), up.map((v) => v * f), back.map((v) => (v * (far + near)) / (near - far)), back.map((v) => -v)];
    const dot = (v) => v[0] * eye[0] + v[1] * eye[1] + v[2] * eye[2];
    const last = [-dot(rows[0]), -dot(rows[1]), -dot(rows[2]) + (2 * far * near) / (near - far), -dot(rows[3])];
    for (let r = 0; r < 4; r++) {
      for (let c = 0; c < 3; c++) this.matrix[4 * c + r] = rows[r][c];
      this.matrix[12 + r] = last[r];
    }
    return this.matrix;
  }
  move(right, up, back) {
    const a = this.axes();
    for (let k = 0; k < 3; k++) this.target[k] += right * a.right[k] + up * a.up[k] + back * a.back[k];
  }
  turn(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = Math.max(-1.55, Math.min(1.55, this.pitch + pitch));
  }
  // Where a place is seen, from -1 to 1, and how far away (the last; 0 and below: behind).
  project(p) {
    const m = this.matrix;
    const w = m[3] * p[0] + m[7] * p[1] + m[11] * p[2] + m[15];
    return [(m[0] * p[0] + m[4] * p[1] + m[8] * p[2] + m[12]) / w, (m[1] * p[0] + m[5] * p[1] + m[9] * p[2] + m[13]) / w, w];
  }
}
