# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""Reconstructions of pycolmap, by a COLMAP model in memory.

A model's files hold all of a reconstruction and both sides read and write them in C++: going through
each point and track in Python takes many times longer.
"""

from __future__ import annotations

import importlib
import os
import tempfile
from typing import Any

from ._records import Error, ErrorCode
from ._sheaf import Problem, read


def _folder() -> tempfile.TemporaryDirectory[str]:
    """In memory where the system has such a place, and there is room in it as a rule."""
    memory = "/dev/shm"
    usable = os.path.isdir(memory) and os.access(memory, os.W_OK)
    return tempfile.TemporaryDirectory(prefix="sheaf-", dir=memory if usable else None)


def problem_from(rec: Any) -> Problem:
    with _folder() as folder:
        try:
            rec.write_binary(folder)
        except AttributeError:
            raise TypeError(
                f"expected a pycolmap.Reconstruction, not {type(rec).__name__}"
            ) from None
        return read(folder)


def reconstruction_of(problem: Problem, rec: Any = None) -> Any:
    if rec is None:
        try:
            pycolmap = importlib.import_module("pycolmap")
        except ImportError:
            raise Error("to_pycolmap needs the package pycolmap", ErrorCode.usage) from None
        rec = pycolmap.Reconstruction()
    with _folder() as folder:
        problem.write(folder, format="colmap")
        rec.read_binary(folder)
    return rec
