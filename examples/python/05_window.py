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

WINDOW = 10
PIXEL, OUTLIERS = 0.5, 0.01
OPTIONS = {"fix": "intrinsics", "loss": "huber:3", "tolerance": 1e-6}
rng = numpy.random.default_rng(1)
lens = sheaf.Camera("PINHOLE", numpy.array([400.0, 400.0, 320.0, 240.0]), 640, 480)


def street(frames):
    """True poses, points, and (frame, point, x, y) of what is seen, some of it wrong."""
    poses = numpy.tile([1.0, 0, 0, 0, 0, 0, 0], (frames, 1))
    poses[:, 4] = -1.5 * numpy.arange(frames)  # t = -R C
    poses[:, 5] = -0.2 * numpy.sin(0.3 * numpy.arange(frames))
    points = rng.uniform([-4, -4, 5], [1.5 * frames + 4, 4, 12], (26 * frames, 3))
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


def known_start(poses):
    """The first two poses are known: they say where everything is, and how large."""
    blocks = [("pose", i, poses[i]) for i in (0, 1)]
    return {"blocks": blocks, "square_root": 1e5 * numpy.eye(12), "mean": None}


def leave(problem):
    """What the oldest frame, and the points that it sees, say of the frames that stay."""
    points = numpy.unique(problem.observation_point[problem.observation_image == 0])
    prior = sheaf.marginalise(problem, [0], points, loss=OPTIONS["loss"], fix=OPTIONS["fix"])
    prior["blocks"] = [(kind, i - 1, state) for kind, i, state in prior["blocks"]]
    return points, prior


def run(truth, points, seen):
    """The poses that a sliding window finds, and its seconds for each frame."""
    poses = truth.copy()
    solver = sheaf.Solver(**OPTIONS)
    prior, first_frame, seconds = known_start(poses), 0, []
    for newest in range(1, len(poses)):
        if newest > 1:  # a guess that is off
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
        poses[frames] = problem.poses
        points[ids] = problem.points
        if len(frames) == WINDOW:
            # What later frames see of the points that leave are new points.
            leaving, prior = leave(problem)
            gone = numpy.isin(seen[:, 1].astype(int), ids[leaving]) & (seen[:, 0] <= newest)
            seen = seen[~gone]
            first_frame += 1
        seconds.append(time.perf_counter() - begin)
    return poses, numpy.array(seconds)


def main(frames):
    truth, true_points, seen = street(frames)
    points = true_points + 0.1 * rng.normal(size=true_points.shape)  # as a front end finds them
    poses, seconds = run(truth, points, seen)
    off = numpy.linalg.norm(poses[-1, 4:] - truth[-1, 4:])
    print(f"{frames} frames: the last is off by {off:.4f} after {1.5 * (frames - 1):.0f} units")
    print(f"a frame takes {1e3 * numpy.median(seconds):.1f} ms, at most {1e3 * max(seconds):.1f}")
    assert off < 0.005 * frames


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 40)
