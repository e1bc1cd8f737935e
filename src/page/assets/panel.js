// Copyright (c) 2026, the Sheaf authors.
// SPDX-License-Identifier: BSD-3-Clause

// The panel: an image with its residuals and neighbours, or a point with its observations.
let openedFrom = null;
function close() {
  chosenImage = chosenPoint = -1;
  $('panel').hidden = true;
  if (cloud) mark();
  if (openedFrom) {
    openedFrom.focus({ preventScroll: true });
    openedFrom = null;
  }
}
function shell(title, stepper) {
  const p = $('panel');
  p.textContent = '';
  p.hidden = false;
  const h = el('header');
  h.append(el('h2', '', title));
  if (stepper) {
    const s = el('span', 'steps');
    for (const [text, d] of [['previous', -1], ['next', 1]]) {
      const b = el('button', '', text);
      b.onclick = () => showImage((chosenImage + d + meta.images) % meta.images);
      s.append(b);
    }
    h.append(s);
  }
  const x = el('button', 'x', 'close');
  x.onclick = close;
  h.append(x);
  p.append(h);
  p.scrollTop = 0;
  return p;
}
function fact(list, name, value, below) {
  const d = el('div'), e = el('dd', '', value);
  if (below) e.append(el('small', '', below));
  d.append(el('dt', '', name), e);
  list.append(d);
}

// Residual vectors of an image on its picture; paths of the start, of the result, of what is off.
function vectors(i) {
  const [hw, hh] = meta.half[i], k = 1000 / (2 * hw), n = D.ra.length / 2, out = { before: '', usual: '', off: '', beyond: 0, lengths: [] };
  for (let q = meta.first[i]; q < meta.first[i + 1]; q++) {
    const x = ((D.ou[q] / 32767) * hw + hw) * k, y = ((D.ou[n + q] / 32767) * hh + hh) * k;
    const path = (r) => {
      const by = meta.enlarged * k * Math.min(1, 250 / (length(r) * meta.enlarged * k || 1));
      return isFinite(by * r[0]) ? `M${x.toFixed(0)} ${y.toFixed(0)}l${(r[0] * by).toFixed(0)} ${(r[1] * by).toFixed(0)}` : '';
    };
    const r = residual(D.ra, q), size = length(r);
    if (isFinite(size)) out.lengths.push(size);
    if (size > 4 * meta.sigma) {
      out.off += path(r);
      out.beyond++;
    } else out.usual += path(r);
    if (D.rb) out.before += path(residual(D.rb, q));
  }
  out.lengths.sort((a, b) => a - b);
  return out;
}
function picture(p, i, v) {
  const [hw, hh] = meta.half[i], H = (1000 * hh) / hw, box = el('div', 'pp');
  const thumb = document.querySelector(`.pic img[data-i="${i}"]`);
  if (thumb) {
    const im = el('img');
    im.alt = '';
    im.src = thumb.src;
    box.append(im);
  }
  const s = svgEl('svg', { viewBox: `0 0 1000 ${H.toFixed(0)}`, role: 'img', 'aria-label': 'Residual vectors of ' + meta.names[i] });
  s.append(svgEl('rect', { x: 1, y: 1, width: 998, height: H - 2, class: 'fr' }));
  const before = svgEl('path', { d: v.before, class: 'vb' });
  const after = [svgEl('path', { d: v.usual, class: 'w1' }), svgEl('path', { d: v.off, class: 'w2' })];
  before.style.display = 'none';
  s.append(before, ...after);
  box.append(s);
  const line = el('div', 'pl');
  line.append(el('span', '', `vectors ${num(meta.enlarged, 2)} times enlarged`));
  if (D.rb) {
    const toggle = el('button', '', 'show before');
    toggle.onclick = () => {
      const on = before.style.display === 'none';
      before.style.display = on ? '' : 'none';
      after.forEach((e) => { e.style.display = on ? 'none' : ''; });
      toggle.textContent = on ? 'show after' : 'show before';
    };
    line.append(toggle);
  }
  p.append(box, line);
}
function showImage(i) {
  chosenImage = i;
  chosenPoint = -1;
  if (cloud) mark();
  const p = shell(meta.names[i], true), v = vectors(i), kept = meta.first[i + 1] - meta.first[i];
  picture(p, i, v);
  const list = el('dl', 'pf');
  fact(list, 'rms', px(meta.rmsAfter[i] ?? NaN), D.rb ? 'was ' + px(meta.rmsBefore[i] ?? NaN) : '');
  fact(list, 'observations', group(meta.seen[i]), kept < meta.seen[i] ? group(kept) + ' shown' : '');
  fact(list, 'beyond 4\u03c3', group(v.beyond), v.lengths.length ? 'largest ' + px(v.lengths[v.lengths.length - 1]) : '');
  p.append(list);
  const links = meta.links[i];
  if (!links.length) return;
  p.append(el('h3', '', 'Images with most points in common'));
  const box = el('div', 'nb');
  for (const [j, c] of links) {
    const row = el('button'), bar = el('i');
    bar.style.width = (100 * c) / links[0][1] + '%';
    row.append(el('span', '', meta.names[j]), bar, el('span', '', group(c)));
    row.onclick = () => showImage(j);
    box.append(row);
  }
  p.append(box);
}
function observationTable(rows) {
  const t = el('table', 'num'), head = el('tr'), th = el('thead'), body = el('tbody');
  const titles = D.rb ? ['image', 'before, px', 'after, px', 'x', 'y'] : ['image', 'px', 'x', 'y'];
  titles.forEach((h) => head.append(el('th', '', h)));
  th.append(head);
  for (const r of rows) {
    const tr = el('tr'), h = el('th'), b = el('button', '', meta.names[r.image]);
    b.onclick = () => showImage(r.image);
    h.append(b);
    tr.append(h);
    if (D.rb) tr.append(el('td', 'bfc', fixed(r.before)));
    tr.append(el('td', '', fixed(r.after)), el('td', '', fixed(r.xy[0])), el('td', '', fixed(r.xy[1])));
    body.append(tr);
  }
  t.append(th, body);
  return t;
}
function showPoint(i) {
  chosenPoint = i;
  chosenImage = -1;
  mark();
  const p = shell('Point ' + group(D.of ? D.of[i] : i)), rows = [];
  for (let c = 0; c < meta.images; c++)
    for (let k = meta.first[c]; k < meta.first[c + 1]; k++)
      if (D.op[k] === i) {
        const xy = residual(D.ra, k);
        rows.push({ image: c, xy, after: length(xy), before: D.rb ? length(residual(D.rb, k)) : NaN });
      }
  const list = el('dl', 'pf');
  fact(list, 'seen by', group(D.tr[i]) + ' images', rows.length < D.tr[i] ? rows.length + ' kept here' : '');
  fact(list, 'rms', px(decoded(D.ea[i], meta.least)), D.eb ? 'was ' + px(decoded(D.eb[i], meta.least)) : '');
  if (meta.start) fact(list, 'moved', num((100 * Math.hypot(...placeOf(D.pa, i).map((v, j) => v - placeOf(D.pb, i)[j]))) / meta.radius, 2) + THIN + '%', 'of the scene\u2019s radius');
  if (D.sg) fact(list, '\u03c3', num(decoded(D.sg[i], meta.known), 2), 'scene units');
  p.append(list);
  rows.sort((a, b) => b.after - a.after);
  p.append(observationTable(rows));
}
