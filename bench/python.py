#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""Bundle adjustment in Python, from arrays to arrays: Sheaf, pycolmap and SciPy's cookbook.

  python.py PROBLEM [--runs 5] [--threads 2] [--solvers sheaf,pycolmap,scipy]
  python.py PROBLEM --command SHEAF       sheaf's solve from arrays beside the command's own

PROBLEM is a BAL file. Each run is a process of its own, that reads the file by the module sheaf (which
must be importable, such as by PYTHONPATH=build/ci/python), imports its library, and then measures, from
NumPy arrays in the layout of the cookbook to the same arrays refined: seconds to build the library's own
problem, to solve, and to read the arrays back, and by how much the peak of the resident memory grows.
The runs of the solvers take turns; medians are told. pycolmap holds principal points and refines focal
lengths and distortion, as Sheaf does; gradients are Ceres'. SciPy is least_squares as its cookbook calls
it (trf, finite differences in a sparse pattern, x_scale='jac', ftol=1e-4), on one thread whatever
--threads says. Costs are sheaf's plain evaluation of the arrays that came back. Libraries that are not
installed are named and left out.
"""
import argparse
import importlib.util
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time

STEPS = ("build_s", "solve_s", "read_s")


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("problem")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--solvers", default="sheaf,pycolmap,scipy")
    parser.add_argument("--command", metavar="SHEAF", help="the command, to compare its solve with")
    parser.add_argument("--one", help="measure one run: used by itself")
    return parser.parse_args()


def peak_bytes():
    """The most that this process has been resident with since the last reset."""
    with open("/proc/self/status", encoding="ascii") as status:
        return next(1024 * int(line.split()[1]) for line in status if line.startswith("VmHWM"))


def reset_peak():
    with open("/proc/self/clear_refs", "w", encoding="ascii") as control:
        control.write("5")


class Steps:
    """Seconds from one call to the next."""

    def __init__(self):
        self.seconds, self.last = [], time.perf_counter()

    def done(self):
        now = time.perf_counter()
        self.seconds.append(now - self.last)
        self.last = now


def by_sheaf(arrays, threads):
    import sheaf

    steps = Steps()
    problem = sheaf.Problem.from_bal(*arrays)
    steps.done()
    sheaf.solve(problem, threads=threads)
    steps.done()
    cameras, points, *_ = problem.to_bal()
    steps.done()
    return cameras, points, steps.seconds


def reconstruction_of(arrays):
    """As a user writes it: a camera, a rig and an image each, then points and their tracks."""
    import numpy
    import pycolmap

    cameras, points, image, point, xy = arrays
    rec = pycolmap.Reconstruction()
    turn = numpy.diag([1.0, -1.0, -1.0])  # BAL looks along -z with y up
    by_image = [numpy.flatnonzero(image == i) for i in range(len(cameras))]
    for i, row in enumerate(cameras):
        angle = numpy.linalg.norm(row[:3])
        axis = row[:3] / angle if angle > 0 else row[:3]
        K = numpy.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
        R = numpy.eye(3) + numpy.sin(angle) * K + (1 - numpy.cos(angle)) * (K @ K)
        pose = pycolmap.Rigid3d(pycolmap.Rotation3d(turn @ R), turn @ row[3:6])
        rec.add_camera_with_trivial_rig(pycolmap.Camera(
            camera_id=i + 1, model="RADIAL", width=10000, height=10000,
            params=[row[6], 0.0, 0.0, row[7], row[8]]))
        picture = pycolmap.Image(name=str(i), keypoints=xy[by_image[i]] * [1, -1],
                                 camera_id=i + 1, image_id=i + 1)
        rec.add_image_with_trivial_frame(picture, pose)
    feature = numpy.empty(len(image), int)
    for rows in by_image:
        feature[rows] = numpy.arange(len(rows))
    order = numpy.argsort(point, kind="stable")
    ends = numpy.cumsum(numpy.bincount(point, minlength=len(points)))
    images, features, begin = (image[order] + 1).tolist(), feature[order].tolist(), 0
    for X, end in zip(points, ends.tolist()):
        track = pycolmap.Track()
        for k in range(begin, end):
            track.add_element(images[k], features[k])
        rec.add_point3D(X, track)
        begin = end
    return rec


def by_pycolmap(arrays, threads):
    import numpy
    import pycolmap

    steps = Steps()
    rec = reconstruction_of(arrays)
    steps.done()
    options = pycolmap.BundleAdjustmentOptions()
    options.print_summary = False
    options.ceres.solver_options.num_threads = threads
    options.ceres.solver_options.function_tolerance = 1e-8
    options.ceres.solver_options.max_num_iterations = 50
    config = pycolmap.BundleAdjustmentConfig()
    for image_id in rec.images:
        config.add_image(image_id)
    pycolmap.create_default_bundle_adjuster(options, config, rec).solve()
    steps.done()
    turn = numpy.diag([1.0, -1.0, -1.0])
    cameras = []
    for image_id in sorted(rec.images):
        pose, lens = rec.images[image_id].cam_from_world(), rec.cameras[image_id].params
        R = pycolmap.Rotation3d(turn @ pose.rotation.matrix())
        q = R.quat if R.quat[3] >= 0 else -R.quat
        length = numpy.linalg.norm(q[:3])
        phi = q[:3] * (2 * numpy.arctan2(length, q[3]) / length if length > 0 else 2)
        cameras.append(numpy.concatenate([phi, turn @ pose.translation, [lens[0], *lens[3:]]]))
    points = numpy.array([rec.points3D[i].xyz for i in sorted(rec.points3D)])
    steps.done()
    return numpy.array(cameras), points, steps.seconds


def by_scipy(arrays, threads):
    import numpy
    from scipy.optimize import least_squares
    from scipy.sparse import lil_matrix

    cameras, points, image, point, xy = arrays
    n, m = len(cameras), len(points)

    def rotate(X, phi):
        theta = numpy.linalg.norm(phi, axis=1)[:, None]
        with numpy.errstate(invalid="ignore"):
            v = numpy.nan_to_num(phi / theta)
        dot = numpy.sum(X * v, axis=1)[:, None]
        return numpy.cos(theta) * X + numpy.sin(theta) * numpy.cross(v, X) + \
            dot * (1 - numpy.cos(theta)) * v

    def residuals(x):
        c, X = x[:9 * n].reshape(n, 9)[image], x[9 * n:].reshape(m, 3)[point]
        P = rotate(X, c[:, :3]) + c[:, 3:6]
        p = -P[:, :2] / P[:, 2, None]
        r2 = numpy.sum(p**2, axis=1)
        return ((c[:, 6] * (1 + c[:, 7] * r2 + c[:, 8] * r2**2))[:, None] * p - xy).ravel()

    steps = Steps()
    image, point = image.astype(int), point.astype(int)
    A = lil_matrix((2 * len(image), 9 * n + 3 * m), dtype=int)
    i = numpy.arange(len(image))
    for s in range(9):
        A[2 * i, image * 9 + s] = 1
        A[2 * i + 1, image * 9 + s] = 1
    for s in range(3):
        A[2 * i, n * 9 + point * 3 + s] = 1
        A[2 * i + 1, n * 9 + point * 3 + s] = 1
    x = numpy.hstack((cameras.ravel(), points.ravel()))
    steps.done()
    found = least_squares(residuals, x, jac_sparsity=A, x_scale="jac", ftol=1e-4, method="trf")
    steps.done()
    steps.done()
    return found.x[:9 * n].reshape(n, 9), found.x[9 * n:].reshape(m, 3), steps.seconds


SOLVERS = {"sheaf": by_sheaf, "pycolmap": by_pycolmap, "scipy": by_scipy}


def measure(name, path, threads):
    """One run, in this process."""
    import sheaf

    if name != "sheaf":
        importlib.import_module({"scipy": "scipy.optimize"}.get(name, name))
    problem = sheaf.read(path)
    arrays = problem.to_bal()
    del problem
    reset_peak()
    before = peak_bytes()
    cameras, points, seconds = SOLVERS[name](arrays, threads)
    grown = peak_bytes() - before
    cost = sheaf.Problem.from_bal(cameras, points, *arrays[2:]).evaluate().cost
    return {**dict(zip(STEPS, seconds)), "total_s": sum(seconds), "peak_bytes": grown, "cost": cost}


def run_one(name, arguments):
    words = [sys.executable, __file__, arguments.problem, "--one", name,
             "--threads", str(arguments.threads)]
    ran = subprocess.run(words, capture_output=True, text=True, check=False)
    if ran.returncode != 0:
        sys.exit(f"{name}: {ran.stderr.strip().splitlines()[-1]}")
    return json.loads(ran.stdout)


def run_command(arguments):
    """Set-up and solve of the command, by its own clock, and the peak of its process."""
    with tempfile.TemporaryDirectory() as folder:
        document = os.path.join(folder, "summary.json")
        subprocess.run([arguments.command, "solve", arguments.problem, "--json", document, "--quiet",
                        "--threads", str(arguments.threads)], check=True, capture_output=True)
        with open(document, encoding="utf-8") as file:
            told = json.load(file)
    seconds = told["time"]["setup_s"] + told["time"]["solve_s"]
    return {"build_s": 0.0, "solve_s": seconds, "read_s": 0.0, "total_s": seconds,
            "peak_bytes": told["memory"]["peak_bytes"], "cost": told["final_cost"]}


def main():
    arguments = parse_arguments()
    if arguments.one:
        print(json.dumps(measure(arguments.one, arguments.problem, arguments.threads)))
        return
    names = arguments.solvers.split(",")
    for name in [name for name in names if importlib.util.find_spec(name) is None]:
        print(f"{name} is not installed: left out", file=sys.stderr)
        names.remove(name)
    runs = {name: [] for name in names}
    if arguments.command:
        runs["the command"] = []
    for _ in range(arguments.runs):
        for name, list_of in runs.items():
            list_of.append(run_command(arguments) if name == "the command"
                           else run_one(name, arguments))
    print("| from arrays to arrays | build, s | solve, s | read, s | in all, s | peak, MB | cost |")
    print("|---|--:|--:|--:|--:|--:|--:|")
    for name, list_of in runs.items():
        middle = {key: statistics.median(run[key] for run in list_of) for key in list_of[0]}
        print(f"| {name} | {middle['build_s']:.3f} | {middle['solve_s']:.3f} | "
              f"{middle['read_s']:.3f} | {middle['total_s']:.3f} | "
              f"{middle['peak_bytes'] / 1e6:.0f} | {middle['cost']:.6g} |")


if __name__ == "__main__":
    main()
