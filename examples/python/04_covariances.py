# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""How well cameras and points are known, as ellipses of three sigmas seen from above."""

import sys

import numpy

import sheaf

try:
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot
    from matplotlib.patches import Ellipse
except ImportError:
    print("matplotlib is not installed: skipped")
    sys.exit(77)

problem, _ = sheaf.generate(cameras=12, points=200)
sheaf.solve(problem)
told = sheaf.covariance(problem)
print("\n".join(told.words))

# Camera centres: C = -R^T t, which turns t about the opposite axis.
w, v, t = problem.poses[:, :1], -problem.poses[:, 1:4], problem.poses[:, 4:]
centres = -(t + 2 * numpy.cross(v, numpy.cross(v, t) + w * t))


def ellipse(place, covariance, enlarged, **style):
    """Of the first two coordinates."""
    squares, axes = numpy.linalg.eigh(covariance[:2, :2])
    width, height = 6 * enlarged * numpy.sqrt(squares[::-1])
    angle = numpy.degrees(numpy.arctan2(axes[1, 1], axes[0, 1]))
    return Ellipse(place[:2], width, height, angle=angle, fill=False, **style)


figure, axes = pyplot.subplots(figsize=(7, 7))
for place, covariance in zip(problem.points, told.points):
    if numpy.isfinite(covariance).all():
        axes.add_patch(ellipse(place, covariance, 1, color="tab:blue", linewidth=0.5))
for place, covariance in zip(centres, told.centres):
    axes.add_patch(ellipse(place, covariance, 5, color="tab:red"))
axes.plot(*centres[:, :2].T, "r.", label="cameras")
axes.plot(*problem.points[:, :2].T, "b.", markersize=1, label="points")
axes.set(title="three sigmas, those of cameras five times as large", aspect="equal")
axes.legend()
figure.savefig("covariances.png", dpi=120)
print("wrote covariances.png")
