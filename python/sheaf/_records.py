# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""Plain records that the compiled part takes and returns."""

from __future__ import annotations

import dataclasses
import enum
import os
from typing import TYPE_CHECKING, Any, Mapping, NamedTuple, Sequence, Tuple, Union

import numpy
import numpy.typing

if TYPE_CHECKING:
    from ._summary import Summary

Floats = numpy.typing.NDArray[numpy.float64]
Indices = numpy.typing.NDArray[numpy.uint32]
Numbers = numpy.typing.NDArray[numpy.uint64]
Flags = numpy.typing.NDArray[numpy.uint8]

CameraLike = Union[
    "Camera",
    Tuple[str, numpy.typing.ArrayLike],
    Tuple[str, numpy.typing.ArrayLike, int, int],
]
ConstraintsLike = Union[
    None, str, "os.PathLike[str]", Sequence[Union[str, "os.PathLike[str]"]], Mapping[str, Any]
]


class ErrorCode(enum.IntEnum):
    """Why a call could not do its work: the exit codes of the command."""

    usage = 2  #: arguments that contradict each other or the problem
    unreadable_input = 3  #: missing, truncated, malformed or absurd input
    no_usable_step = 4  #: the solver could not make a single step
    memory_limit = 5  #: the forecast exceeds the limit; nothing was allocated
    unwritable_output = 6  #: the output cannot be created or written


class Error(RuntimeError):
    """What the command would say and exit with."""

    code: ErrorCode

    def __init__(self, message: str, code: int = ErrorCode.usage) -> None:
        super().__init__(message)
        self.code = ErrorCode(code)

    def __reduce__(self) -> tuple[type[Error], tuple[str, int]]:
        return type(self), (str(self), int(self.code))


class Camera(NamedTuple):
    """A lens. Lengths are in pixels; docs/cameras.md has the order of the parameters."""

    model: str  #: one of sheaf.CAMERA_MODELS
    parameters: numpy.typing.ArrayLike
    width_px: int = 0  #: of its images; 0: not known
    height_px: int = 0


class Rigs(NamedTuple):
    """Cameras that move as one: an image of frame f and sensor s has the pose
    sensor_from_rig[s] o rig_from_world[f]."""

    sensor_from_rig: Floats  #: (sensors, 7)
    sensor_rig: Indices  #: the rig of each sensor
    is_reference: Flags  #: 1 where a sensor is its rig's origin
    rig_from_world: Floats  #: (frames, 7)
    frame_rig: Indices  #: the rig of each frame
    image_frame: Indices  #: the frame of each image; 2^32 - 1 (or, in arguments, -1): of no rig
    image_sensor: Indices  #: likewise its sensor


class Evaluation(NamedTuple):
    """What a state costs, by plain scalar code."""

    cost: float  #: 1/2 sum |r / sigma|^2, with what priors cost
    rms_px: float  #: per observation
    behind: Numbers  #: observations whose point lies behind the camera
    not_finite: Numbers  #: observations whose residual is not finite; not in the cost


class CleanRecord(NamedTuple):
    """What was left out, by its numbers in the problem as it was."""

    observations: int  #: fewer than before
    far_off: Numbers  #: observations, by their error
    behind: Numbers  #: observations
    in_plane: Numbers  #: observations
    at_centre: Numbers  #: observations
    repeated: Numbers  #: observations
    narrow: Numbers  #: points, by the angle of their rays
    short_tracks: Numbers  #: points


class NoiseRecord(NamedTuple):
    """What a disturbance did: X -> scale (X - center) first, where it normalised."""

    center: Floats
    scale: float
    outliers: Numbers  #: observations that were moved
    dropped_observations: int
    dropped_points: int


class Similarity(NamedTuple):
    """X -> scale R X + translation."""

    scale: float
    rotation: Floats  #: (4,): w x y z
    translation: Floats  #: (3,)


class Errors(NamedTuple):
    """How far an estimate is from a reference; lengths in the reference's units."""

    rotation_rad: Floats  #: of each common image
    translation: Floats  #: |t - t_reference|
    center: Floats  #: distances of camera centres
    point: Floats  #: distances of common points
    images: Numbers  #: (common, 2): index in the estimate and in the reference
    points: Numbers  #: likewise of points
    similarity: Similarity | None  #: that was applied to the estimate
    statistics: dict[str, Any]  #: mean, median, rms, max of each, as docs/json.md has them


@dataclasses.dataclass(frozen=True, eq=False)
class Finding:
    """Something that is wrong with a problem, or may be."""

    code: str  #: docs/json.md lists them
    grave: bool  #: False: worth a look, and common in good problems
    count: int
    of: str  #: "images", "points", "observations", ...
    first: Numbers  #: numbers of the first 1000 of them
    words: str  #: what is wrong, and what to do


class Alignment(NamedTuple):
    """What brought a problem into another frame."""

    similarity: Similarity
    inliers: int  #: places that it counts on
    images: Numbers  #: (common, 2), onto a reference
    distances: Floats  #: of their centres afterwards, in the reference's units
    survey: dict[str, Any] | None  #: into that of a survey (docs/json.md)


class WeakDirection(NamedTuple):
    """A parameter, or two that go together, which the measurements hardly determine."""

    words: str
    camera: int
    parameters: list[int]
    sigma: float  #: of one: in its unit; infinite where nothing determines it
    correlation: float  #: of two


@dataclasses.dataclass(frozen=True, eq=False)
class Covariance:
    """How well a state is known (docs/covariance.md). What is held has a covariance of 0."""

    gauge: str  #: that was used
    deficit: int  #: how many of a scene's seven freedoms the data leave
    freedoms: list[str]
    sigma: float  #: of a residual, in its unit
    sigma_estimated: bool
    loss_factor: float
    rows: int
    unknowns: int
    redundancy: float
    poses: Floats  #: (n, 6, 6): of (rho, phi), T' = exp([rho, phi]^) T, scene units and radians;
    #: of all images, or of those asked for
    centres: Floats  #: (n, 3, 3): of camera centres, world
    frames: Floats  #: (frames, 6, 6): of rig_from_world
    sensors: Floats  #: (sensors, 6, 6): of sensor_from_rig
    lenses: list[Floats]  #: of each lens p x p; 0 x 0 where it was not asked for
    points: Floats  #: (m, 3, 3), or of those asked for; not finite: not determined
    pairs: Floats  #: (k, 6, 6): (rho, phi) of a pair's first image (rows) by those of its second
    distances: Floats  #: (k, 2): between their centres, and its sigma
    observation_redundancy: Floats  #: (k, 2), where asked for
    observation_standardised: Floats  #: (k, 2): Baarda's w
    weak: list[WeakDirection]
    words: list[str]  #: sentences: gauge, sigma, what is not determined
    undetermined_points: int
    seconds: float


class PhotometricDetails(NamedTuple):
    """What the images say of a state, patch by patch."""

    point: Indices  #: of each patch that counts
    image: Indices
    xy: Floats  #: (k, 2): of its middle, pixels
    rms_grey: Floats  #: of its residuals
    sigma_grey: float  #: noise of a pixel
    sigma: Floats  #: (m, 1) of inverse depths, or (m, 3) of X, Y, Z; infinite: not determined
    of_inverse_depth: bool


@dataclasses.dataclass(frozen=True, eq=False)
class PhotometricSummary:
    """What a photometric refinement did."""

    solve: Summary  #: its numbers are grey levels where they say px
    patches_total: int
    patches_visible: int
    patches_left: int
    initial_rms_grey: float
    final_rms_grey: float
    initial_median_grey: float
    final_median_grey: float
    initial_inlier_share: float  #: |r| of at most 10 grey levels
    final_inlier_share: float
    details: PhotometricDetails  #: at the end


def plain_of(value: Any) -> Any:
    """What NumPy's arrays and numbers are in JSON."""
    if isinstance(value, (numpy.ndarray, numpy.generic)):
        return value.tolist()
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    raise TypeError(f"constraints: a {type(value).__name__} has no place in JSON")
