// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// What every other part uses: elements, numbers as the page writes them, and the packed data.
const $ = (id) => document.getElementById(id);
const meta = JSON.parse($('meta').textContent);
const el = (tag, cls, text) => {
  const e = document.createElement(tag);
  if (cls) e.className = cls;
  if (text != null) e.textContent = text;
  return e;
};
const svgEl = (tag, attributes) => {
  const e = document.createElementNS('http://www.w3.org/2000/svg', tag);
  for (const k in attributes) e.setAttribute(k, attributes[k]);
  return e;
};
const THIN = '\u202f';
const group = (n) => {
  const s = String(Math.round(n));
  return s.length > 4 ? s.replace(/\B(?=(\d{3})+$)/g, THIN) : s;
};
const num = (x, digits = 3) => {
  if (!isFinite(x)) return '\u2013';
  if (x === 0) return '0';
  const e = Math.floor(Math.log10(Math.abs(x)));
  if (e < -4 || e > 6) return x.toExponential(digits - 1).replace('-', '\u2212');
  const [a, b] = Math.abs(x).toFixed(Math.max(0, digits - 1 - e)).split('.');
  return (x < 0 ? '\u2212' : '') + group(+a) + (b ? '.' + b : '');
};
const px = (x) => num(x) + THIN + 'px';
const fixed = (x) => (isFinite(x) ? x.toFixed(2).replace('-', '\u2212') : '\u2013');

// The block of numbers: base64, deflate, each byte of a number in a plane of its own.
async function unpack() {
  const text = atob($('data').textContent);
  const small = new Uint8Array(text.length);
  for (let i = 0; i < text.length; i++) small[i] = text.charCodeAt(i);
  const stream = new Blob([small]).stream().pipeThrough(new DecompressionStream('deflate'));
  const raw = new Uint8Array(await new Response(stream).arrayBuffer());
  const types = { u8: Uint8Array, u16: Uint16Array, i16: Int16Array, u32: Uint32Array, f32: Float32Array };
  const out = {};
  let at = 0;
  for (const [name, type, n] of meta.index) {
    const width = types[type].BYTES_PER_ELEMENT;
    const bytes = new Uint8Array(n * width);
    for (let p = 0; p < width; p++)
      for (let i = 0; i < n; i++) bytes[i * width + p] = raw[at + p * n + i];
    at += n * width;
    out[name] = new types[type](bytes.buffer);
  }
  if (out.pb) for (let i = 0; i < out.pb.length; i++) out.pb[i] += out.pa[i];
  else out.pb = out.pa;
  out.fb = out.fb || out.fa;
  const sum = (a, from, to) => {
    for (let k = from + 1; k < to; k++) a[k] += a[k - 1];
  };
  for (let i = 0; i < meta.images; i++) sum(out.op, meta.first[i], meta.first[i + 1]);
  if (out.of) sum(out.of, 0, out.of.length);
  return out;
}

// A residual of an observation, px; NaN where the state has none.
const residual = (list, k) => {
  const n = list.length / 2;
  const x = list[k];
  return x === -32768 ? [NaN, NaN] : [x / 100, list[n + k] / 100];
};
const length = (v) => Math.hypot(v[0], v[1]);
// What a coded error or sigma stands for; NaN where there is none.
const decoded = (code, least) => (code === 255 ? NaN : least * Math.exp((code / 254) * Math.log(meta.span)));
