# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""A program that type checkers must accept, and whose wrong lines they must find."""

import numpy

import sheaf

start, truth = sheaf.generate(cameras=8, points=300)
summary: sheaf.Summary = sheaf.solve(start, loss="huber:1.5", solver="dense", time_limit=None)
cost: float = summary.final_cost
points: numpy.typing.NDArray[numpy.float64] = start.points
errors: sheaf.Errors = sheaf.evaluate(start, truth)
lens: sheaf.Camera = start.camera(0)
pose_sigmas = numpy.sqrt(sheaf.covariance(start).poses.diagonal(axis1=1, axis2=2))


def callback(iteration: sheaf.Iteration) -> bool:
    return iteration.cost > 1


sheaf.solve(start, callback=callback, constraints={"positions": []})
sheaf.solve(start, solver="quick")  # type: ignore[arg-type]
sheaf.solve(start, iterations=3)  # type: ignore[call-arg]
sheaf.solve(3)  # type: ignore[arg-type]
