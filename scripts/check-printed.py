#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""Holds a page against the program whose output it shows.

  check-printed.py PAGE PROGRAM

Every line of the page's text blocks (```text) must be a line that the program prints, in order:
words as they stand, whole numbers within 10% or 2, others within 5%. Machines differ in the last
bit of a sine, and a count of steps may follow it.
"""

import pathlib
import re
import subprocess
import sys


def agree(shown, printed):
    if shown == printed:
        return True
    try:
        a, b = float(shown), float(printed)
    except ValueError:
        return False
    whole = re.fullmatch(r"\d+", shown) and re.fullmatch(r"\d+", printed)
    return abs(a - b) <= (max(2, 0.1 * abs(b)) if whole else 0.05 * abs(b))


def same(shown, printed):
    a, b = shown.split(), printed.split()
    return len(a) == len(b) and all(agree(x, y) for x, y in zip(a, b))


def main():
    page, program = pathlib.Path(sys.argv[1]), sys.argv[2]
    text = page.read_text(encoding="utf-8")
    blocks = re.findall(r"^```text\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    shown = [line for block in blocks for line in block.splitlines() if line.strip()]
    result = subprocess.run([program], capture_output=True, text=True, timeout=120)
    printed = [line for line in result.stdout.splitlines() if line.strip()]
    if result.returncode != 0 or not shown:
        sys.exit(f"{program} exited with {result.returncode}; {page} shows {len(shown)} lines")
    rest = iter(printed)
    for line in shown:
        if not any(same(line, other) for other in rest):
            sys.exit(f"{page}: not printed (or not in this order):\n  {line}\n\nprinted:\n"
                     + result.stdout)
    print(f"{page.name}: {len(shown)} lines as printed")


if __name__ == "__main__":
    main()
