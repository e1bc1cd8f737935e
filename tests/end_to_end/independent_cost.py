#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""The cost of a BAL file, by code that shares nothing with Sheaf: standard library only, rotations
from the angle-axis by Rodrigues' formula (never a quaternion), sums without rounding.

    independent_cost.py FILE            prints 1/2 sum |r|^2 in px^2
    independent_cost.py FILE COST       exits 1 unless COST agrees to 1e-10, relatively
"""
import math
import sys


def rotated(w, X):
    """The point X turned by the angle-axis w, as BAL's page states it."""
    angle = math.sqrt(math.fsum(c * c for c in w))
    cross = lambda a, b: (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2],
                          a[0] * b[1] - a[1] * b[0])
    if angle == 0:
        return X
    axis = tuple(c / angle for c in w)
    sine, cosine = math.sin(angle), math.cos(angle)
    along = math.fsum(a * x for a, x in zip(axis, X)) * (1 - cosine)
    turned = cross(axis, X)
    return tuple(x * cosine + t * sine + a * along for x, t, a in zip(X, turned, axis))


def residual(camera, X, measured):
    w, t, (f, k1, k2) = camera[0:3], camera[3:6], camera[6:9]
    P = tuple(r + s for r, s in zip(rotated(w, X), t))
    x, y = -P[0] / P[2], -P[1] / P[2]
    n = x * x + y * y
    scale = f * (1 + k1 * n + k2 * n * n)
    return scale * x - measured[0], scale * y - measured[1]


def cost(path):
    with open(path) as file:
        words = file.read().split()
    cameras, points, observations = (int(word) for word in words[:3])
    start = 3 + 4 * observations
    numbers = [float(word) for word in words[start:]]
    if len(numbers) != 9 * cameras + 3 * points:
        sys.exit(f"{path}: {len(numbers)} parameters, expected {9 * cameras + 3 * points}")

    def squares():
        for i in range(3, start, 4):
            camera, point = 9 * int(words[i]), 9 * cameras + 3 * int(words[i + 1])
            r = residual(numbers[camera:camera + 9], numbers[point:point + 3],
                         (float(words[i + 2]), float(words[i + 3])))
            yield r[0] * r[0]
            yield r[1] * r[1]

    return math.fsum(squares()) / 2


def main():
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__)
    found = cost(sys.argv[1])
    print(repr(found))
    if len(sys.argv) == 3:
        claimed = float(sys.argv[2])
        if not abs(found - claimed) <= 1e-10 * found:
            sys.exit(f"{sys.argv[1]}: {claimed!r} was claimed, {found!r} is right")


if __name__ == "__main__":
    main()
