#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""How quick reports are in a browser that draws by software, 1280 x 800:

    speed.py SHEAF [MODEL ...]

prints frames a second of a generated scene of 100,000 points while it turns, with the points that a
frame has (as many as keep the picture fluent), and when the page of each MODEL (a file or folder;
the generated scene without) is first painted and when its scene is there. Medians of five.
"""
import json
import os
import statistics
import subprocess
import sys
import tempfile

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import browser  # noqa: E402

TIMES = """(() => { const paint = performance.getEntriesByType('paint')
  .find((e) => e.name === 'first-contentful-paint');
return [paint ? paint.startTime : -1, performance.getEntriesByName('ready')[0].startTime]; })()"""


def median(values):
    return statistics.median(values)


def times_of(program, path):
    """First paint and the scene's readiness, ms after the page was asked for, each five times."""
    found = []
    for _ in range(5):
        page = browser.Browser(program)
        try:
            page.open(path)
            page.wait(TIMES + "[0] >= 0")
            found.append(page.run(TIMES))
        finally:
            page.close()
    return [[one[k] for one in found] for k in (0, 1)]


def frames_of(program, path):
    """Frames a second while the scene turns between its two states, and points drawn at the end."""
    page = browser.Browser(program)
    try:
        page.open(path)
        return [page.run("sheaf.spin(3)") for _ in range(5)]
    finally:
        page.close()


def main():
    program = browser.find()
    if not program:
        print("skipped: no Chromium here (Debian's package: chromium)")
        return 77
    sheaf, models = sys.argv[1], sys.argv[2:]
    with tempfile.TemporaryDirectory() as folder:
        start, truth, page = (os.path.join(folder, name) for name in ("in.txt", "truth.txt", "a.html"))
        make = lambda *words: subprocess.run(  # noqa: E731
            (sheaf, *words, "--quiet"), check=True, stdout=subprocess.DEVNULL)
        make("generate", start, "--cameras", "120", "--points", "100000", "--truth", truth)
        make("report", start, truth, "-o", page)
        spins = frames_of(program, page)
        out = {"frames_per_second": median([s["framesPerSecond"] for s in spins]),
               "points_drawn": median([s["points"] for s in spins]), "pages": {}}
        print(f"100 000 points: {out['frames_per_second']:.1f} frames a second of "
              f"{out['points_drawn']:.0f} points")
        for model in models or [start]:
            make("report", model, "-o", page)
            paint, ready = times_of(program, page)
            out["pages"][os.path.basename(model)] = {"first_paint_ms": median(paint),
                                                     "ready_ms": median(ready)}
            print(f"{os.path.basename(model)}: first paint after {median(paint):.0f} ms, scene after "
                  f"{median(ready):.0f} ms")
        print(json.dumps(out))
    return 0


if __name__ == "__main__":
    sys.exit(main())
