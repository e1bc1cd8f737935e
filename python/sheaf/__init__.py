# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""Bundle adjustment: NumPy in, NumPy out. docs/python.md is the user's page."""

from ._records import (
    Alignment,
    Camera,
    CleanRecord,
    Covariance,
    Error,
    ErrorCode,
    Errors,
    Evaluation,
    Finding,
    NoiseRecord,
    PhotometricDetails,
    PhotometricSummary,
    Rigs,
    Similarity,
    WeakDirection,
)
from ._sheaf import (
    VERSION,
    Iteration,
    PhotometricFolder,
    Problem,
    Solver,
    align,
    camera_dtype,
    camera_models,
    check,
    convert,
    covariance,
    evaluate,
    generate,
    generate_photometric,
    marginalise,
    perturb,
    photometric,
    read,
    read_photometric,
    slide,
    solve,
)
from ._summary import Summary

__version__: str = VERSION

#: Names of the camera models, by the numbers that records of cameras have.
CAMERA_MODELS: tuple[str, ...] = camera_models()

for _name in ("Camera", "Error", "ErrorCode", "Rigs", "Summary"):
    globals()[_name].__module__ = "sheaf"  # as tracebacks and pickles have them
del _name

__all__ = [
    "CAMERA_MODELS",
    "Alignment",
    "Camera",
    "CleanRecord",
    "Covariance",
    "Error",
    "ErrorCode",
    "Errors",
    "Evaluation",
    "Finding",
    "Iteration",
    "NoiseRecord",
    "PhotometricDetails",
    "PhotometricFolder",
    "PhotometricSummary",
    "Problem",
    "Rigs",
    "Similarity",
    "Solver",
    "Summary",
    "WeakDirection",
    "__version__",
    "align",
    "camera_dtype",
    "camera_models",
    "check",
    "convert",
    "covariance",
    "evaluate",
    "generate",
    "generate_photometric",
    "marginalise",
    "perturb",
    "photometric",
    "read",
    "read_photometric",
    "slide",
    "solve",
]
