# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""What a solve did."""

from __future__ import annotations

import dataclasses
import html
from typing import Any

import numpy
import numpy.typing

from ._records import Numbers


@dataclasses.dataclass(frozen=True, eq=False)
class Summary:
    """What happened. Costs are 1/2 sum rho(|r|^2) in px^2; docs/python.md tells of each field."""

    initial_cost: float  #: with the first round's scale of the loss
    final_cost: float  #: with the last round's
    initial_plain_cost: float  #: 1/2 sum |r|^2, whatever the loss
    final_plain_cost: float
    initial_rms_px: float  #: per observation
    final_rms_px: float
    initial_terms: dict[str, float]  #: what of the cost is the priors', by their kinds
    final_terms: dict[str, float]
    at_bounds: list[dict[str, Any]]  #: parameters that ended at a bound
    termination: str  #: "cost_converged", ... : docs/json.md lists them
    words: str  #: the reason for stopping, as a sentence
    iterations: numpy.typing.NDArray[numpy.void]  #: records: index, cost, accepted, damping, ...
    recoveries: list[dict[str, Any]]
    loss: str
    rounds: list[dict[str, Any]]  #: of the loss's scale
    final_sigma_px: float  #: estimated at the end, for an automatic scale
    solver: str
    solver_reason: str
    solver_changes: list[dict[str, Any]]
    points: str  #: the coordinates in which points stepped
    points_reason: str
    precision: str
    simd: str
    threads: int
    forecast_bytes: int  #: predicted peak resident size of the process
    setup_s: float
    solve_s: float
    resumed_after: int  #: the step after which a checkpoint was gone on from; -1: none was
    checkpoints: int  #: written by this run
    checkpoint_failure: str  #: why one could not be; "": none failed
    behind_camera_before: Numbers  #: observations
    behind_camera_after: Numbers
    rejected_observations: Numbers  #: left out (cheirality="hold-out")
    usable: bool  #: a step was made, or none was needed
    survey: dict[str, Any] | None = None  #: what became of the constraints (docs/json.md)

    def to_dict(self) -> dict[str, Any]:
        """The fields as plain Python: lists in place of arrays, a dict for each iteration."""
        out: dict[str, Any] = {}
        for field in dataclasses.fields(self):
            value = getattr(self, field.name)
            if field.name == "iterations":
                names = value.dtype.names
                value = [dict(zip(names, record)) for record in value.tolist()]
            elif isinstance(value, numpy.ndarray):
                value = value.tolist()
            out[field.name] = value
        return out

    def __repr__(self) -> str:
        steps = max(len(self.iterations) - 1, 0)
        return (
            f"<sheaf.Summary: cost {self.initial_cost:.9e} -> {self.final_cost:.9e} in {steps} "
            f"iterations; {self.words}>"
        )

    def _repr_html_(self) -> str:
        rows = [
            ("cost", f"{self.initial_cost:.9e} &rarr; {self.final_cost:.9e}"),
            ("rms", f"{self.initial_rms_px:.6g} &rarr; {self.final_rms_px:.6g} px"),
            ("iterations", str(max(len(self.iterations) - 1, 0))),
            ("stopped", html.escape(self.words)),
            ("solver", html.escape(f"{self.solver} ({self.solver_reason})")),
            ("time", f"set-up {self.setup_s:.3f} s, solve {self.solve_s:.3f} s"),
        ]
        body = "".join(
            f'<tr><th style="text-align:left">{name}</th>'
            f'<td style="text-align:left">{value}</td></tr>'
            for name, value in rows
        )
        return f"<table>{body}</table>{_curve(self.iterations)}"


def _curve(iterations: numpy.typing.NDArray[numpy.void]) -> str:
    """The cost over the iterations as SVG, on a logarithmic axis; nothing where there is no
    curve."""
    costs = iterations["cost"]
    if len(costs) < 2 or not numpy.all(numpy.isfinite(costs)) or not numpy.all(costs > 0):
        return ""
    width, height, margin = 360, 120, 8
    logs = numpy.log10(costs)
    span = max(float(logs.max() - logs.min()), 1e-12)
    x = margin + (width - 2 * margin) * numpy.arange(len(logs)) / (len(logs) - 1)
    y = height - margin - (height - 2 * margin) * (logs - logs.min()) / span
    line = " ".join(f"{a:.1f},{b:.1f}" for a, b in zip(x, y))
    dots = "".join(f'<circle cx="{a:.1f}" cy="{b:.1f}" r="2.5"/>' for a, b in zip(x, y))
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" role="img" '
        f'aria-label="cost over the iterations, logarithmic"><g fill="currentColor">{dots}</g>'
        f'<polyline points="{line}" fill="none" stroke="currentColor"/></svg>'
    )
