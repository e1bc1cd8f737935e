#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""Scenes of rigs, solved by Sheaf and by COLMAP in turns: rigs.py SHEAF [--only TEXT] [--runs N]

Each scene is made by `sheaf generate --rigs` with disturbed sensors. Rows are its sensors refined, held,
and the same images free (the model without its rigs and frames). One thread each, the same tolerance;
COLMAP through pycolmap, by sparse Schur elimination, in a process of its own. Seconds are the clock's
from arrays in memory to the end of the solve; with --cpu the processor's. Costs are those that
`sheaf info` finds in the models that both have written. Without pycolmap its columns stay empty.
"""
import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time

SCENES = [(kind, frames, camera) for kind in ("stereo", "around") for frames in (40, 200)
          for camera in ("OPENCV", "SIMPLE_RADIAL")]
POINTS_PER_FRAME = {"stereo": 100, "around": 200}
WAYS = ("refined", "held", "free")


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sheaf", help="the command, or the model where --colmap is given")
    parser.add_argument("--only", default="", help="scenes and ways whose name has this text")
    parser.add_argument("--runs", type=int, default=5)
    parser.add_argument("--tolerance", type=float, default=1e-10)
    parser.add_argument("--max-iterations", type=int, default=100)
    parser.add_argument("--cpu", action="store_true", help="processor seconds in place of the clock's")
    parser.add_argument("--colmap", metavar="OUT", help="solve one model by pycolmap: used by itself")
    parser.add_argument("--hold-sensors", action="store_true", help="with --colmap")
    return parser.parse_args()


def solve_by_colmap(a):
    """One model, read, adjusted and written; what it took as JSON on stdout's last line."""
    import pycolmap
    reconstruction = pycolmap.Reconstruction(a.sheaf)
    options = pycolmap.BundleAdjustmentOptions()
    options.refine_sensor_from_rig = not a.hold_sensors
    options.refine_principal_point = False
    options.print_summary = False
    options.ceres.auto_select_solver_type = False
    solver = options.ceres.solver_options
    solver.linear_solver_type = "SPARSE_SCHUR"
    solver.num_threads = 1
    solver.max_num_iterations = a.max_iterations
    solver.function_tolerance = a.tolerance
    solver.gradient_tolerance = solver.parameter_tolerance = 0
    cpu, start = time.process_time(), time.perf_counter()
    config = pycolmap.BundleAdjustmentConfig()
    for image in reconstruction.images:
        config.add_image(image)
    pycolmap.create_default_ceres_bundle_adjuster(options, config, reconstruction).solve()
    took = {"clock": time.perf_counter() - start, "cpu": time.process_time() - cpu}
    os.makedirs(a.colmap, exist_ok=True)
    reconstruction.write_binary(a.colmap)
    print(json.dumps(took))


def has_pycolmap():
    return subprocess.run([sys.executable, "-c", "import pycolmap"], capture_output=True).returncode == 0


def run(words):
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode != 0:
        sys.exit(f"{' '.join(words)}: {done.stderr}")
    return done.stdout


def read_json(path):
    with open(path) as file:
        return json.load(file)


def make_scene(a, folder, kind, frames, camera):
    model = os.path.join(folder, "model")
    run([a.sheaf, "generate", model, "--rigs", kind, "--frames", str(frames), "--camera", camera,
         "--points", str(frames * POINTS_PER_FRAME[kind]), "--sensor-rotation-noise", "0.003",
         "--sensor-translation-noise", "0.01", "--quiet"])
    free = os.path.join(folder, "free")
    shutil.copytree(model, free)
    for name in ("rigs", "frames"):
        for ending in (".bin", ".txt"):
            if os.path.exists(os.path.join(free, name + ending)):
                os.remove(os.path.join(free, name + ending))
    return model, free


def by_sheaf(a, folder, model, way):
    out, record = os.path.join(folder, "by-sheaf"), os.path.join(folder, "solve.json")
    words = [a.sheaf, "solve", model, "-o", out, "--json", record, "--threads", "1", "--quiet",
             "--tolerance", str(a.tolerance), "--max-iterations", str(a.max_iterations)]
    run(words + (["--fix", "sensor_from_rig"] if way == "held" else []))
    times = read_json(record)["time"]
    return times["cpu_s"] if a.cpu else times["setup_s"] + times["solve_s"]


def by_colmap(a, folder, model, way):
    words = [sys.executable, os.path.abspath(__file__), model, "--colmap",
             os.path.join(folder, "by-colmap"), "--tolerance", str(a.tolerance),
             "--max-iterations", str(a.max_iterations)]
    took = json.loads(run(words + (["--hold-sensors"] if way == "held" else [])).splitlines()[-1])
    return took["cpu" if a.cpu else "clock"]


def info(a, folder, model):
    record = os.path.join(folder, "info.json")
    run([a.sheaf, "info", model, "--json", record, "--quiet"])
    return read_json(record)


def row_of(a, folder, name, model, way, colmap):
    ours, theirs = [], []
    for solver in ("by-sheaf", "by-colmap"):
        shutil.rmtree(os.path.join(folder, solver), ignore_errors=True)
    for _ in range(a.runs):
        ours.append(by_sheaf(a, folder, model, way))
        if colmap:
            theirs.append(by_colmap(a, folder, model, way))
    end = info(a, folder, os.path.join(folder, "by-sheaf"))
    cells = [name, way, str(end["input"]["poses"]), str(end["input"]["observations"]),
             f"{end['cost']:.6f}"]
    mine = statistics.median(ours)
    if not colmap:
        return cells + ["", "", f"{mine:.3f}", "", ""]
    cost = info(a, folder, os.path.join(folder, "by-colmap"))["cost"]
    their = statistics.median(theirs)
    return cells + [f"{cost:.6f}", f"{(end['cost'] - cost) / cost:+.1e}", f"{mine:.3f}",
                    f"{their:.3f}", f"{their / mine:.1f}"]


def print_row(cells):
    print("| " + " | ".join(cells) + " |", flush=True)


def main():
    a = parse_arguments()
    if a.colmap:
        solve_by_colmap(a)
        return
    colmap = has_pycolmap()
    print_row(["scene", "sensors", "images", "observations", "cost, Sheaf", "cost, COLMAP",
               "difference", "s, Sheaf", "s, COLMAP", "ratio"])
    print_row(["---", "---"] + ["--:"] * 8)
    for kind, frames, camera in SCENES:
        name = f"{kind}-{frames} {camera}"
        ways = [way for way in WAYS if a.only in f"{name} {way}"]
        if not ways:
            continue
        with tempfile.TemporaryDirectory() as folder:
            model, free = make_scene(a, folder, kind, frames, camera)
            for way in ways:
                print_row(row_of(a, folder, name, free if way == "free" else model, way, colmap))


if __name__ == "__main__":
    main()
