#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""Reports as a reader has them: in a browser, from disk, by mouse, by keys and on paper.

    report_test.py SHEAF [AXE] [--write]

AXE: axe.min.js of axe-core, for the rules of accessibility; without it they are named as not run.
--write: store what pages look like (looks.json) after a change that is wanted.
Ends with 77, which ctest takes for skipped, where there is no Chromium.
"""

import json
import os
import struct
import subprocess
import sys
import tempfile
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import browser  # noqa: E402
import looks  # noqa: E402

PIXELS = """(() => { const c = document.getElementById('gl'), g = c.getContext('webgl2');
const a = new Uint8Array(c.width * c.height * 4);
g.readPixels(0, 0, c.width, c.height, g.RGBA, g.UNSIGNED_BYTE, a);
let n = 0, s = 0; for (let i = 0; i < a.length; i += 4) { if (a[i + 3]) n++; s = (s * 31 + a[i] + a[i + 3]) | 0; }
return [n, s]; })()"""
PANEL = "(document.getElementById('panel').hidden ? '' : document.querySelector('#panel h2').textContent)"
HOSTILE = "<script>window.hacked=1</script>\"'&\t\x1b[31m.jpg"

failed = 0


def say(what, good):
    global failed
    failed += not good
    print(("ok    " if good else "WRONG ") + what, flush=True)


def command(*words):
    subprocess.run(words, check=True, stdout=subprocess.DEVNULL)


def make_reports(sheaf, folder):
    """One of a BAL scene that was solved, one of a COLMAP model whose names are hostile."""
    at = lambda name: os.path.join(folder, name)  # noqa: E731
    command(sheaf, "generate", at("in.txt"), "--points", "3000", "--quiet")
    command(sheaf, "solve", at("in.txt"), "-o", at("out.txt"), "--report", at("bal.html"), "--quiet")
    command(sheaf, "generate", at("model"), "--camera", "OPENCV", "--points", "300", "--quiet")
    command(sheaf, "convert", at("model"), at("text"), "--format", "colmap-text", "--quiet")
    path = os.path.join(folder, "text", "images.txt")
    with open(path) as file:
        lines = file.read().split("\n")
    names = 0
    for i, line in enumerate(lines):
        words = line.split(" ", 9)
        if not line.startswith("#") and len(words) == 10 and "." in words[9] and not words[9][0].isdigit():
            lines[i] = " ".join(words[:9]) + f" {names}{HOSTILE}"
            names += 1
    with open(path, "w") as file:
        file.write("\n".join(lines))
    command(sheaf, "report", at("text"), "-o", at("hostile.html"), "--title", HOSTILE, "--quiet")
    return at("bal.html"), at("hostile.html"), names


def survey_of(folder):
    """Every hundredth point of a text model as a control point with its marks, each fourth of them a
    check point."""
    names, pixels = {}, {}
    with open(os.path.join(folder, "images.txt")) as file:
        lines = [line.split() for line in file if not line.startswith("#")]
    for head, features in zip(lines[::2], lines[1::2]):
        names[head[0]] = head[9]
        pixels[head[0]] = [(float(x), float(y)) for x, y in zip(features[::3], features[1::3])]
    points = []
    with open(os.path.join(folder, "points3D.txt")) as file:
        for line in [line.split() for line in file if not line.startswith("#")][::100]:
            marks = [{"image": names[i], "pixel": pixels[i][int(k)]} for i, k in zip(line[8::2], line[9::2])]
            points.append({"id": "P" + line[0], "role": "check" if len(points) % 4 == 3 else "control",
                           "xyz": [float(x) for x in line[1:4]], "sigma": 0.02, "marks": marks})
    return {"frame": {"kind": "local"}, "points": points}


def make_others(sheaf, folder):
    """One of a rig with control points, one of a refinement by pixels."""
    at = lambda name: os.path.join(folder, name)  # noqa: E731
    command(sheaf, "generate", at("rig"), "--rigs", "stereo", "--frames", "12", "--points", "900",
            "--truth", at("rig-truth"), "--quiet")
    command(sheaf, "convert", at("rig-truth"), at("rig-text"), "--format", "colmap-text", "--quiet")
    with open(at("survey.json"), "w") as file:
        json.dump(survey_of(at("rig-text")), file)
    command(sheaf, "solve", at("rig"), "-o", at("rig-out"), "--constraints", at("survey.json"),
            "--report", at("rig.html"), "--quiet")
    command(sheaf, "generate", at("looks"), "--photometric", "--quiet")
    command(sheaf, "photometric", at("looks"), "-o", at("looks-out"), "--report", at("pixels.html"),
            "--quiet")
    return {"rig": at("rig.html"), "pixels": at("pixels.html")}


def settle(page):
    """Until nothing moves any more."""
    before = None
    for _ in range(40):
        time.sleep(0.08)
        now = page.run(PIXELS)
        if now == before:
            return now
        before = now
    return before


def check_scene(page):
    start = settle(page)
    say(f"the canvas is not blank ({start[0]} pixels)", start[0] > 1000)
    page.run("document.getElementById('t').focus()")
    page.key("Home")
    say("the slider moves the points, by a key", settle(page)[1] != start[1])
    page.key("End")
    say("and back to the same picture", settle(page) == start)
    page.run("document.getElementById('view').focus()")
    page.key("ArrowLeft")
    say("an arrow turns the scene", settle(page)[1] != start[1])
    page.key("f")
    say("F fits it again", settle(page) == start)
    page.key("2")
    say("2 colours by track length", settle(page)[1] != start[1])
    page.key("1")
    page.key("n")
    say("N opens an image: " + page.run(PANEL), page.run(PANEL) != "")
    page.key("Escape")
    say("Escape closes it", page.run(PANEL) == "")
    settle(page)


def check_clicks(page):
    box = page.run("(() => { const r = document.getElementById('gl').getBoundingClientRect(); "
                   "return [r.left, r.top, r.width, r.height]; })()")
    places = page.run("(() => { const v = []; for (let y = 0.1; y < 0.95; y += 0.06) "
                      "for (let x = 0.1; x < 0.95; x += 0.05) v.push([x, y]); return v; })()")
    kinds = {"Point": "", "image": ""}
    for x, y in places:
        page.click(box[0] + x * box[2], box[1] + y * box[3])
        opened = page.run(PANEL)
        for kind in kinds:
            if opened.startswith(kind):
                kinds[kind] = opened
        page.key("Escape")
        if all(kinds.values()):
            break
    for kind, opened in kinds.items():
        say(f"a click opens {opened or 'no ' + kind}", opened != "")
    page.run("document.querySelector('.card').focus()")
    page.key("Enter")
    say("Enter on a card opens " + page.run(PANEL), page.run(PANEL) != "")
    page.key("Escape")
    say("and the focus comes back", page.run("document.activeElement.className") == "card")


def check_names(page):
    """Everything that can be used has a name that can be read out."""
    nameless = page.run("""[...document.querySelectorAll('button, input, a, [role]')].filter((e) =>
 !(e.getAttribute('aria-label') || e.textContent.trim() || (e.labels && e.labels.length) || e.title)).map((e) => e.outerHTML.slice(0, 80))""")
    say("all controls have names " + "; ".join(nameless), not nameless)


def check_accessibility(page, axe):
    if not axe:
        print("      (axe-core is not here: its rules were not tried)")
        return
    with open(axe) as file:
        page.run(file.read() + "; 0")
    page.run("sheaf.showImage(0)")
    found = page.run("axe.run().then((r) => r.violations.filter((v) => v.impact === 'serious' || "
                     "v.impact === 'critical').map((v) => v.impact + ' ' + v.id + ' ' + v.nodes[0].target))")
    say("axe finds nothing serious " + "; ".join(found), not found)
    page.run("sheaf.close()")


def check_looks(page):
    parts = page.run("[...document.querySelectorAll('section')].map((s) => s.id).join(' ')")
    say("sections: " + parts, parts == "residuals lenses images structure run settings")
    texts = page.run("document.querySelectorAll('section svg text').length")
    say(f"charts have text ({texts})", texts > 100)
    say("nothing is wider than the page",
        page.run("document.documentElement.scrollWidth <= innerWidth"))
    width, height = struct.unpack(">II", page.screenshot()[16:24])
    say("a picture of 1280 x 800", (width, height) == (1280, 800))
    light = settle(page)
    page.dark(True)
    say("the dark differs", settle(page)[1] != light[1])
    page.dark(False)
    page.size(390, 844, touch=True)
    time.sleep(0.3)
    say("a phone scrolls down only", page.run("document.documentElement.scrollWidth <= innerWidth"))
    page.size(1280, 800)
    paper = page.pdf()
    say(f"it prints ({len(paper) // 1024} kB)", paper.startswith(b"%PDF") and len(paper) > 50000)


def check_quiet(page, path):
    asked = [url for url in page.requests if not url.startswith(("file://", "data:", "about:"))]
    files = [url for url in page.requests if url.startswith("file://")]
    say("one file and no request " + " ".join(asked), not asked and len(files) == 1)
    say("the console is empty " + "; ".join(page.said), not page.said)
    say(f"under 5 MB ({os.path.getsize(path) / 1e6:.2f})", os.path.getsize(path) < 5e6)


def main():
    program = browser.find()
    if not program:
        print("skipped: no Chromium here (Debian's package: chromium)")
        return 77
    write = "--write" in sys.argv
    sheaf, axe = ([word for word in sys.argv[1:] if word != "--write"] + [""])[:2]
    with tempfile.TemporaryDirectory() as folder:
        bal, hostile, names = make_reports(sheaf, folder)
        page = browser.Browser(program)
        try:
            page.open(bal)
            check_quiet(page, bal)
            check_scene(page)
            check_clicks(page)
            check_names(page)
            check_looks(page)
            check_accessibility(page, axe)
            page.open(hostile)
            page.run("sheaf.showImage(0); sheaf.showPoint(3)")
            say(f"{names} hostile names stay text", names > 5 and page.run("window.hacked === undefined")
                and page.run("document.querySelectorAll('script').length") == 3)
            say("and are shown", "<script>" in page.run("document.querySelector('.cap b').textContent"))
            check_quiet(page, hostile)
            others = make_others(sheaf, folder)
            looks.check(page, {"bal": bal, **others}, say, write)
            for path in others.values():
                page.open(path)
                check_quiet(page, path)
                check_names(page)
                check_accessibility(page, axe)
        finally:
            page.close()
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
