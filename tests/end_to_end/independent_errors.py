#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""Pose and point errors of two BAL files, by code that shares nothing with Sheaf: rotations as
matrices by Rodrigues' formula (never a quaternion), alignment by Umeyama's method (1991) with
NumPy's singular value decomposition, errors from matrices.

    independent_errors.py EST REF JSON CSV [--raw]

exits 1 unless what `sheaf evaluate --json JSON --csv CSV` says agrees to 1e-9, relatively.
"""
import csv
import json
import sys

import numpy as np

TOLERANCE = 1e-9


def rotation(w):
    """exp of [w]x; by its series where the quotients lose digits."""
    W = np.array([[0, -w[2], w[1]], [w[2], 0, -w[0]], [-w[1], w[0], 0]])
    t = np.sqrt(w @ w)
    if t < 1e-3:
        a, b = 1 - t**2 / 6 + t**4 / 120, 0.5 - t**2 / 24 + t**4 / 720
    else:
        a, b = np.sin(t) / t, 2 * (np.sin(t / 2) / t) ** 2
    return np.eye(3) + a * W + b * W @ W


def read(path):
    with open(path) as file:
        words = file.read().split()
    cameras, points, observations = (int(w) for w in words[:3])
    numbers = np.array(words[3 + 4 * observations:], dtype=float)
    rows = numbers[:9 * cameras].reshape(cameras, 9)
    R = np.array([rotation(row[:3]) for row in rows])
    t = rows[:, 3:6]
    centers = -np.einsum("nji,nj->ni", R, t)
    return R, t, centers, numbers[9 * cameras:9 * cameras + 3 * points].reshape(points, 3)


def umeyama(source, target):
    """s, R, t that minimise sum |target - (s R source + t)|^2."""
    a, b = source.mean(axis=0), target.mean(axis=0)
    covariance = (target - b).T @ (source - a) / len(source)
    U, D, V = np.linalg.svd(covariance)
    S = np.diag([1, 1, np.linalg.det(U) * np.linalg.det(V)])
    R = U @ S @ V
    s = np.trace(np.diag(D) @ S) / ((source - a) ** 2).sum() * len(source)
    return s, R, b - s * R @ a


def angle(R):
    """Of a rotation matrix: the sine from the skew part, so that small angles keep their digits."""
    skew = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / 2
    return np.arctan2(np.sqrt(skew @ skew), (np.trace(R) - 1) / 2)


def errors(estimate, reference, raw):
    R, t, centers, points = estimate
    want_R, want_t, want_centers, want_points = reference
    scale, turn, shift = (1, np.eye(3), np.zeros(3)) if raw else umeyama(centers, want_centers)
    centers, points = (scale * X @ turn.T + shift for X in (centers, points))
    R = np.array([Q @ turn.T for Q in R])
    if not raw:
        t = -np.einsum("nij,nj->ni", R, centers)
    return scale, {"rotation_error_rad": np.array([angle(a @ b.T) for a, b in zip(R, want_R)]),
                   "translation_error": np.linalg.norm(t - want_t, axis=1),
                   "center_error": np.linalg.norm(centers - want_centers, axis=1),
                   "point_error": np.linalg.norm(points - want_points, axis=1)}


def check(what, claimed, found, size):
    if not abs(claimed - found) <= TOLERANCE * max(size, abs(found)):
        sys.exit(f"{what}: claimed {claimed!r}, found {found!r}")


def main():
    estimate, reference = read(sys.argv[1]), read(sys.argv[2])
    with open(sys.argv[3]) as file:
        claim = json.load(file)
    with open(sys.argv[4]) as file:
        rows = list(csv.DictReader(file))
    scale, lists = errors(estimate, reference, "--raw" in sys.argv)
    check("scale", claim["scale"], scale, 1)
    for kind, values in lists.items():
        # Errors of rounding are those of the coordinates, not of the small differences.
        size = 1e-3 if kind == "rotation_error_rad" else 1e-3 * np.abs(reference[2]).max()
        for name, value in (("mean", values.mean()), ("median", np.median(values)),
                            ("rms", np.sqrt((values**2).mean())), ("max", values.max())):
            check(f"{kind}.{name}", claim[kind][name], value, size)
        if kind != "point_error":
            for image, (row, value) in enumerate(zip(rows, values, strict=True)):
                check(f"{kind} of image {image}", float(row[kind]), value, size)


if __name__ == "__main__":
    main()
