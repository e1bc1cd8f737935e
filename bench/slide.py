#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""A window that slides along a generated street, beside the adjustment of all frames: slide.py [FRAMES]

The street and the window are those of examples/python/05_window.py. Both get the same measurements and
the first two poses; errors are those of poses against the truth, in units of the scene. --times: what
each frame took.
"""
import argparse
import importlib.util
import os
import time

import numpy

import sheaf

HERE = os.path.dirname(os.path.abspath(__file__))


def example():
    path = os.path.join(HERE, "..", "examples", "python", "05_window.py")
    spec = importlib.util.spec_from_file_location("window", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def adjusted(window, truth, points, seen):
    """All frames at once, with the same loss and outliers switched off in the same way."""
    frames = numpy.arange(len(truth))
    poses = truth.copy()
    poses[2:, 4:] += 0.02 * window.rng.normal(size=(len(truth) - 2, 3))
    problem, _, _ = window.problem_of(frames, poses, points, seen, window.known_start(truth))
    begin = time.perf_counter()
    for _ in range(2):
        sheaf.solve(problem, max_iterations=200, **{**window.OPTIONS, "tolerance": 1e-10})
        window.switch_off_outliers(problem)
    return problem.poses.copy(), time.perf_counter() - begin


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("frames", nargs="?", type=int, default=300)
    parser.add_argument("--times", action="store_true")
    a = parser.parse_args()
    window = example()
    truth, true_points, seen = window.street(a.frames)
    points = true_points + 0.1 * window.rng.normal(size=true_points.shape)
    slid, seconds = window.run(truth, points.copy(), seen)
    whole, whole_s = adjusted(window, truth, points.copy(), seen)
    print("| | error at the end | mean error | s |\n|---|--:|--:|--:|")
    for name, poses, s in (("window", slid, seconds.sum()), ("all frames", whole, whole_s)):
        off = numpy.linalg.norm(poses[:, 4:] - truth[:, 4:], axis=1)
        print(f"| {name} | {off[-1]:.4f} | {off.mean():.4f} | {s:.2f} |")
    q = numpy.quantile(1e3 * seconds[window.WINDOW:], [0.5, 0.9, 1])
    print(f"\nms a frame: {q[0]:.1f} median, {q[1]:.1f} of nine in ten, {q[2]:.1f} at most")
    if a.times:
        print(" ".join(f"{1e3 * s:.1f}" for s in seconds))


if __name__ == "__main__":
    main()
