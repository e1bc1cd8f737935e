# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""GTSAM's SfmData: cameras of Cal3Bundler, which are RADIAL lenses, and tracks.

Only methods of the objects are used, so that any release of GTSAM (or a stand-in) will do.
"""

from __future__ import annotations

import importlib
from typing import Any

import numpy

from ._records import Error, ErrorCode
from ._sheaf import Problem


def _quaternion(R: numpy.typing.NDArray[numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
    """Of a rotation matrix, w x y z, by the largest of its components."""
    squares = 1 + numpy.array(
        [
            R[0, 0] + R[1, 1] + R[2, 2],
            R[0, 0] - R[1, 1] - R[2, 2],
            R[1, 1] - R[0, 0] - R[2, 2],
            R[2, 2] - R[0, 0] - R[1, 1],
        ]
    )
    k = int(numpy.argmax(squares))
    x, y, z = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    a, b, c = R[1, 0] + R[0, 1], R[0, 2] + R[2, 0], R[2, 1] + R[1, 2]
    s = squares[k]
    q = numpy.array([[s, x, y, z], [x, s, a, b], [y, a, s, c], [z, b, c, s]][k])
    return numpy.asarray(q / numpy.linalg.norm(q), numpy.float64)


def _matrix(q: numpy.typing.NDArray[numpy.float64]) -> numpy.typing.NDArray[numpy.float64]:
    w, x, y, z = q
    return numpy.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _camera_row(camera: Any) -> tuple[numpy.typing.NDArray[numpy.float64], list[float]]:
    """Pose (cam_from_world) and the parameters of RADIAL."""
    world_from_cam, K = camera.pose(), camera.calibration()
    R = numpy.asarray(world_from_cam.rotation().matrix(), numpy.float64).T
    t = -R @ numpy.asarray(world_from_cam.translation(), numpy.float64).reshape(3)
    return numpy.concatenate([_quaternion(R), t]), [K.fx(), K.px(), K.py(), K.k1(), K.k2()]


def _measurements(track: Any) -> tuple[Any, Any]:
    """Images and pixels, at once where the release of GTSAM can."""
    if hasattr(track, "indexVector") and hasattr(track, "measurementMatrix"):
        return (
            numpy.asarray(track.indexVector()).reshape(-1),
            numpy.asarray(track.measurementMatrix(), numpy.float64).reshape(-1, 2),
        )
    pairs = [track.measurement(k) for k in range(track.numberMeasurements())]
    return (
        numpy.array([image for image, _ in pairs], numpy.int64),
        numpy.array([uv for _, uv in pairs], numpy.float64).reshape(-1, 2),
    )


def problem_from(data: Any) -> Problem:
    rows = [_camera_row(data.camera(i)) for i in range(data.numberCameras())]
    tracks = [data.track(j) for j in range(data.numberTracks())]
    parts = [_measurements(track) for track in tracks]
    lengths = [len(images) for images, _ in parts]
    return Problem(
        poses=numpy.array([pose for pose, _ in rows], numpy.float64).reshape(-1, 7),
        points=numpy.array([track.point3() for track in tracks], numpy.float64).reshape(-1, 3),
        cameras=[("RADIAL", parameters) for _, parameters in rows],
        image_camera=numpy.arange(len(rows)),
        observation_image=numpy.concatenate([i for i, _ in parts]).astype(numpy.int64),
        observation_point=numpy.repeat(numpy.arange(len(tracks)), lengths),
        observation_xy=numpy.concatenate([uv for _, uv in parts]),
    )


def sfm_data_of(problem: Problem, gtsam: Any = None) -> Any:
    if gtsam is None:
        try:
            gtsam = importlib.import_module("gtsam")
        except ImportError:
            raise Error("to_gtsam needs the package gtsam", ErrorCode.usage) from None
    radial = problem.without_bal_cameras()
    out = gtsam.SfmData()
    for pose, lens in zip(radial.poses, radial.image_camera):
        camera = radial.camera(int(lens))
        parameters = dict(zip(_NAMES.get(camera.model, ()), numpy.asarray(camera.parameters)))
        if not parameters:
            raise Error(
                f"Cal3Bundler is not {camera.model}: SIMPLE_PINHOLE, SIMPLE_RADIAL, RADIAL or BAL "
                "lenses are needed",
                ErrorCode.usage,
            )
        f, cx, cy = (float(parameters[name]) for name in ("f", "cx", "cy"))
        k1, k2 = (float(parameters.get(name, 0.0)) for name in ("k1", "k2"))
        R = _matrix(pose[:4]).T
        out.addCamera(
            gtsam.PinholeCameraCal3Bundler(
                gtsam.Pose3(gtsam.Rot3(R), -R @ pose[4:]), gtsam.Cal3Bundler(f, k1, k2, cx, cy)
            )
        )
    order = numpy.argsort(radial.observation_point, kind="stable")
    ends = numpy.cumsum(numpy.bincount(radial.observation_point, minlength=radial.num_points))
    images, xy = radial.observation_image[order].tolist(), radial.observation_xy[order]
    begin = 0
    for point, end in zip(radial.points, ends.tolist()):
        track = gtsam.SfmTrack(point)
        for k in range(begin, end):
            track.addMeasurement(images[k], xy[k])
        out.addTrack(track)
        begin = end
    return out


_NAMES = {
    "SIMPLE_PINHOLE": ("f", "cx", "cy"),
    "SIMPLE_RADIAL": ("f", "cx", "cy", "k1"),
    "RADIAL": ("f", "cx", "cy", "k1", "k2"),
}
