# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""Problems that the tests share, and where the command and the real data are."""

import os
import pathlib
import subprocess
import unittest

import sheaf

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
COMMAND = os.environ.get("SHEAF_COMMAND")
DUBROVNIK = (
    pathlib.Path(os.environ.get("SHEAF_DATA", ROOT / "data")) / "bal/dubrovnik-16-22106-pre.txt"
)

needs_command = unittest.skipUnless(COMMAND, "SHEAF_COMMAND does not name the command")


def small(**options):
    """A disturbed scene that is solved in milliseconds, and its truth."""
    return sheaf.generate(**{"cameras": 8, "points": 300, "seed": 4, **options})


def street(**options):
    """Images of two rigid cameras, with names and OPENCV lenses."""
    return sheaf.generate(rigs="stereo", frames=10, points=400, seed=2, **options)


def long():
    """A problem whose solve, by `slow` options, takes a second or two."""
    return sheaf.generate(cameras=60, points=60000, mean_track=6, seed=1)[0]


slow = {"simd": "scalar", "threads": 1, "tolerance": 0.0, "max_iterations": 500}


def arrays(problem):
    """What `sheaf.Problem` takes, copied."""
    return {
        "poses": problem.poses.copy(),
        "points": problem.points.copy(),
        "cameras": problem.cameras.copy(),
        "image_camera": problem.image_camera.copy(),
        "observation_image": problem.observation_image.copy(),
        "observation_point": problem.observation_point.copy(),
        "observation_xy": problem.observation_xy.copy(),
    }


def run_command(*words):
    return subprocess.run(
        [COMMAND, *map(str, words)], capture_output=True, text=True, timeout=120, check=True
    )
