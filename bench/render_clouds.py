#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""Draws the points and camera centres of BAL files side by side, along the two axes in which they
spread most, as one PNG.

  render_clouds.py OUT.png BEFORE.txt AFTER.txt...

All panels share the frame of the last file: its cameras and the middle nine tenths of its points,
with some room. Grey: points; red: cameras. Needs nothing but Python.
"""
import math
import struct
import sys
import zlib

SIDE, GAP, ROOM = 420, 12, 0.35


def rotate_back(w, v):
    """R(w)^T v by Rodrigues' formula."""
    angle = math.sqrt(sum(x * x for x in w))
    if angle < 1e-12:
        return v
    k = [-x / angle for x in w]
    cross = [k[1] * v[2] - k[2] * v[1], k[2] * v[0] - k[0] * v[2], k[0] * v[1] - k[1] * v[0]]
    along = sum(a * b for a, b in zip(k, v)) * (1 - math.cos(angle))
    return [v[i] * math.cos(angle) + cross[i] * math.sin(angle) + k[i] * along for i in range(3)]


def read_bal(path):
    """(points, camera centres), 3 each."""
    with open(path) as file:
        cameras, points, observations = (int(n) for n in file.readline().split())
        for _ in range(observations):
            file.readline()
        numbers = [float(x) for x in file.read().split()]
    own = [numbers[9 * i:9 * i + 9] for i in range(cameras)]
    centers = [[-x for x in rotate_back(c[:3], c[3:6])] for c in own]
    rest = numbers[9 * cameras:]
    return [rest[3 * j:3 * j + 3] for j in range(points)], centers


def frame_of(points, centers, axes):
    """Lowest corner and size of the square that holds the cameras and most of the points."""
    lows, highs = [], []
    for a in axes:
        values = sorted(p[a] for p in points)
        inner = values[len(values) // 20:len(values) - len(values) // 20]
        inner += [c[a] for c in centers]
        lows.append(min(inner))
        highs.append(max(inner))
    size = max(h - l for l, h in zip(lows, highs)) * (1 + ROOM)
    return [(l + h - size) / 2 for l, h in zip(lows, highs)], size


def flattest(points):
    """The two axes along which the middle of the points spreads most."""
    spreads = []
    for a in range(3):
        values = sorted(p[a] for p in points)
        spreads.append((values[len(values) * 9 // 10] - values[len(values) // 10], a))
    return sorted(a for _, a in sorted(spreads)[1:])


def draw(pixels, width, left, scene, axes, corner, size):
    def place(v):
        x = int((v[axes[0]] - corner[0]) / size * SIDE)
        y = SIDE - 1 - int((v[axes[1]] - corner[1]) / size * SIDE)
        return (x, y) if 0 <= x < SIDE and 0 <= y < SIDE else None

    for p in scene[0]:
        if at := place(p):
            i = at[1] * width + left + at[0]
            pixels[i] = max(1, pixels[i] - 2)  # shades of grey: 1 (dark) to 7 (white)
    for c in scene[1]:
        if at := place(c):
            for y in range(max(0, at[1] - 2), min(SIDE, at[1] + 3)):
                for x in range(max(0, at[0] - 2), min(SIDE, at[0] + 3)):
                    pixels[y * width + left + x] = 0


def write_png(path, pixels, width):
    palette = bytes([200, 30, 30]) + b"".join(bytes([v] * 3) for v in (20, 60, 100, 140, 180, 215, 255))
    rows = b"".join(b"\0" + bytes(pixels[y * width:(y + 1) * width]) for y in range(SIDE))

    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))

    with open(path, "wb") as out:
        out.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", width, SIDE, 8, 3, 0, 0, 0)) +
                  chunk(b"PLTE", palette) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b""))


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    scenes = [read_bal(path) for path in sys.argv[2:]]
    axes = flattest(scenes[-1][0])
    corner, size = frame_of(*scenes[-1], axes)
    width = len(scenes) * (SIDE + GAP) - GAP
    pixels = [7] * (width * SIDE)
    for k, scene in enumerate(scenes):
        draw(pixels, width, k * (SIDE + GAP), scene, axes, corner, size)
        if k + 1 < len(scenes):
            for y in range(SIDE):
                pixels[y * width + (k + 1) * (SIDE + GAP) - GAP // 2] = 5
    write_png(sys.argv[1], pixels, width)


if __name__ == "__main__":
    main()
