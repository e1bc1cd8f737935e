# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""A window of keyframes that slides along a street: what leaves it stays as a Gaussian.

The camera looks at a wall beside it. Each new frame comes with a guess of its pose; the window is
refined, outliers are switched off and it is refined again, in the memory of the first time; then its
oldest frame leaves, with the points that nothing new sees. 05_window.py [FRAMES]
"""

import sys
import time

import numpy

import sheaf

FRAMES = int(sys.argv[1]) if len(sys.argv) > 1 else 40
WINDOW = 10
PIXEL, OUTLIERS = 0.5, 0.01
rng = numpy.random.default_rng(1)
lens = sheaf.Camera("PINHOLE", numpy.array([400.0, 400.0, 320.0, 240.0]), 640, 480)


def street():
    """True poses, points, and (frame, point, x, y) of what is seen, some of it wrong."""
    poses = numpy.tile([1.0, 0, 0, 0, 0, 0, 0], (FRAMES, 1))
    poses[:, 4] = -1.5 * numpy.arange(FRAMES)  # t = -R C
    poses[:, 5] = -0.2 * numpy.sin(0.3 * numpy.arange(FRAMES))
    points = rng.uniform([-4, -4, 5], [1.5 * FRAMES + 4, 4, 12], (26 * FRAMES, 3))
    seen = []
    for frame, pose in enumerate(poses):
        local = points + pose[4:]
        xy = 400 * local[:, :2] / local[:, 2:] + [320, 240]
        inside = numpy.flatnonzero(((xy >= 0) & (xy < [640, 480])).all(axis=1))
        xy = xy[inside] + PIXEL * rng.normal(size=(len(inside), 2))
        wrong = rng.random(len(inside)) < OUTLIERS
        xy[wrong] += rng.uniform(-40, 40, (wrong.sum(), 2))
        seen.append(numpy.column_stack([numpy.full(len(inside), frame), inside, xy]))
    return poses, points, numpy.concatenate(seen)


def problem_of(frames, poses, points, seen, prior):
    """The frames, the points that two of them see, and what an earlier window left."""
    seen = seen[numpy.isin(seen[:, 0], frames)]
    ids, counts = numpy.unique(seen[:, 1].astype(int), return_counts=True)
    ids = ids[counts >= 2]
    seen = seen[numpy.isin(seen[:, 1], ids)]
    problem = sheaf.Problem(
        poses=poses[frames],
        points=points[ids],
        cameras=[lens],
        image_camera=numpy.zeros(len(frames), int),
        observation_image=seen[:, 0].astype(int) - frames[0],
        observation_point=numpy.searchsorted(ids, seen[:, 1].astype(int)),
        observation_xy=seen[:, 2:],
        observation_sigma=numpy.full(len(seen), PIXEL),
    )
    problem.add_gaussian_prior(**prior)
    return problem, ids, seen


def switch_off_outliers(problem):
    """Observations that are off by more than four sigmas take no part any more."""
    # Rotations are all but the identity here; in general this is R X + t.
    q = problem.poses[problem.observation_image]
    X = problem.points[problem.observation_point]
    w, v = q[:, :1], q[:, 1:4]
    turned = X + 2 * numpy.cross(v, numpy.cross(v, X) + w * X)
    local = turned + q[:, 4:]
    off = 400 * local[:, :2] / local[:, 2:] + [320, 240] - problem.observation_xy
    problem.observation_sigma[(off**2).sum(axis=1) > (4 * PIXEL) ** 2] = numpy.inf


def run():
    truth, true_points, seen = street()
    points = true_points + 0.1 * rng.normal(size=true_points.shape)  # as a front end finds them
    poses = truth.copy()
    solver = sheaf.Solver(fix="intrinsics", loss="huber:3", tolerance=1e-6)
    # The first two poses are known: they say where everything is, and how large.
    known = [("pose", i, poses[i]) for i in (0, 1)]
    prior = {"blocks": known, "square_root": 1e5 * numpy.eye(12), "mean": None}
    first_frame, seconds = 0, []
    for newest in range(1, FRAMES):
        if newest > 1:
            # As it was seen from the truth, and a guess that is off.
            step = truth[newest, 4:] - truth[newest - 1, 4:]
            poses[newest] = poses[newest - 1]
            poses[newest, 4:] += step + 0.02 * rng.normal(size=3)
        frames = numpy.arange(first_frame, newest + 1)
        problem, ids, used = problem_of(frames, poses, points, seen, prior)
        begin = time.perf_counter()
        solver.solve(problem)
        switch_off_outliers(problem)
        solver.solve(problem)
        assert solver.was_kept
        if len(frames) == WINDOW and newest + 1 < FRAMES:
            # The oldest frame leaves, and so do the points that it sees: what they say of the other
            # frames stays. Later frames see some of these again, as new ones.
            leaving = numpy.unique(problem.observation_point[problem.observation_image == 0])
            prior = sheaf.marginalise(problem, [0], leaving, loss="huber:3", fix="intrinsics")
            prior["blocks"] = [(kind, i - 1, state) for kind, i, state in prior["blocks"]]
            seconds.append(time.perf_counter() - begin)
            used_up = numpy.isin(seen[:, 1].astype(int), ids[leaving]) & (seen[:, 0] <= newest)
            seen = seen[~used_up]
            first_frame += 1
        poses[frames] = problem.poses
        points[ids] = problem.points
    return truth, poses, seconds


truth, poses, seconds = run()
off = numpy.linalg.norm(poses[:, 4:] - truth[:, 4:], axis=1)
print(f"{FRAMES} frames: the last is off by {off[-1]:.4f} after {1.5 * (FRAMES - 1):.0f} units")
print(f"windows of {WINDOW}: {1e3 * numpy.median(seconds):.1f} ms, at most {1e3 * max(seconds):.1f}")
assert off[-1] < 0.5
