# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""What a page looks like in a few numbers, held against looks.json: what each section has, how long
the page is, and how light each part of the first screen. No picture is kept: fonts differ from
machine to machine, and numbers say what has changed."""
import base64
import json
import os
import time

STORED = os.path.join(os.path.dirname(os.path.abspath(__file__)), "looks.json")
SIZES = {"desk": (1280, 800), "phone": (390, 844)}
LONGER, LIGHTER = 0.15, 20  # as a share; of 255

PARTS = """Object.fromEntries([...document.querySelectorAll('section')].map((s) => [s.id,
['figure', 'table', 'svg', 'button'].map((t) => s.querySelectorAll(t).length)]))"""
WIDER = "document.documentElement.scrollWidth > innerWidth"
# Names of what sticks out of the page and is in no box that scrolls by itself.
STICKS_OUT = """[...document.querySelectorAll('main *')].filter((e) => {
const r = e.getBoundingClientRect();
return r.width > 0 && r.right > innerWidth + 1 && !e.closest('.scroll, svg, .strip, [style*=overflow]'); })
.slice(0, 3).map((e) => e.tagName + '.' + e.className)"""
LIGHT = """new Promise((ok) => { const i = new Image(); i.onload = () => {
const c = document.createElement('canvas'); c.width = 8; c.height = 5;
const g = c.getContext('2d'); g.imageSmoothingQuality = 'high'; g.drawImage(i, 0, 0, 8, 5);
const d = g.getImageData(0, 0, 8, 5).data, out = [];
for (let k = 0; k < d.length; k += 4) out.push(Math.round((d[k] + d[k + 1] + d[k + 2]) / 3));
ok(out); }; i.src = 'data:image/png;base64,%s'; })"""


def described(page, path):
    """The page at each size: parts, height in px, lightness of 8 x 5 parts of the first screen."""
    out, troubles = {}, []
    for name, (width, height) in SIZES.items():
        page.size(width, height, touch=name == "phone")
        page.open(path)
        time.sleep(0.8)
        if page.run(WIDER):
            troubles.append(f"{name}: wider than the screen")
        sticking = page.run(STICKS_OUT)
        if sticking:
            troubles.append(f"{name}: sticks out: {', '.join(sticking)}")
        out[name] = {"parts": page.run(PARTS),
                     "height": page.run("document.documentElement.scrollHeight"),
                     "light": page.run(LIGHT % base64.b64encode(page.screenshot()).decode())}
    page.size(*SIZES["desk"])
    return out, troubles


def differences(found, stored):
    """Sentences that say in what a page is not as it was stored; none where it is."""
    out = []
    for size, want in stored.items():
        have = found[size]
        for part in sorted(set(want["parts"]) | set(have["parts"])):
            if want["parts"].get(part) != have["parts"].get(part):
                out.append(f"{size}, {part}: figures, tables, drawings, buttons are "
                           f"{have['parts'].get(part)}, were {want['parts'].get(part)}")
        if abs(have["height"] - want["height"]) > LONGER * want["height"]:
            out.append(f"{size}: {have['height']} px long, was {want['height']}")
        off = max(abs(a - b) for a, b in zip(have["light"], want["light"]))
        if off > LIGHTER:
            out.append(f"{size}: a part of the first screen is lighter or darker by {off}")
    return out


def lines_of(stored):
    """JSON with a line for each size of a page."""
    pages = [json.dumps(name) + ": {\n" + ",\n".join(
        f"  {json.dumps(size)}: {json.dumps(of)}" for size, of in sizes.items()) + "\n}"
        for name, sizes in stored.items()]
    return "{" + ",\n".join(pages) + "}\n"


def check(page, paths, say, write=False):
    """paths: pages by their names in looks.json; write: store what they look like instead."""
    stored = {}
    if not write:
        with open(STORED) as file:
            stored = json.load(file)
    for name, path in paths.items():
        found, troubles = described(page, path)
        say(f"{name} fits a desk and a phone " + "; ".join(troubles), not troubles)
        if write:
            stored[name] = found
        else:
            wrong = differences(found, stored[name])
            say(f"{name} looks as it did " + "; ".join(wrong), not wrong)
    if write:
        with open(STORED, "w") as file:
            file.write(lines_of(stored))
