# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""From pycolmap and back: the reconstruction keeps its ids, names, colours and features."""

import sys

import sheaf

try:
    import pycolmap
except ImportError:
    print("pycolmap is not installed: skipped")
    sys.exit(77)

# In earnest: rec = pycolmap.Reconstruction("sparse/0").
start, _ = sheaf.generate(rigs="stereo", frames=20, points=1000)
rec = start.to_pycolmap()
assert isinstance(rec, pycolmap.Reconstruction)

problem = sheaf.Problem.from_pycolmap(rec)
summary = sheaf.solve(problem, loss="cauchy:1.5", refine="pp")
print(summary)
problem.to_pycolmap(rec)
rec.update_point_3d_errors()
print(f"{rec.num_reg_images()} images, mean error {rec.compute_mean_reprojection_error():.3f} px")
