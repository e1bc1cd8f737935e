# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""Scenes that check-bits.py writes itself: those that `sheaf generate` does not make.

Sums, products and roots only, so that every machine writes the same bytes.
"""

import struct
import zlib


def png(path, rows, bits):
    """Writes grey rows (lists of whole numbers) as a PNG of 8 or 16 bits."""
    def chunk(kind, body):
        return (struct.pack(">I", len(body)) + kind + body
                + struct.pack(">I", zlib.crc32(kind + body)))
    width, height = len(rows[0]), len(rows)
    form = ">%d%s" % (width, "H" if bits == 16 else "B")
    body = b"".join(b"\0" + struct.pack(form, *row) for row in rows)
    path.write_bytes(b"\x89PNG\r\n\x1a\n"
                     + chunk(b"IHDR", struct.pack(">2I5B", width, height, bits, 0, 0, 0, 0))
                     + chunk(b"IDAT", zlib.compress(body, 6)) + chunk(b"IEND", b""))


def texture(x, y):
    """Smooth noise in 0..1 over the plane, with a lattice of one unit."""
    def corner(i, j):
        h = (i * 374761393 + j * 668265263) & 0xffffffff
        h = ((h ^ (h >> 13)) * 1274126177) & 0xffffffff
        return ((h ^ (h >> 16)) & 0xffff) / 65535
    i, j = int(x // 1), int(y // 1)
    u, v = x - i, y - j
    u, v = u * u * (3 - 2 * u), v * v * (3 - 2 * v)
    low = corner(i, j) * (1 - u) + corner(i + 1, j) * u
    high = corner(i, j + 1) * (1 - u) + corner(i + 1, j + 1) * u
    return low * (1 - v) + high * v


def rgbd(folder, images, size, focal, pace, numbered):
    """Images along a slope Z = 2 + X / 20, with depth maps in 1 / 5000: a list of files, or by
    number."""
    width, height = size
    colour, depth = ("color", "depth") if numbered else ("rgb", "depth")
    for name in (colour, depth):
        (folder / name).mkdir(parents=True)
    cx, cy = (width - 1) / 2, (height - 1) / 2
    lists = {"rgb": [], "depth": [], "groundtruth": [], "pose": []}
    for n in range(images):
        place = pace * n
        greys, depths = [], []
        for row in range(height):
            grey_row, depth_row = [], []
            for column in range(width):
                u, v = (column - cx) / focal, (row - cy) / focal
                z = (2 + place / 20) / (1 - u / 20)
                x, y = 4 * (place + u * z), 4 * v * z
                grey = 30 + 140 * texture(x, y) + 60 * texture(2.3 * x + 7, 2.3 * y + 3)
                grey_row.append(int(grey))
                depth_row.append(int(5000 * z))
            greys.append(grey_row)
            depths.append(depth_row)
        name = f"{n}.png"
        png(folder / colour / name, greys, 8)
        png(folder / depth / name, depths, 16)
        lists["rgb"].append(f"{n}.0 rgb/{name}")
        lists["depth"].append(f"{n}.005 depth/{name}")
        lists["groundtruth"].append(f"{n}.01 {place} 0 0 0 0 0 1")
        lists["pose"].append(f"{place} 0 0 0 0 0 1")
    for name in ("pose",) if numbered else ("rgb", "depth", "groundtruth"):
        (folder / f"{name}.txt").write_text("\n".join(lists[name]) + "\n")
    (folder / "intrinsics.txt").write_text(f"{focal} {focal} {cx} {cy}\n")


def project(pose, point, lens):
    """The pixel of a world point by a pose (tx ty tz, qx qy qz qw), the first pixel at (0, 0)."""
    t, (x, y, z, w) = pose[:3], pose[3:]
    rotation = ((1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
                (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
                (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)))
    p = [r[0] * point[0] + r[1] * point[1] + r[2] * point[2] + s for r, s in zip(rotation, t)]
    return lens[0] * p[0] / p[2] + lens[2], lens[1] * p[1] / p[2] + lens[3]


def pinhole_model(folder, photometric, size):
    """A COLMAP text model of a photometric folder: its poses, points and where they project to."""
    folder.mkdir(parents=True)
    numbers = lambda name: [[float(x) for x in line.split()]
                            for line in (photometric / name).read_text().splitlines()]
    lens = numbers("intrinsics.txt")[0]
    poses = [row[1:] for row in numbers("poses.txt")]
    points = [row[:3] for row in numbers("points.txt")]
    tracks, features = [[] for _ in points], [[] for _ in poses]
    for j, pose in enumerate(poses):
        for i, point in enumerate(points):
            x, y = project(pose, point, lens)
            if 3 < x < size[0] - 4 and 3 < y < size[1] - 4:
                tracks[i].append(f"{j + 1} {len(features[j])}")
                features[j].append(f"{x + 0.5} {y + 0.5} {i + 1}")
    fx, fy, cx, cy = lens
    (folder / "cameras.txt").write_text(
        f"1 PINHOLE {size[0]} {size[1]} {fx} {fy} {cx + 0.5} {cy + 0.5}\n")
    (folder / "images.txt").write_text("".join(
        f"{j + 1} {p[6]} {p[3]} {p[4]} {p[5]} {p[0]} {p[1]} {p[2]} 1 {j}.png\n"
        + " ".join(features[j]) + "\n" for j, p in enumerate(poses)))
    (folder / "points3D.txt").write_text("".join(
        f"{i + 1} {p[0]} {p[1]} {p[2]} 128 128 128 0 " + " ".join(tracks[i]) + "\n"
        for i, p in enumerate(points) if len(tracks[i]) > 1))


def mixed_model(folder, model):
    """Of an OPENCV text model, the second camera as FULL_OPENCV and the third as PINHOLE."""
    folder.mkdir(parents=True)
    lines = []
    for line in (model / "cameras.txt").read_text().splitlines():
        words = line.split()
        if words[0] == "2":
            words = words[:1] + ["FULL_OPENCV"] + words[2:] + ["0"] * 4
        elif words[0] == "3":
            words = words[:1] + ["PINHOLE"] + words[2:8]
        lines.append(" ".join(words))
    (folder / "cameras.txt").write_text("\n".join(lines) + "\n")
    for name in ("images.txt", "points3D.txt"):
        (folder / name).write_bytes((model / name).read_bytes())


def rigged_model(folder, model):
    """A text model of one lens, each image a frame of one rig."""
    folder.mkdir(parents=True)
    for name in ("cameras.txt", "images.txt", "points3D.txt"):
        (folder / name).write_bytes((model / name).read_bytes())
    rows = [line.split() for line in (model / "images.txt").read_text().splitlines()
            if line.endswith(".png")]
    (folder / "rigs.txt").write_text("1 1 CAMERA 1\n")
    (folder / "frames.txt").write_text("".join(
        f"{row[0]} 1 {' '.join(row[1:8])} 1 CAMERA 1 {row[0]}\n" for row in rows))


def repeated(path, scene):
    """A BAL problem with its first twenty observations a second time."""
    lines = scene.read_text().splitlines()
    cameras, points, observations = (int(x) for x in lines[0].split())
    rows = lines[1:observations + 1]
    head = f"{cameras} {points} {observations + 20}"
    path.write_text("\n".join([head] + rows + rows[:20] + lines[observations + 1:]) + "\n")
