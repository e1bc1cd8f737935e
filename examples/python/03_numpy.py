# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""A problem from plain arrays, with sigmas for the pixels and priors for some cameras' places."""

import numpy

import sheaf

rng = numpy.random.default_rng(1)
lens = sheaf.Camera("PINHOLE", numpy.array([800.0, 800.0, 320.0, 240.0]), 640, 480)

# Ten cameras on a line that look along +z, 200 points in front of them.
poses = numpy.tile([1.0, 0, 0, 0, 0, 0, 0], (10, 1))
poses[:, 4] = -numpy.arange(10)  # t = -R C
points = rng.uniform([-1, -2, 8], [10, 2, 12], (200, 3))

# Who sees whom, and where; the noise of a pixel is known for each.
in_camera = points[None, :, :] + poses[:, None, 4:]
pixels = 800 * in_camera[..., :2] / in_camera[..., 2:] + [320, 240]
seen = ((pixels >= 0) & (pixels < [640, 480])).all(axis=2)
seen &= seen.sum(axis=0) >= 2
image, point = numpy.nonzero(seen)
sigma = rng.choice([0.3, 1.0], len(image))
xy = pixels[image, point] + sigma[:, None] * rng.normal(size=(len(image), 2))

used, point = numpy.unique(point, return_inverse=True)
start = poses.copy()
start[:, 4:] += rng.normal(scale=0.1, size=(10, 3))
problem = sheaf.Problem(
    poses=start,
    points=points[used] + rng.normal(scale=0.1, size=(len(used), 3)),
    cameras=[lens],
    image_camera=numpy.zeros(10, int),
    observation_image=image,
    observation_point=point,
    observation_xy=xy,
    observation_sigma=sigma,
)
# GPS, good to 2 cm, of every third camera: it fixes place, direction and scale, but for a turn
# about the line, which gravity in one image fixes.
for i in range(0, 10, 3):
    problem.add_centre_prior(i, -poses[i, 4:] + rng.normal(scale=0.02, size=3), sigma=0.02)
problem.add_gravity_prior(0, [0, 1, 0], sigma_rad=0.001, down=[0, 1, 0])

summary = sheaf.solve(problem, fix="intrinsics")
off = numpy.linalg.norm(problem.poses[:, 4:] - poses[:, 4:], axis=1)
print(summary)
print(f"places off by {off.mean():.4f} on average, {off.max():.4f} at most")
assert off.max() < 0.1
