#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""GTSAM, through its Python package, on a BAL file.

The words of --config, joined by '-': cholesky | qr (elimination), schur (points first) | colamd |
metis (ordering), ceres (GTSAM's preset "CeresDefaults", diagonal damping) | legacy (its default
preset), lambda=1e-4 (first damping). All arithmetic is in GTSAM's compiled code: factors and
values are made by its own BAL reader, and one call per step crosses Python.
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
    parser.add_argument("--time-limit", type=float, default=float("inf"))
    parser.add_argument("--cost-target", type=float, default=-1.0)
    parser.add_argument("--out")
    return parser.parse_args()


def parameters(gtsam, config, data):
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


def write_bal(gtsam, path, source, values):
    """GTSAM looks along +z, BAL along -z: the file's rotations and translations are turned back."""
    with open(source) as file:
        cameras, points, observations = (int(n) for n in file.readline().split())
        lines = [file.readline() for _ in range(observations)]
    flip = gtsam.Rot3(1, 0, 0, 0, -1, 0, 0, 0, -1)
    with open(path, "w") as out:
        out.write(f"{cameras} {points} {observations}\n")
        out.writelines(lines)
        for i in range(cameras):
            camera = values.atPinholeCameraCal3Bundler(i)
            cam_from_world = camera.pose().inverse()
            turn = gtsam.Rot3.Logmap(flip.compose(cam_from_world.rotation()))
            shift = flip.rotate(cam_from_world.translation())
            lens = camera.calibration()
            for value in (*turn, *shift, lens.fx(), lens.k1(), lens.k2()):
                out.write(f"{value:.17g}\n")
        for j in range(points):
            for value in values.atPoint3(gtsam.symbol("p", j)):
                out.write(f"{value:.17g}\n")


def main():
    a = parse_arguments()
    import gtsam  # after the arguments, so that --help needs no GTSAM

    os.environ.setdefault("OMP_NUM_THREADS", str(a.threads))
    data = gtsam.SfmData.FromBalFile(a.input)
    trace = []
    cpu_start, start = cpu_s(), time.perf_counter()
    graph = data.generalSfmFactors(gtsam.noiseModel.Unit.Create(2))
    values = gtsam.initialCamerasAndPointsEstimate(data)
    optimizer = gtsam.LevenbergMarquardtOptimizer(graph, values, parameters(gtsam, a.config, data))
    setup = time.perf_counter() - start
    cost = optimizer.error()
    trace.append([time.perf_counter() - start, cost])
    still = 0  # steps in a row that decreased next to nothing: every peer stops at two
    while (len(trace) <= a.max_iterations and cost > a.cost_target and still < 2
           and trace[-1][0] < a.time_limit):
        optimizer.iterate()
        still = still + 1 if cost - optimizer.error() <= 1e-12 * cost else 0
        cost = optimizer.error()
        trace.append([time.perf_counter() - start, cost])
    total = time.perf_counter() - start
    cpu = cpu_s() - cpu_start
    peak = peak_bytes()
    if a.out:
        write_bal(gtsam, a.out, a.input, optimizer.values())
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
