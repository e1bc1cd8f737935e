# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""A BAL file in five lines: `python 01_bal.py problem.txt refined.txt`, or without arguments on a
generated scene."""

import sys

import sheaf

if len(sys.argv) < 3:
    sheaf.generate(cameras=16, points=1000)[0].write("scene.txt")
    sys.argv[1:] = ["scene.txt", "refined.txt"]

problem = sheaf.read(sys.argv[1])
summary = sheaf.solve(problem)
print(summary)
problem.write(sys.argv[2])
