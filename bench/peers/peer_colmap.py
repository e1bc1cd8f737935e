#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""COLMAP's bundle adjuster, through its Python package pycolmap, on a BAL file or a COLMAP model.

The words of --config, joined by '-': dense | sparse | iterative (Schur elimination, then that). --fix
takes points, poses, intrinsics, f, k, pp, camera=ID and pose=NAME, --refine takes pp (with the long
names of `sheaf solve`): by default all but the principal point moves, as in COLMAP.

A folder is a model, adjusted as it is: its lenses, shared or not, of whatever model COLMAP has.
Rotations are normalised first, since COLMAP takes them as they stand.

A BAL camera is COLMAP's RADIAL: f, k1, k2 and a principal point, held at 0. BAL looks along -z with
y up, COLMAP along +z with y down: rotations and translations are turned by half a turn about x, the
measured y changes its sign. That the two agree is checked: the cost of the start as COLMAP has it
must be that of the file, or the program ends with an error.

COLMAP gives observations behind their camera a residual of zero, so a file that has some is refused.
Its stopping rule is Ceres' function_tolerance: one step that decreases the cost by less than the
tolerance ends the run (elsewhere two do). Its costs after each step are read from the table that
Ceres prints, seven digits of them.
"""
import argparse
import contextlib
import importlib.metadata
import json
import os
import re
import resource
import sys
import tempfile
import time

import numpy as np


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("input")
    parser.add_argument("--config", default="dense")
    parser.add_argument("--fix", default="")
    parser.add_argument("--refine", default="")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--max-iterations", type=int, default=50)
    parser.add_argument("--time-limit", type=float, default=1e9)
    parser.add_argument("--tolerance", type=float, default=1e-12)
    parser.add_argument("--cost-target", type=float, help="not used: COLMAP has no such rule")
    parser.add_argument("--out")
    return parser.parse_args()


def read_bal(path):
    """(observations: n x 4, cameras: 9 each, points: 3 each)"""
    with open(path) as file:
        counts = [int(n) for n in file.readline().split()]
        numbers = np.array(file.read().split(), dtype=float)
    cameras, points, observations = counts
    ends = np.cumsum([4 * observations, 9 * cameras, 3 * points])
    if len(numbers) != ends[-1]:
        sys.exit(f"{path}: not a complete BAL file")
    parts = np.split(numbers, ends[:-1])
    return parts[0].reshape(-1, 4), parts[1].reshape(-1, 9), parts[2].reshape(-1, 3)


def rotations(angle_axis):
    """Rodrigues' formula; one 3x3 each."""
    angle = np.linalg.norm(angle_axis, axis=1)[:, None, None]
    axis = angle_axis / np.maximum(angle[:, :, 0], 1e-300)
    zero = np.zeros(len(axis))
    cross = np.stack([np.stack([zero, -axis[:, 2], axis[:, 1]], 1),
                      np.stack([axis[:, 2], zero, -axis[:, 0]], 1),
                      np.stack([-axis[:, 1], axis[:, 0], zero], 1)], 1)
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def bal_cost(observations, cameras, points):
    """1/2 sum |r|^2 and whether a point lies behind its camera."""
    camera, point = observations[:, 0].astype(int), observations[:, 1].astype(int)
    turned = np.einsum("nij,nj->ni", rotations(cameras[:, :3])[camera], points[point])
    P = turned + cameras[camera, 3:6]
    p = -P[:, :2] / P[:, 2:]
    n = np.sum(p * p, axis=1)
    f, k1, k2 = cameras[camera, 6:9].T
    r = (f * (1 + n * (k1 + k2 * n)))[:, None] * p - observations[:, 2:4]
    return 0.5 * np.sum(r * r), bool(np.any(P[:, 2] >= 0))


FLIP = np.diag([1.0, -1.0, -1.0])


def build(pycolmap, observations, cameras, points):
    """COLMAP's reconstruction of the problem, every observation a track's element; its point ids."""
    reconstruction = pycolmap.Reconstruction()
    R = rotations(cameras[:, :3])
    by_image = [np.flatnonzero(observations[:, 0] == i) for i in range(len(cameras))]
    for i, (camera, mine) in enumerate(zip(cameras, by_image)):
        one = pycolmap.Camera(camera_id=i + 1, model="RADIAL", width=1, height=1,
                              params=[camera[6], 0, 0, camera[7], camera[8]])
        reconstruction.add_camera_with_trivial_rig(one)
        pose = pycolmap.Rigid3d(pycolmap.Rotation3d(FLIP @ R[i]), FLIP @ camera[3:6])
        keypoints = observations[mine, 2:4] * [1, -1]
        image = pycolmap.Image(name=str(i), keypoints=keypoints, camera_id=i + 1, image_id=i + 1)
        reconstruction.add_image_with_trivial_frame(image, pose)
    place = np.empty(len(observations), dtype=int)  # of an observation in its image
    for mine in by_image:
        place[mine] = np.arange(len(mine))
    tracks = [[] for _ in points]
    for k, (camera, point) in enumerate(observations[:, :2].astype(int)):
        tracks[point].append(pycolmap.TrackElement(camera + 1, place[k]))
    ids = [reconstruction.add_point3D(X, pycolmap.Track(elements))
           for X, elements in zip(points, tracks)]
    return reconstruction, ids


LONG = {"focal": "f", "distortion": "k", "principal-point": "pp"}


def choices(a):
    """What is held and what moves besides, by the short names."""
    fix, refine = ({LONG.get(word, word) for word in text.split(",") if word}
                   for text in (a.fix, a.refine))
    known = {"points", "poses", "intrinsics", "f", "k", "pp"}
    unknown = sorted(word for word in fix - known if not word.startswith(("camera=", "pose=")))
    if unknown := unknown + sorted(refine - {"pp"}):
        sys.exit(f"COLMAP here cannot hold or refine {', '.join(unknown)}")
    if "intrinsics" in fix:
        fix |= {"f", "k", "pp"} - refine
    if fix & refine:
        sys.exit("the principal point is both held and refined")
    return fix, refine


def options_of(pycolmap, a, fix, refine):
    solvers = {"dense": "DENSE_SCHUR", "sparse": "SPARSE_SCHUR", "iterative": "ITERATIVE_SCHUR"}
    if a.config not in solvers:
        sys.exit(f"unknown configuration '{a.config}'")
    options = pycolmap.BundleAdjustmentOptions()
    options.refine_principal_point = "pp" in refine
    options.refine_focal_length = "f" not in fix
    options.refine_extra_params = "k" not in fix
    options.refine_points3D = "points" not in fix
    options.refine_rig_from_world = "poses" not in fix
    options.print_summary = False
    options.ceres.auto_select_solver_type = False
    options.ceres.min_num_residuals_for_cpu_multi_threading = 0
    solver = options.ceres.solver_options
    solver.linear_solver_type = solvers[a.config]
    if a.config == "iterative":
        solver.preconditioner_type = "SCHUR_JACOBI"
    solver.num_threads = a.threads
    solver.max_num_iterations = a.max_iterations
    solver.max_solver_time_in_seconds = a.time_limit
    solver.function_tolerance = a.tolerance
    solver.minimizer_progress_to_stdout = True
    solver.logging_type = type(solver.logging_type).PER_MINIMIZER_ITERATION
    solver.gradient_tolerance = solver.parameter_tolerance = 0
    return options


def write_bal(path, source, cameras, points):
    with open(source) as file:
        header = file.readline()
        lines = [file.readline() for _ in range(int(header.split()[2]))]
    with open(path, "w") as out:
        out.write(header)
        out.writelines(lines)
        out.writelines(f"{x:.17g}\n" for x in (*cameras.ravel(), *points.ravel()))


def angle_axis(q):
    """Of a unit quaternion x, y, z, w."""
    q = q if q[3] >= 0 else -q
    sine = np.linalg.norm(q[:3])
    return q[:3] * (2 * np.arctan2(sine, q[3]) / sine if sine > 1e-12 else 2)


def state_of(pycolmap, reconstruction, point_ids, images):
    cameras = np.empty((images, 9))
    for i in range(images):
        pose = reconstruction.image(i + 1).cam_from_world()
        cameras[i, :3] = angle_axis(pycolmap.Rotation3d(FLIP @ pose.rotation.matrix()).quat)
        cameras[i, 3:6] = FLIP @ pose.translation
        cameras[i, 6:] = reconstruction.camera(i + 1).params[[0, 3, 4]]
    return cameras, np.array([reconstruction.point3D(j).xyz for j in point_ids])


@contextlib.contextmanager
def printed_to(file):
    """What compiled code prints on stdout goes to a file."""
    sys.stdout.flush()
    own = os.dup(1)
    os.dup2(file.fileno(), 1)
    try:
        yield
    finally:
        os.dup2(own, 1)
        os.close(own)


def trace_of(table, setup, first, last):
    """[time_s, cost held] from Ceres' table: iter, cost, change, gradient, step, ratio, radius, ls_iter,
    iter_time, total_time. A refused step has a ratio that is not above 0. The first and the last
    cost are known in full."""
    trace = []
    for line in table.splitlines():
        words = line.split()
        if len(words) < 10 or not re.fullmatch(r"\d+", words[0]):
            continue
        refused = trace and float(words[5]) <= 0
        cost = trace[-1][1] if refused else float(words[1]) if trace else first
        trace.append([setup + float(words[9]), cost])
    end = trace[-1][1] if trace else last
    return [[t, last if cost == end and k else cost] for k, (t, cost) in enumerate(trace)]


def cpu_s():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def peak_bytes():
    """From /proc: getrusage's figure starts at that of the program which launched this one."""
    with open("/proc/self/status") as file:
        return next(int(line.split()[1]) * 1024 for line in file if line.startswith("VmHWM:"))


class BalProblem:
    """A BAL file as COLMAP has it."""
    def __init__(self, pycolmap, path):
        self.path = path
        self.observations, cameras, points = read_bal(path)
        self.start_cost, behind = bal_cost(self.observations, cameras, points)
        if behind:
            sys.exit("COLMAP sets residuals behind a camera to zero: this file has some")
        self.images = len(cameras)
        self.reconstruction, self.points = build(pycolmap, self.observations, cameras, points)

    def check_start(self, cost):
        if abs(cost - self.start_cost) > 1e-9 * self.start_cost:
            sys.exit(f"COLMAP's cost of the start is {cost!r}, that of the file {self.start_cost!r}")

    def write(self, pycolmap, path):
        write_bal(path, self.path, *state_of(pycolmap, self.reconstruction, self.points, self.images))


class Model:
    """A COLMAP model. Whoever runs this checks the cost of the start: it knows the model too."""
    def __init__(self, pycolmap, path):
        self.reconstruction = pycolmap.Reconstruction(path)
        for frame in self.reconstruction.frames.values():
            pose = frame.rig_from_world
            quaternion = pose.rotation.quat / np.linalg.norm(pose.rotation.quat)
            frame.rig_from_world = pycolmap.Rigid3d(pycolmap.Rotation3d(quaternion), pose.translation)

    def check_start(self, cost):
        pass

    def write(self, pycolmap, path):
        os.makedirs(path, exist_ok=True)
        self.reconstruction.write_binary(path)


def config_of(pycolmap, reconstruction, fix):
    """All images, and the single cameras and poses that are held."""
    config = pycolmap.BundleAdjustmentConfig()
    for image_id in reconstruction.images:
        config.add_image(image_id)
    by_name = {image.name: image for image in reconstruction.images.values()}
    for word in fix:
        kind, _, who = word.partition("=")
        if kind == "camera":
            if not who.isdigit() or int(who) not in reconstruction.cameras:
                sys.exit(f"COLMAP here holds cameras by id: there is no {who}")
            config.set_constant_cam_intrinsics(int(who))
        elif kind == "pose":
            if who not in by_name:
                sys.exit(f"COLMAP here holds poses by an image's whole name: there is no {who}")
            config.set_constant_rig_from_world_pose(by_name[who].frame_id)
    return config


def main():
    a = parse_arguments()
    fix, refine = choices(a)
    import pycolmap  # after the arguments, so that --help needs no COLMAP

    options = options_of(pycolmap, a, fix, refine)
    problem = (Model if os.path.isdir(a.input) else BalProblem)(pycolmap, a.input)
    reconstruction = problem.reconstruction

    cpu_start, start = cpu_s(), time.perf_counter()
    config = config_of(pycolmap, reconstruction, fix)
    adjuster = pycolmap.create_default_ceres_bundle_adjuster(options, config, reconstruction)
    setup = time.perf_counter() - start
    with tempfile.TemporaryFile("w+") as table:
        with printed_to(table):
            summary = adjuster.solve().ceres_summary
        table.seek(0)
        printed = table.read()
    total = time.perf_counter() - start
    cpu, peak = cpu_s() - cpu_start, peak_bytes()
    problem.check_start(summary.initial_cost)
    if a.out:
        problem.write(pycolmap, a.out)
    trace = trace_of(printed, setup, summary.initial_cost, summary.final_cost)
    steps = len(trace) - 1
    json.dump({
        "solver": "colmap-" + importlib.metadata.version("pycolmap"), "config": a.config,
        "threads": a.threads, "setup_s": setup, "trace": trace,
        "seconds_per_iteration": (trace[-1][0] - trace[0][0]) / steps if steps else 0,
        "total_s": total, "cpu_percent": 100 * cpu / total, "peak_bytes": peak,
        "iterations": steps, "final_cost": summary.final_cost}, sys.stdout)
    print()


if __name__ == "__main__":
    main()
