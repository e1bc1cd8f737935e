#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""GTSAM, through its Python package, on a BAL file.

The words of --config, joined by '-': cholesky | qr (elimination), schur (points first) | colamd |
metis (ordering), ceres (GTSAM's preset "CeresDefaults", diagonal damping) | legacy (its default
preset), lambda=1e-4 (first damping). All arithmetic is in GTSAM's compiled code: factors and
values are made by its own BAL reader, and one call per step crosses Python.

--fix takes points, intrinsics. GTSAM's package has no projection of a point that is not a variable:
points are held by its NonlinearEquality and lenses by a constrained prior, its own ways to hold a
variable, which cost it about as much as the joint problem. What it tries and refuses within a step
does not show.
"""
import argparse
import importlib.metadata
import json
import os
import resource
import sys
import time


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("input")
    parser.add_argument("--config", default="cholesky-schur-ceres")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--max-iterations", type=int, default=50)
    parser.add_argument("--fix", default="")
    parser.add_argument("--tolerance", type=float, default=1e-12)
    parser.add_argument("--time-limit", type=float, default=float("inf"))
    parser.add_argument("--cost-target", type=float, default=-1.0)
    parser.add_argument("--out")
    return parser.parse_args()


def parameters(gtsam, config, data, fix):
    """LevenbergMarquardtParams for the words of `config`; exits with 2 on an unknown one."""
    words = config.split("-")
    words = [w for w in words if w]
    while any(w.endswith("e") and "=" in w for w in words[:-1]):  # "lambda=1e-4" was cut in two
        i = next(i for i, w in enumerate(words) if w.endswith("e") and "=" in w)
        words[i:i + 2] = [words[i] + "-" + words[i + 1]]
    p = (gtsam.LevenbergMarquardtParams.LegacyDefaults() if "legacy" in words
         else gtsam.LevenbergMarquardtParams.CeresDefaults())
    for word in words:
        if word in ("ceres", "legacy"):
            pass
        elif word == "cholesky":
            p.setLinearSolverType("MULTIFRONTAL_CHOLESKY")
        elif word == "qr":
            p.setLinearSolverType("MULTIFRONTAL_QR")
        elif word == "schur":
            order = gtsam.Ordering()
            for j in range(data.numberTracks()):
                order.push_back(gtsam.symbol("p", j))
            for i in range(data.numberCameras()):
                if "intrinsics" in fix:
                    order.push_back(gtsam.symbol("k", i))
                order.push_back(i)
            p.setOrdering(order)
        elif word in ("colamd", "metis"):
            p.setOrderingType(word.upper())
        elif word.startswith("lambda="):
            p.setlambdaInitial(float(word[7:]))
        else:
            sys.exit(f"unknown configuration '{config}'")
    p.setRelativeErrorTol(0.0)
    p.setAbsoluteErrorTol(0.0)
    return p


def cpu_s():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def peak_bytes():
    """From /proc: getrusage's figure starts at that of the program which launched this one."""
    with open("/proc/self/status") as file:
        return next(int(line.split()[1]) * 1024 for line in file if line.startswith("VmHWM:"))


def write_bal(gtsam, path, source, values, fix):
    """GTSAM looks along +z, BAL along -z: the file's rotations and translations are turned back."""
    with open(source) as file:
        cameras, points, observations = (int(n) for n in file.readline().split())
        lines = [file.readline() for _ in range(observations)]
    flip = gtsam.Rot3(1, 0, 0, 0, -1, 0, 0, 0, -1)
    with open(path, "w") as out:
        out.write(f"{cameras} {points} {observations}\n")
        out.writelines(lines)
        for i in range(cameras):
            camera = camera_of(gtsam, values, i, fix)
            cam_from_world = camera.pose().inverse()
            turn = gtsam.Rot3.Logmap(flip.compose(cam_from_world.rotation()))
            shift = flip.rotate(cam_from_world.translation())
            lens = camera.calibration()
            for value in (*turn, *shift, lens.fx(), lens.k1(), lens.k2()):
                out.write(f"{value:.17g}\n")
        for j in range(points):
            for value in values.atPoint3(gtsam.symbol("p", j)):
                out.write(f"{value:.17g}\n")


def problem_of(gtsam, data, fix):
    """Graph and start, with what is held held."""
    noise = gtsam.noiseModel.Unit.Create(2)
    start = gtsam.initialCamerasAndPointsEstimate(data)
    if "intrinsics" in fix:
        graph, values = gtsam.NonlinearFactorGraph(), gtsam.Values()
        hold = gtsam.noiseModel.Constrained.All(3)
        for i in range(data.numberCameras()):
            camera, lens = start.atPinholeCameraCal3Bundler(i), gtsam.symbol("k", i)
            values.insert(i, camera.pose())
            values.insert(lens, camera.calibration())
            graph.add(gtsam.PriorFactorCal3Bundler(lens, camera.calibration(), hold))
        for j in range(data.numberTracks()):
            track, point = data.track(j), gtsam.symbol("p", j)
            values.insert(point, start.atPoint3(point))
            for k in range(track.numberMeasurements()):
                i, pixel = track.measurement(k)
                graph.add(gtsam.GeneralSFMFactor2Cal3Bundler(pixel, noise, i, point,
                                                             gtsam.symbol("k", i)))
    else:
        graph, values = data.generalSfmFactors(noise), start
    if "points" in fix:
        for j in range(data.numberTracks()):
            point = gtsam.symbol("p", j)
            graph.add(gtsam.NonlinearEqualityPoint3(point, start.atPoint3(point)))
    return graph, values


def camera_of(gtsam, values, i, fix):
    if "intrinsics" not in fix:
        return values.atPinholeCameraCal3Bundler(i)
    return gtsam.PinholeCameraCal3Bundler(values.atPose3(i),
                                          values.atCal3Bundler(gtsam.symbol("k", i)))


def main():
    a = parse_arguments()
    fix = set(filter(None, a.fix.split(",")))
    if unknown := sorted(fix - {"points", "intrinsics"}):
        sys.exit(f"GTSAM here cannot hold {', '.join(unknown)}")
    import gtsam  # after the arguments, so that --help needs no GTSAM

    os.environ.setdefault("OMP_NUM_THREADS", str(a.threads))
    data = gtsam.SfmData.FromBalFile(a.input)
    trace = []
    cpu_start, start = cpu_s(), time.perf_counter()
    graph, values = problem_of(gtsam, data, fix)
    settings = parameters(gtsam, a.config, data, fix)
    optimizer = gtsam.LevenbergMarquardtOptimizer(graph, values, settings)
    setup = time.perf_counter() - start
    cost = optimizer.error()
    trace.append([time.perf_counter() - start, cost])
    still = 0  # steps in a row that decreased next to nothing: every peer stops at two
    while (len(trace) <= a.max_iterations and cost > a.cost_target and still < 2
           and trace[-1][0] < a.time_limit):
        optimizer.iterate()
        still = still + 1 if cost - optimizer.error() <= a.tolerance * cost else 0
        cost = optimizer.error()
        trace.append([time.perf_counter() - start, cost])
    total = time.perf_counter() - start
    cpu = cpu_s() - cpu_start
    peak = peak_bytes()
    if a.out:
        write_bal(gtsam, a.out, a.input, optimizer.values(), fix)
    steps = len(trace) - 1
    json.dump({
        "solver": "gtsam-" + importlib.metadata.version("gtsam"), "config": a.config,
        "threads": a.threads, "setup_s": setup, "trace": trace,
        "seconds_per_iteration": (trace[-1][0] - trace[0][0]) / steps if steps else 0,
        "total_s": total, "cpu_percent": 100 * cpu / total,
        "peak_bytes": peak,
        "iterations": steps, "final_cost": cost}, sys.stdout)
    print()


if __name__ == "__main__":
    main()
