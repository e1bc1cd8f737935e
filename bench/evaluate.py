#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""The cost of a BAL state, evaluated apart from every solver: evaluate.py ORIGINAL [FINAL...]

1/2 sum |r|^2 in px^2, or 1/2 sum rho(|r|^2) with a loss. The observations are always those of
ORIGINAL, so a solver that
drops or changes some cannot look better for it. Uses NumPy when it is there, else plain Python.
Large files go to the program peer-evaluate (bench/peers), which shares no code with an engine.
"""
import math
import re
import subprocess
import sys

try:
    import numpy
except ImportError:  # slower, and the same to rounding
    numpy = None

LARGE = 200_000  # observations from which on the program is asked, when it is there
# rho / c^2 of z = |r|^2 / c^2, by the words that the peers' configurations have for it.
LOSSES = {"huber": lambda z: z if z <= 1 else 2 * math.sqrt(z) - 1,
          "soft_l1": lambda z: 2 * (math.sqrt(1 + z) - 1),
          "cauchy": math.log1p,
          "tukey": lambda z: (1 - max(0.0, 1 - z) ** 3) / 3}


def loss_of(config):
    """(word, scale in px) of the loss among a configuration's words, or None."""
    found = re.search(rf"(?:^|-)({'|'.join(LOSSES)})=([0-9.]+)", config)
    return (found[1], float(found[2])) if found else None


def half_sum(squares, loss):
    """1/2 sum rho(|r|^2) of the observations' squares."""
    if loss:
        rho, c2 = LOSSES[loss[0]], loss[1] ** 2
        squares = (c2 * rho(s / c2) for s in squares)
    return 0.5 * math.fsum(squares)


def read_bal(path):
    """(observations, cameras, points): flat lists of 4, 9 and 3 numbers each."""
    with open(path) as file:
        words = file.read().split()
    n_cameras, n_points, n_observations = (int(w) for w in words[:3])
    ends = [3]
    for count in (4 * n_observations, 9 * n_cameras, 3 * n_points):
        ends.append(ends[-1] + count)
    if len(words) < ends[-1]:
        raise ValueError(f"{path}: {len(words)} numbers where {ends[-1]} were announced")
    make = (lambda w: numpy.array(w, dtype=float)) if numpy else (lambda w: [float(x) for x in w])
    return tuple(make(words[a:b]) for a, b in zip(ends, ends[1:]))


def rotation(w):
    """Rotation matrix (rows) of an angle-axis vector."""
    t2 = w[0] * w[0] + w[1] * w[1] + w[2] * w[2]
    t = math.sqrt(t2)
    # The series' next terms are below 1e-16 where they are used.
    a = math.sin(t) / t if t > 1e-4 else 1 - t2 / 6
    b = 2 * (math.sin(t / 2) / t) ** 2 if t > 1e-4 else 0.5 - t2 / 24
    x, y, z = w
    return [[1 - b * (y * y + z * z), b * x * y - a * z, b * x * z + a * y],
            [b * x * y + a * z, 1 - b * (x * x + z * z), b * y * z - a * x],
            [b * x * z - a * y, b * y * z + a * x, 1 - b * (x * x + y * y)]]


def plain_cost(observations, cameras, points, loss=None):
    rotations = [rotation(cameras[9 * i:9 * i + 3]) for i in range(len(cameras) // 9)]
    squares = []
    for k in range(0, len(observations), 4):
        camera, point = int(observations[k]), int(observations[k + 1])
        R, c, X = rotations[camera], cameras[9 * camera:9 * camera + 9], points[3 * point:3 * point + 3]
        P = [row[0] * X[0] + row[1] * X[1] + row[2] * X[2] + shift for row, shift in zip(R, c[3:6])]
        x, y = -P[0] / P[2], -P[1] / P[2]
        n = x * x + y * y
        scale = c[6] * (1 + n * (c[7] + n * c[8]))
        squares.append((scale * x - observations[k + 2]) ** 2 +
                       (scale * y - observations[k + 3]) ** 2)
    return half_sum(squares, loss)


def array_cost(observations, cameras, points, loss=None):
    o, c, X = (numpy.asarray(a).reshape(-1, n)
               for a, n in ((observations, 4), (cameras, 9), (points, 3)))
    camera, point = o[:, 0].astype(int), o[:, 1].astype(int)
    R = numpy.array([rotation(w) for w in c[:, :3]])
    P = numpy.einsum("nij,nj->ni", R[camera], X[point]) + c[camera, 3:6]
    p = -P[:, :2] / P[:, 2:]
    n = (p * p).sum(axis=1)
    f, k1, k2 = c[camera, 6:].T
    r = (f * (1 + n * (k1 + n * k2)))[:, None] * p - o[:, 2:]
    return half_sum((r * r).sum(axis=1).tolist(), loss)


def cost(original, final, program=None, loss=None):
    """Cost of the state in file `final` on the observations of file `original`. The program knows no
    loss, a (word, scale) of LOSSES."""
    with open(original) as file:
        large = int(file.readline().split()[2]) >= LARGE
    if program and large and not loss:
        return float(subprocess.run([program, original, final], check=True, capture_output=True,
                                    text=True).stdout)
    observations = read_bal(original)[0]
    _, cameras, points = read_bal(final)
    return (array_cost if numpy else plain_cost)(observations, cameras, points, loss)


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    for path in sys.argv[2:] or sys.argv[1:]:
        print(f"{cost(sys.argv[1], path):.9f} {path}")
