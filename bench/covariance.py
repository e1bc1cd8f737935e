#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""Covariances by Sheaf and by COLMAP of the same models, and by Sheaf of large ones.

  covariance.py SHEAF [--images 100,500] [--cpu]      side by side: values and seconds
  covariance.py SHEAF --large                         street, collection, dubrovnik-356: seconds, memory
  covariance.py SHEAF --ceres PROGRAM                 values of a small scene beside Ceres' dense SVD

Side by side: a model is generated and solved by `sheaf`; both then tell the covariances of its state in
the same gauge (the first pose and one coordinate of the second's translation), sigma 1, no damping, one
thread each. COLMAP (pycolmap.estimate_ba_covariance, in a process of its own) has of points only what is
left with cameras held, so points are compared with `sheaf covariance --conditional`; of Sheaf the time
with all points, cameras free, is told as well. Conventions: COLMAP's step is (half a rotation vector,
translation) on the left, Sheaf's (rho, phi) with T' = exp([rho, phi]^) T; both lead to (phi, t) with
delta t = rho + phi x t. Differences are those of covariances, in sigmas of their two parameters.
pycolmap is asked of the Python of --python or of SHEAF_PYCOLMAP_PYTHON; without it its columns stay
empty. On long streets (--street) COLMAP's matrix without damping is singular to its precision: it finds
none or gives numbers that are not finite (inf). The large scenes are looked at where they start, which
makes no difference to time and memory. PROGRAM is peer-ceres-covariance of bench/peers: a BAL scene of
eight images, in the same gauge; translations, lenses and points are compared.
"""
import argparse
import json
import math
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time

POINTS_COMPARED = 50
# name, what `sheaf generate` is told, seconds, bytes: the limits
LARGE = [
    ("street-2000", ["--family", "street", "--cameras", "2000", "--points", "200000",
                     "--mean-track", "5"], 15, 4e9),
    ("collection-2000", ["--family", "collection", "--cameras", "2000", "--points", "200000",
                         "--mean-track", "5"], 40, 4e9),
    ("dubrovnik-356", ["--like", "dubrovnik-356"], None, None),
]


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sheaf", help="the command, or the model where --colmap is given")
    parser.add_argument("--python", default=os.environ.get("SHEAF_PYCOLMAP_PYTHON", sys.executable),
                        help="a Python that has pycolmap [SHEAF_PYCOLMAP_PYTHON, or this one]")
    parser.add_argument("--images", default="100,500", help="sizes, comma-separated [100,500]")
    parser.add_argument("--points-per-image", type=int, default=40)
    parser.add_argument("--mean-track", type=float, default=5)
    parser.add_argument("--camera", default="SIMPLE_RADIAL")
    parser.add_argument("--street", action="store_true",
                        help="side by side: a car's images, each with a lens of its own, which leave most "
                             "pairs of images uncoupled; --camera is not looked at")
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--cpu", action="store_true",
                        help="processor seconds in place of the clock's, of the whole process of Sheaf")
    parser.add_argument("--large", action="store_true", help="the large scenes, by Sheaf alone")
    parser.add_argument("--ceres", metavar="PROGRAM", help="compare with Ceres by this program")
    parser.add_argument("--colmap", metavar="OUT", help="ask pycolmap of one model: used by itself")
    return parser.parse_args()


def ask_colmap(a):
    """Covariances of one model by pycolmap, as JSON."""
    import pycolmap
    reconstruction = pycolmap.Reconstruction(a.sheaf)
    options = pycolmap.BundleAdjustmentOptions()
    options.print_summary = False
    options.refine_principal_point = False
    options.ceres.solver_options.num_threads = 1
    config = pycolmap.BundleAdjustmentConfig()
    for image in reconstruction.images:
        config.add_image(image)
    config.fix_gauge(pycolmap.BundleAdjustmentGauge.TWO_CAMS_FROM_WORLD)
    adjuster = pycolmap.create_default_ceres_bundle_adjuster(options, config, reconstruction)
    asked = pycolmap.BACovarianceOptions()
    asked.damping = 0
    cpu, start = time.process_time(), time.perf_counter()
    found = pycolmap.estimate_ba_covariance(asked, reconstruction, adjuster)
    took = {"clock": time.perf_counter() - start, "cpu": time.process_time() - cpu}
    if found is None:  # singular to its precision
        with open(a.colmap, "w") as file:
            json.dump({"took": took}, file)
        return
    images = {}
    for number, image in reconstruction.images.items():
        covariance = found.get_cam_cov_from_world(number)
        if covariance is not None:
            images[image.name] = {"covariance": covariance.tolist(),
                                  "translation": list(image.cam_from_world().translation)}
    lenses = [found.get_other_params_cov(camera.params).tolist()
              for _, camera in sorted(reconstruction.cameras.items())]
    ids = sorted(reconstruction.points3D)[:POINTS_COMPARED]
    points = {str(number): found.get_point_cov(number).tolist() for number in ids}
    with open(a.colmap, "w") as file:
        json.dump({"took": took, "images": images, "lenses": lenses, "points": points}, file)


def run(words, environment=None):
    done = subprocess.run(words, capture_output=True, text=True, env=environment)
    if done.returncode != 0:
        sys.exit(f"{' '.join(words)}: {done.stderr}")
    return done.stdout


def read_json(path):
    with open(path) as file:
        return json.load(file)


def has_pycolmap(a):
    return subprocess.run([a.python, "-c", "import pycolmap"], capture_output=True).returncode == 0


def square(numbers):
    n = math.isqrt(len(numbers))
    return [numbers[n * i:n * i + n] for i in range(n)]


def product(A, B):
    return [[sum(x * y for x, y in zip(row, column)) for column in zip(*B)] for row in A]


def as_colmap(covariance, t):
    """Of (rho, phi) to (phi / 2, t + rho + phi x t)."""
    A = [[0, 0, 0, 0.5, 0, 0], [0, 0, 0, 0, 0.5, 0], [0, 0, 0, 0, 0, 0.5],
         [1, 0, 0, 0, t[2], -t[1]], [0, 1, 0, -t[2], 0, t[0]], [0, 0, 1, t[1], -t[0], 0]]
    return product(product(A, square(covariance)), list(zip(*A)))


def difference(theirs, ours):
    """The largest difference in sigmas. What a gauge holds is left out by COLMAP: its rows are those
    of ours whose variance is next to nothing."""
    n = len(theirs)
    order = sorted(range(len(ours)), key=lambda k: ours[k][k], reverse=True)
    kept = sorted(order[:n])
    out = 0
    for i in range(n):
        for k in range(n):
            scale = math.sqrt(max(theirs[i][i] * theirs[k][k], 1e-300))
            off = abs(theirs[i][k] - ours[kept[i]][kept[k]]) / scale
            if not math.isfinite(off):
                return math.inf
            out = max(out, off)
    return out


def by_sheaf(a, folder, model, more):
    record = os.path.join(folder, "sheaf.json")
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    run([a.sheaf, "covariance", model, "--gauge", "first-two", "--sigma", "1", "--threads", "1",
         "--quiet", "--json", record] + more)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    found = read_json(record)
    return found, cpu if a.cpu else found["time"]["covariance_s"]


def by_colmap(a, folder, model):
    record = os.path.join(folder, "colmap.json")
    one = dict(os.environ, OMP_NUM_THREADS="1", OPENBLAS_NUM_THREADS="1", MKL_NUM_THREADS="1")
    run([a.python, os.path.abspath(__file__), model, "--colmap", record], one)
    found = read_json(record)
    return found, found["took"]["cpu" if a.cpu else "clock"]


def compare(ours, conditional, theirs):
    """The largest differences of poses, lenses and points."""
    mine = {image["image"]: image["covariance"] for image in ours["images"]}
    poses = max(difference(image["covariance"], as_colmap(mine[name], image["translation"]))
                for name, image in theirs["images"].items())
    lenses = max(difference(C, square(lens["covariance"]))
                 for C, lens in zip(theirs["lenses"], ours["cameras"]))
    points = max(difference(theirs["points"][str(point["point"])], square(point["covariance"]))
                 for point in conditional["points"]["list"])
    return poses, lenses, points


def make_model(a, folder, count):
    start, model = os.path.join(folder, "start"), os.path.join(folder, "model")
    words = [a.sheaf, "generate", start + ".txt" if a.street else start, "--cameras", str(count),
             "--points", str(count * a.points_per_image), "--mean-track", str(a.mean_track), "--quiet"]
    if a.street:
        run(words + ["--family", "street", "--outliers", "0", "--drift", "0"])
        run([a.sheaf, "convert", start + ".txt", start, "--format", "colmap"])
    else:
        run(words + ["--camera", a.camera, "--shared"])
    run([a.sheaf, "solve", start, "-o", model, "--tolerance", "1e-13", "--threads", "1", "--quiet"])
    return model


def row_of(a, folder, count, colmap):
    model = make_model(a, folder, count)
    cameras, points, their = [], [], []
    for _ in range(a.runs):
        ours, seconds = by_sheaf(a, folder, model, ["--points", "none"])
        cameras.append(seconds)
        points.append(by_sheaf(a, folder, model, [])[1])
        if colmap:
            theirs, seconds = by_colmap(a, folder, model)
            their.append(seconds)
    mine = statistics.median(points)
    cells = [str(count), str(ours["input"]["observations"]), f"{statistics.median(cameras):.3f}",
             f"{mine:.3f}"]
    if not colmap:
        return cells + [""] * 5
    took = statistics.median(their)
    if "images" not in theirs:
        return cells + [f"{took:.3f}", "finds none", "", "", ""]
    ids = ",".join(theirs["points"])
    conditional = by_sheaf(a, folder, model, ["--conditional", "--points", ids])[0]
    return cells + [f"{took:.3f}", f"{took / mine:.1f}"] + [
        f"{x:.1e}" for x in compare(ours, conditional, theirs)]


def large_row(a, folder, name, words, seconds, memory):
    path, record = os.path.join(folder, name + ".txt"), os.path.join(folder, "large.json")
    run([a.sheaf, "generate", path, "--quiet"] + words)
    process = subprocess.Popen([a.sheaf, "covariance", path, "--sigma", "1", "--threads", "1",
                                "--quiet", "--json", record], stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    os.remove(path)
    if status != 0:
        sys.exit(f"{name}: sheaf covariance ended with {status}")
    found = read_json(record)
    took = found["time"]["covariance_s"]
    if a.cpu:
        took = usage.ru_utime + usage.ru_stime
    peak = 1024 * usage.ru_maxrss
    limits = ["" if seconds is None else str(seconds), "" if memory is None else f"{memory / 1e9:.1f}"]
    return [name, str(found["input"]["poses"]), str(found["input"]["observations"]), f"{took:.2f}",
            limits[0], f"{peak / 1e9:.2f}", limits[1]]


def beside_ceres(a, folder):
    """The largest differences, in sigmas, of a small scene's translations, lenses and points."""
    start, state, theirs = (os.path.join(folder, name) for name in ("s.txt", "m.txt", "ceres.json"))
    run([a.sheaf, "generate", start, "--cameras", "8", "--points", "60", "--quiet"])
    run([a.sheaf, "solve", start, "-o", state, "--tolerance", "1e-14", "--threads", "1", "--quiet"])
    run([a.ceres, state, theirs])
    theirs = read_json(theirs)
    ids = ",".join(str(p) for p in range(len(theirs["points"])))
    ours = by_sheaf(a, folder, state, ["--points", ids])[0]
    with open(state) as file:
        numbers = [float(x) for line in file.read().split("\n")[1 + ours["input"]["observations"]:]
                   for x in line.split()]
    worst = {"translations": 0, "lenses": 0, "points": 0}
    for k, image in enumerate(ours["images"]):
        moved = as_colmap(image["covariance"], numbers[9 * k + 3:9 * k + 6])
        mine = [row[3:] for row in moved[3:]]
        worst["translations"] = max(worst["translations"],
                                    between(square(theirs["translations"][k]), mine))
    for C, lens in zip(theirs["lenses"], ours["cameras"]):
        worst["lenses"] = max(worst["lenses"], between(square(C), square(lens["covariance"])))
    for C, point in zip(theirs["points"], ours["points"]["list"]):
        worst["points"] = max(worst["points"], between(square(C), square(point["covariance"])))
    for name, off in worst.items():
        print(f"{name}: at most {off:.1e} sigmas apart")


def between(theirs, ours):
    """As `difference`, of all that neither holds."""
    free = [k for k in range(len(theirs)) if theirs[k][k] > 1e-14]
    return max([abs(theirs[i][k] - ours[i][k]) / math.sqrt(theirs[i][i] * theirs[k][k])
                for i in free for k in free], default=0)


def print_row(cells):
    print("| " + " | ".join(cells) + " |", flush=True)


def main():
    a = parse_arguments()
    if a.colmap:
        ask_colmap(a)
        return
    with tempfile.TemporaryDirectory() as folder:
        if a.ceres:
            beside_ceres(a, folder)
            return
        if a.large:
            print_row(["scene", "images", "observations", "s", "limit", "GB", "limit"])
            print_row(["---"] + ["--:"] * 6)
            for scene in LARGE:
                print_row(large_row(a, folder, *scene))
            return
        print_row(["images", "observations", "s, cameras", "s, points too", "s, COLMAP", "ratio",
                   "poses differ", "lenses", "points, cameras held"])
        print_row(["--:"] * 9)
        colmap = has_pycolmap(a)
        for count in a.images.split(","):
            with tempfile.TemporaryDirectory(dir=folder) as place:
                print_row(row_of(a, place, int(count), colmap))


if __name__ == "__main__":
    main()
