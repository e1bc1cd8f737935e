// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// Keys, mouse and fingers; then the start: first the page, then the scene.
document.querySelectorAll('[name=x]').forEach((r) => r.addEventListener('change', () => {
  document.querySelectorAll('.by-step').forEach((e) => { e.hidden = r.value !== 'step' && !!e.nextElementSibling; });
  document.querySelectorAll('.by-time').forEach((e) => { e.hidden = r.value !== 'time'; });
}));
const MODES = { rgb: 0, err: 1, trk: 2, sig: 3 };
document.querySelectorAll('[name=col]').forEach((r) => r.addEventListener('change', () => {
  look.mode = MODES[r.value];
  legend();
  draw();
}));
document.addEventListener('click', (e) => {
  const b = e.target.closest('main [data-i]');
  if (!b || !D) return;
  openedFrom = b.closest('button');
  showImage(+b.dataset.i);
});
$('t').addEventListener('input', (e) => {
  cancelAnimationFrame(gliding);
  setT(e.target.value / 1000);
});
$('tb').onclick = () => glide(0);
$('ta').onclick = () => glide(1);
$('fit').onclick = () => cloud && fit();
$('paths').onchange = (e) => {
  if (!trails) return;
  trails.visible = e.target.checked;
  draw();
};
const big = (on) => {
  document.body.classList.toggle('big', on);
  $('full').textContent = on ? 'reduce' : 'enlarge';
};
$('full').onclick = () => big(!document.body.classList.contains('big'));
matchMedia('(prefers-color-scheme: dark)').addEventListener('change', theme);
addEventListener('keydown', (e) => {
  if (e.key !== 'Escape') return;
  if (!$('panel').hidden) close();
  else big(false);
});
addEventListener('beforeprint', () => {
  printing = true;
  theme();
  draw(true);
});
addEventListener('afterprint', () => {
  printing = false;
  theme();
});

// Left turns, right (or shift and left) shifts, the wheel comes closer; with Ctrl it sizes points.
function mouse() {
  const v = $('view'), c = $('gl'), down = new Map();
  let start = null, spread = 0;
  const xy = (e) => {
    const r = c.getBoundingClientRect();
    return [e.clientX - r.left, e.clientY - r.top];
  };
  const perPixel = () => (2 * orbit.distance * Math.tan((orbit.fov * Math.PI) / 360)) / v.clientHeight;
  v.addEventListener('focus', () => v.classList.add('on'));
  v.addEventListener('blur', () => v.classList.remove('on'));
  c.addEventListener('contextmenu', (e) => e.preventDefault());
  c.addEventListener('pointerdown', (e) => {
    down.set(e.pointerId, xy(e));
    start = down.size === 1 ? xy(e) : null;
    spread = 0;
    c.setPointerCapture(e.pointerId);
    v.focus({ preventScroll: true });
  });
  const up = (e) => {
    const at = xy(e);
    if (start && down.has(e.pointerId) && e.type === 'pointerup' && Math.hypot(at[0] - start[0], at[1] - start[1]) < 4) choose(at);
    down.delete(e.pointerId);
    start = null;
  };
  c.addEventListener('pointerup', up);
  c.addEventListener('pointercancel', up);
  c.addEventListener('pointermove', (e) => {
    if (!down.has(e.pointerId)) {
      const h = nearestImage(...xy(e));
      if (h !== hovered) {
        hovered = h;
        c.classList.toggle('pt', h >= 0);
        draw();
      }
      return;
    }
    const was = down.get(e.pointerId), at = xy(e), d = [at[0] - was[0], at[1] - was[1]];
    down.set(e.pointerId, at);
    if (down.size === 2) {
      const [a, b] = [...down.values()], apart = Math.hypot(a[0] - b[0], a[1] - b[1]);
      if (spread) orbit.distance *= spread / apart;
      spread = apart;
      orbit.move((-d[0] / 2) * perPixel(), (d[1] / 2) * perPixel(), 0);
    } else if (e.buttons & 2 || e.buttons & 4 || e.shiftKey) orbit.move(-d[0] * perPixel(), d[1] * perPixel(), 0);
    else orbit.turn((-d[0] * 4.4) / v.clientHeight, (d[1] * 4.4) / v.clientHeight);
    draw();
  });
  c.addEventListener('pointerleave', () => {
    hovered = -1;
    draw();
  });
  c.addEventListener('dblclick', fit);
  c.addEventListener('wheel', (e) => {
    if (document.activeElement !== v) return;
    e.preventDefault();
    const by = Math.exp(Math.max(-1, Math.min(1, e.deltaY * 0.0015)));
    if (e.ctrlKey) look.size = Math.max(0.5, Math.min(8, look.size / by));
    else {
      const [x, y] = xy(e);
      const shift = (1 - by) * perPixel();
      orbit.move((x - v.clientWidth / 2) * shift, (v.clientHeight / 2 - y) * shift, 0);
      orbit.distance *= by;
    }
    draw();
  }, { passive: false });
}
function choose([x, y]) {
  openedFrom = $('view');
  const i = nearestImage(x, y);
  if (i >= 0) return showImage(i);
  const p = nearestPoint(x, y);
  if (p >= 0) showPoint(p);
  else close();
}
function keys() {
  const v = $('view');
  const pick = (i) => document.querySelectorAll('[name=col]')[i]?.click();
  const next = (d) => {
    openedFrom = v;
    showImage((chosenImage + d + meta.images) % meta.images);
  };
  v.addEventListener('keydown', (e) => {
    if (e.ctrlKey || e.metaKey || e.altKey || e.target !== v) return;
    const step = orbit.distance * 0.05;
    const does = {
      ArrowLeft: () => orbit.turn(-0.08, 0), ArrowRight: () => orbit.turn(0.08, 0), ArrowUp: () => orbit.turn(0, 0.08), ArrowDown: () => orbit.turn(0, -0.08),
      '+': () => { orbit.distance *= 0.9; }, '=': () => { orbit.distance *= 0.9; }, '-': () => { orbit.distance *= 1.11; },
      w: () => orbit.move(0, 0, -step), s: () => orbit.move(0, 0, step), d: () => orbit.move(step, 0, 0), a: () => orbit.move(-step, 0, 0),
      e: () => orbit.move(0, step, 0), q: () => orbit.move(0, -step, 0),
      '[': () => glide(0), ']': () => glide(1), ' ': () => glide(T < 0.5 ? 1 : 0), f: fit, r: fit,
      n: () => next(1), p: () => next(-1), t: () => $('paths').click(),
      Enter: () => big(!document.body.classList.contains('big')), 1: () => pick(0), 2: () => pick(1), 3: () => pick(2), 4: () => pick(3),
    }[e.key];
    if (!does) return;
    e.preventDefault();
    does();
    draw();
  });
}

// For the project's tests and measurements.
async function spin(seconds) {
  const t0 = performance.now(), before = { ...drawn };
  for (let k = 0; performance.now() - t0 < seconds * 1000; k++) {
    orbit.turn(0.02, 0);
    T = meta.start ? 0.5 + 0.5 * Math.sin(k / 20) : 1;
    draw();
    await new Promise(requestAnimationFrame);
  }
  const frames = drawn.frames - before.frames, took = performance.now() - t0;
  setT(1);
  return { framesPerSecond: (frames / took) * 1000, points: (drawn.points - before.points) / Math.max(1, frames) };
}

async function begin() {
  performance.mark('start');
  D = await unpack();
  look.mode = MODES[document.querySelector('[name=col]:checked').value];
  try {
    renderer = new Renderer($('gl'));
    if (renderer.software) budget = 8000;
    buildCloud();
    buildLines();
    paintFrusta();
    theme();
    new ResizeObserver(resize).observe($('view'));
    resize();
    mouse();
    keys();
  } catch (e) {
    renderer = cloud = null;
    $('hint').textContent = 'This browser shows no WebGL here; the rest of the report does without.';
  }
  window.sheaf = { spin, drawn, showImage, showPoint, setT, close, meta };
  performance.mark('ready');
  document.documentElement.dataset.ready = '1';
}
const painted = new Promise((ok) => {
  try {
    new PerformanceObserver((list, o) => { o.disconnect(); ok(); }).observe({ type: 'paint', buffered: true });
  } catch (e) {
    ok();
  }
  setTimeout(ok, 1500);
});
painted.then(() => setTimeout(begin));
