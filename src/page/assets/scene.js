// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// The scene: what is drawn, in which colours, from where; and what lies under the pointer.
let D, renderer, cloud, frusta, trails, rays, face, marks, rigs;
let T = 1; // 0: before, 1: after
let chosenImage = -1, chosenPoint = -1, hovered = -1;
const orbit = new Orbit();
const look = { mode: 1, size: 2, dim: 0, far: 1, weak: 0 };
const EDGES = [0, 1, 0, 2, 0, 3, 0, 4, 1, 2, 2, 3, 3, 4, 4, 1];
const gcd = (a, b) => (b ? gcd(b, a % b) : a);
let printing = false;
const rgb = (hex) => [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255);

function theme() {
  const dark = matchMedia('(prefers-color-scheme: dark)').matches && !printing;
  const ramp = dark ? ['#3d4349', '#868d95', '#ff8748', '#ffe9cf'] : ['#d6d9dc', '#91979d', '#d6540f', '#7a2000'];
  const track = dark ? ['#2e3236', '#f2f2ee'] : ['#d4d7da', '#101214'];
  ramp.forEach((hex, i) => { look['r' + i] = rgb(hex); });
  look.k0 = rgb(track[0]);
  look.k1 = rgb(track[1]);
  look.ink = rgb(dark ? '#e8e8e4' : '#17191c');
  look.grey = rgb(dark ? '#4a4f55' : '#c2c6ca');
  look.at = rgb(dark ? '#ff8748' : '#c8420a');
  look.ramp = ramp;
  look.track = track;
  legend();
  draw();
}

function legend() {
  const mode = document.querySelector('[name=col]:checked').value;
  const r = $('ramp');
  r.hidden = mode === 'rgb' || !look.ramp;
  if (r.hidden) return;
  const [low, bar, high, note] = r.children;
  const c = look.ramp;
  bar.style.background = mode === 'trk' ? `linear-gradient(90deg,${look.track.join(',')})` : `linear-gradient(90deg,${c[0]},${c[1]} 37.5%,${c[2]} 45%,${c[3]})`;
  if (mode === 'err') {
    low.textContent = px(meta.sigma / 2);
    high.textContent = px(meta.sigma * 128);
    note.textContent = 'accent from 4\u03c3, ' + px(4 * meta.sigma);
  } else if (mode === 'trk') {
    low.textContent = 'seen twice';
    high.textContent = look.longest + '\u00d7';
    note.textContent = '';
  } else {
    const typical = meta.known / 0.05;
    low.textContent = num(typical / 2);
    high.textContent = num(typical * 128);
    note.textContent = '\u03c3 of a point, scene units; accent from 8 times the median';
  }
}

// From codes to places on a ramp whose 37.5 % are four times what is usual.
function rampCodes(codes, shift) {
  const out = new Uint8Array(256);
  for (let v = 0; v < 255; v++) {
    const times = 0.05 * Math.exp((v / 254) * Math.log(meta.span));
    out[v] = Math.max(0, Math.min(255, Math.round((Math.log((times / shift) * 2) / Math.log(256)) * 255)));
  }
  out[255] = 255;
  return codes ? codes.map((v) => out[v]) : null;
}

function buildCloud() {
  const m = meta.points;
  const after = new Uint16Array(4 * m), before = new Uint16Array(4 * m);
  for (let i = 0; i < m; i++)
    for (let j = 0; j < 3; j++) {
      after[4 * i + j] = D.pa[j * m + i];
      before[4 * i + j] = D.pb[j * m + i];
    }
  const sorted = Uint8Array.from(D.tr).sort();
  look.longest = Math.max(3, sorted[Math.floor(sorted.length * 0.99)] || 3);
  const ea = rampCodes(D.ea, 1), eb = rampCodes(D.eb, 1) || ea, sg = rampCodes(D.sg, 2);
  const colours = new Uint8Array(4 * m), value = new Uint8Array(4 * m);
  for (let i = 0; i < m; i++) {
    if (D.rgb) for (let j = 0; j < 3; j++) colours[4 * i + j] = D.rgb[j * m + i];
    value[4 * i] = ea[i];
    value[4 * i + 1] = eb[i];
    value[4 * i + 2] = Math.max(0, Math.min(255, Math.round((Math.log(Math.max(1, D.tr[i]) / 2) / Math.log(look.longest / 2)) * 255)));
    value[4 * i + 3] = sg ? sg[i] : 0;
  }
  // In an order of which any beginning is a fair sample, what is off first: while the scene moves,
  // as many are drawn as the machine bears.
  const off = [], rest = [];
  let stride = Math.max(1, Math.round(m * 0.61803));
  while (m > 1 && gcd(stride, m) > 1) stride++;
  for (let i = 0, k = 0; i < m; i++, k = (k + stride) % m) (ea[k] > 96 && D.ea[k] < 255 && off.length < 5000 ? off : rest).push(k);
  cloud = renderer.cloud(after, before, colours, value, Uint32Array.from(off.concat(rest)));
}

const placeOf = (codes, i) => [0, 1, 2].map((j) => meta.centre[j] + ((codes[j * meta.points + i] / 65535) * 2 - 1) * meta.reach);
const pointAt = (i) => {
  const a = placeOf(D.pa, i), b = placeOf(D.pb, i);
  return a.map((v, j) => b[j] * (1 - T) + v * T);
};
const cornerAt = (i, c) => [0, 1, 2].map((j) => D.fb[i * 15 + c * 3 + j] * (1 - T) + D.fa[i * 15 + c * 3 + j] * T);

function buildLines() {
  const n = meta.images, m = meta.points;
  const corners = (list) => {
    const out = new Float32Array(n * 48);
    for (let i = 0; i < n; i++) EDGES.forEach((e, k) => { for (let j = 0; j < 3; j++) out[(i * 16 + k) * 3 + j] = list[i * 15 + e * 3 + j]; });
    return out;
  };
  frusta = renderer.segments(corners(D.fa), corners(D.fb));
  // Where the farthest moved points came from, and a sample of the others; and the images.
  const far = new Float32Array(m);
  for (let i = 0; i < m; i++) far[i] = [0, 1, 2].reduce((s, j) => s + (D.pa[j * m + i] - D.pb[j * m + i]) ** 2, 0);
  const order = Array.from(far.keys()).sort((a, b) => far[b] - far[a]);
  const some = m <= 6000 ? order : order.slice(0, 2000).concat(order.slice(2000).filter((_, k) => k % Math.ceil((m - 2000) / 4000) === 0));
  const ta = [], tb = [];
  for (const p of some) {
    const a = placeOf(D.pa, p), b = placeOf(D.pb, p);
    ta.push(...b, ...a);
    tb.push(...b, ...b);
  }
  for (let i = 0; i < n; i++) {
    const a = D.fa.subarray(i * 15, i * 15 + 3), b = D.fb.subarray(i * 15, i * 15 + 3);
    ta.push(...b, ...a);
    tb.push(...b, ...b);
  }
  trails = renderer.segments(new Float32Array(ta), new Float32Array(tb));
  for (let i = 0; i < trails.count; i++) trails.tone.set([76, i % 2 ? 140 : 20], 2 * i);
  trails.visible = false;
  renderer.changed(trails);
  rays = renderer.segments(new Float32Array(3 * 512), new Float32Array(3 * 512));
  rays.visible = false;
  face = renderer.segments(new Float32Array(18), new Float32Array(18), true);
  face.visible = false;
  for (let i = 0; i < 6; i++) face.tone.set([255, 40], 2 * i);
  buildRigs();
  buildMarks();
}

// Images of one frame of a rig hang together.
function buildRigs() {
  const a = [], b = [];
  for (const [i, j] of meta.rigs || []) {
    a.push(...D.fa.subarray(i * 15, i * 15 + 3), ...D.fa.subarray(j * 15, j * 15 + 3));
    b.push(...D.fb.subarray(i * 15, i * 15 + 3), ...D.fb.subarray(j * 15, j * 15 + 3));
  }
  rigs = renderer.segments(new Float32Array(a), new Float32Array(b));
  for (let i = 0; i < rigs.count; i++) rigs.tone.set([110, 220], 2 * i);
  renderer.changed(rigs);
}

// Control points as crosses, check points as tetrahedra; those that are off in the accent.
function buildMarks() {
  const lines = [], tones = [];
  const s = meta.radius * 0.02;
  for (const [x, y, z, kind, off] of meta.marks || []) {
    const tip = kind === 'control' ? [[-s, 0, 0, s, 0, 0], [0, -s, 0, 0, s, 0], [0, 0, -s, 0, 0, s]]
      : [[-s, -s, 0, s, -s, 0], [s, -s, 0, 0, s, 0], [0, s, 0, -s, -s, 0]];
    for (const l of tip) {
      lines.push(x + l[0], y + l[1], z + l[2], x + l[3], y + l[4], z + l[5]);
      tones.push(off ? 255 : 127, 255, off ? 255 : 127, 255);
    }
  }
  marks = renderer.segments(new Float32Array(lines), new Float32Array(lines));
  marks.tone.set(tones);
  renderer.changed(marks);
}

// ---- drawing
let wanted = false, pending = false, budget = 40000, still = 0;
const drawn = { frames: 0, points: 0 };
function render(count) {
  orbit.update();
  const dpr = Math.min(2, devicePixelRatio || 1);
  renderer.draw({ ...look, size: look.size * dpr, matrix: orbit.matrix, centre: meta.centre, reach: meta.reach, t: T }, cloud, Math.min(count, cloud.count), [rigs, frusta, marks, trails, rays, face]);
  label();
}
// true: at once, and all of it.
function draw(now) {
  if (!renderer || !cloud) return;
  if (now === true) return render(Infinity);
  if (wanted) return;
  wanted = true;
  if (!pending) requestAnimationFrame(frame);
}
// The next frame waits until this one is there: how long that takes says how many points the machine
// bears. Only so does a software renderer, which works behind the page's back, not fall behind.
function frame() {
  const t0 = performance.now(), count = Math.round(Math.min(budget, meta.points));
  wanted = false;
  pending = true;
  render(count);
  const look = () => {
    if (!renderer.done()) return requestAnimationFrame(look);
    const dt = Math.max(1, performance.now() - t0);
    budget = Math.max(3000, Math.min(meta.points, budget * Math.max(0.3, Math.min(1.25, 38 / dt))));
    drawn.frames++;
    drawn.points += count;
    pending = false;
    if (wanted) return frame();
    clearTimeout(still);
    if (count < meta.points) still = setTimeout(() => draw(true), 180);
  };
  requestAnimationFrame(look);
}
const toScreen = (p) => {
  const v = $('view'), [x, y, w] = orbit.project(p);
  return [((x + 1) / 2) * v.clientWidth, ((1 - y) / 2) * v.clientHeight, w];
};
function label() {
  const over = $('over');
  over.textContent = '';
  const put = (p, dx, dy, text) => {
    const [x, y, w] = toScreen(p);
    if (w <= 0) return;
    const e = svgEl('text', { x: x + dx, y: y + dy });
    e.textContent = text;
    over.append(e);
  };
  (meta.marks || []).slice(0, 40).forEach((m) => put(m, 8, -6, m[5]));
  if (chosenImage >= 0) put(cornerAt(chosenImage, 0), 10, -14, meta.names[chosenImage]);
  if (hovered >= 0 && hovered !== chosenImage) put(cornerAt(hovered, 0), 8, -8, `${meta.names[hovered]}, ${px(meta.rmsAfter[hovered])}`);
}

function resize() {
  const v = $('view'), w = v.clientWidth, h = v.clientHeight;
  if (!w || !h) return;
  const dpr = Math.min(2, devicePixelRatio || 1), c = $('gl');
  c.width = Math.round(w * dpr);
  c.height = Math.round(h * dpr);
  orbit.aspect = w / h;
  if (!resize.done || resize.portrait !== w < h) {
    fit();
    resize.done = true;
    resize.portrait = w < h;
  }
  draw(true);
}

// Frames the middle 96 % of the points and all images, as seen from slightly above and beside.
function fit() {
  const [lo, hi] = [meta.core.slice(0, 3), meta.core.slice(3)];
  orbit.target = lo.map((v, k) => (v + hi[k]) / 2);
  orbit.yaw = 0.3456;
  orbit.pitch = 0.3763;
  const mid = orbit.target.slice(), step = Math.max(1, Math.floor(meta.points / 4000)), P = [], K = [];
  for (let i = 0; i < meta.points; i += step) {
    const p = placeOf(D.pa, i);
    if (Math.hypot(...p.map((v, k) => v - mid[k])) < 1.6 * meta.radius) P.push(p);
  }
  for (let i = 0; i < meta.images; i++) K.push(Array.from(D.fa.subarray(i * 15, i * 15 + 3)));
  const tv = Math.tan((orbit.fov * Math.PI) / 360), th = tv * orbit.aspect;
  orbit.distance = 2.6 * meta.radius;
  for (let round = 0; round < 10; round++) {
    orbit.update();
    const ends = (axis) => {
      const seen = (list) => list.map((p) => orbit.project(p)).filter((v) => v[2] > orbit.distance * 0.05).map((v) => v[axis]);
      const a = seen(P).sort((x, y) => x - y), k = seen(K);
      const all = a.length ? [a[Math.floor(a.length * 0.02)], a[Math.floor(a.length * 0.98)]].concat(k) : k;
      return all.length ? [Math.min(...all), Math.max(...all)] : [-1, 1];
    };
    const [l, r] = ends(0), [b, t] = ends(1);
    orbit.move(((l + r) / 2) * orbit.distance * th, ((b + t) / 2) * orbit.distance * tv, 0);
    orbit.distance *= Math.max((r - l) / 2 / 0.86, (t - b) / 2 / 0.76, 1e-3);
  }
  look.far = orbit.distance;
  look.size = Math.max(1.2, Math.min(2.6, 2.6 - 0.5 * Math.log10(Math.max(1, meta.points) / 3000))) * Math.max(0.6, Math.min(1, $('view').clientWidth / 800));
  draw();
}

// ---- between the two states
let gliding = 0;
function setT(v) {
  T = v;
  $('t').value = Math.round(v * 1000);
  draw();
}
function glide(to) {
  if (!meta.start) return;
  cancelAnimationFrame(gliding);
  if (matchMedia('(prefers-reduced-motion: reduce)').matches) return setT(to);
  const from = T, t0 = performance.now();
  const step = (t) => {
    const u = Math.min(1, (t - t0) / 650);
    setT(from + (to - from) * u * u * (3 - 2 * u));
    if (u < 1) gliding = requestAnimationFrame(step);
  };
  gliding = requestAnimationFrame(step);
}

// ---- what is chosen
function paintFrusta() {
  const quiet = chosenImage >= 0 || chosenPoint >= 0;
  for (let i = 0; i < meta.images; i++)
    for (let j = 0; j < 16; j++) frusta.tone.set(i === chosenImage ? [255, 255] : [127, quiet ? 76 : j < 8 ? 128 : 216], 2 * (i * 16 + j));
  renderer.changed(frusta);
  face.visible = chosenImage >= 0;
  if (!face.visible) return;
  for (const [to, from] of [[face.after, D.fa], [face.before, D.fb]])
    [1, 2, 3, 1, 3, 4].forEach((c, k) => to.set(from.subarray(chosenImage * 15 + c * 3, chosenImage * 15 + c * 3 + 3), 3 * k));
  renderer.changed(face);
}
function mark() {
  const s = cloud.chosen.fill(0);
  rays.visible = false;
  look.dim = chosenImage >= 0 || chosenPoint >= 0 ? 1 : 0;
  if (chosenImage >= 0) for (let k = meta.first[chosenImage]; k < meta.first[chosenImage + 1]; k++) s[D.op[k]] = 1;
  if (chosenPoint >= 0) {
    s[chosenPoint] = 2;
    const a = placeOf(D.pa, chosenPoint), b = placeOf(D.pb, chosenPoint);
    let q = 0;
    for (let i = 0; i < meta.images && q < 510; i++)
      for (let k = meta.first[i]; k < meta.first[i + 1]; k++)
        if (D.op[k] === chosenPoint && q < 510) {
          rays.after.set(a, 3 * q);
          rays.before.set(b, 3 * q);
          rays.after.set(D.fa.subarray(i * 15, i * 15 + 3), 3 * q + 3);
          rays.before.set(D.fb.subarray(i * 15, i * 15 + 3), 3 * q + 3);
          rays.tone.set([255, 200, 255, 200], 2 * q);
          q += 2;
        }
    rays.count = q;
    renderer.changed(rays);
    rays.visible = true;
  }
  renderer.update(cloud.buffer, s);
  paintFrusta();
  draw();
}
function nearestImage(x, y) {
  let best = -1, least = 26 * 26;
  for (let i = 0; i < meta.images; i++) {
    const c = [0, 1, 2, 3, 4].map((k) => toScreen(cornerAt(i, k)));
    if (c[0][2] <= 0) continue;
    const mx = c.reduce((s, p) => s + p[0] / 5, 0), my = c.reduce((s, p) => s + p[1] / 5, 0);
    const d = Math.min((mx - x) ** 2 + (my - y) ** 2, (c[0][0] - x) ** 2 + (c[0][1] - y) ** 2);
    if (d < least) {
      least = d;
      best = i;
    }
  }
  return best;
}
function nearestPoint(x, y) {
  const v = $('view'), nx = (x / v.clientWidth) * 2 - 1, ny = 1 - (y / v.clientHeight) * 2;
  const rx = 10 / v.clientWidth, ry = 10 / v.clientHeight;
  let best = -1, front = Infinity;
  for (let i = 0; i < meta.points; i++) {
    const p = orbit.project(pointAt(i));
    if (p[2] > 0 && p[2] < front && Math.abs(p[0] - nx) < rx && Math.abs(p[1] - ny) < ry) {
      front = p[2];
      best = i;
    }
  }
  return best;
}
