#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""Three photographs with control points: berlin.py SHEAF [--data DIR] [--work DIR]

The example "berlin" of OpenSfM (scripts/get-berlin.sh): COLMAP makes a model of its images (pycolmap, a
fixed seed, one thread; kept in --work), which knows no control points. `sheaf align` moves it to them
and changes nothing else: what COLMAP's model is worth. `sheaf solve` adjusts it with them and with the
GPS positions of its images. Three of the ten control points of gcp_list.txt take part, or all; those
that do not are check points. Root mean squares of residuals are metres to the east, north and up.
"""
import argparse
import json
import os
import subprocess
import sys

WAYS = (("moved, nothing adjusted", ["align", "--to", "control"], False),
        ("adjusted with control points", ["solve"], False),
        ("adjusted with control points and GPS", ["solve"], True))


def parse_arguments():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sheaf", help="the command")
    data = os.path.join(os.environ.get("SHEAF_DATA", "data"), "berlin")
    parser.add_argument("--data", default=data, help=f"the example (default {data})")
    parser.add_argument("--work", default="build/berlin", help="for models; made if missing")
    return parser.parse_args()


def make_model(a):
    """COLMAP's model of the three images, made once."""
    model = os.path.join(a.work, "models", "0")
    if os.path.exists(os.path.join(model, "images.bin")):
        return model
    import pycolmap
    os.makedirs(a.work, exist_ok=True)
    images = os.path.join(a.data, "images")
    database = os.path.join(a.work, "database.db")
    if os.path.exists(database):
        os.remove(database)
    pycolmap.set_random_seed(0)
    pycolmap.extract_features(database, images, camera_mode=pycolmap.CameraMode.SINGLE,
                              device=pycolmap.Device.cpu)
    pycolmap.match_exhaustive(database, device=pycolmap.Device.cpu)
    options = pycolmap.IncrementalPipelineOptions()
    options.num_threads = 1
    options.random_seed = 0
    if not pycolmap.incremental_mapping(database, images, os.path.dirname(model), options):
        sys.exit("berlin: COLMAP made no model of the images")
    return model


def read_points(path):
    """Points of gcp_list.txt by coordinates, each a list of (image, x, y)."""
    points = {}
    with open(path, encoding="utf-8") as lines:
        next(lines)
        for line in lines:
            lon, lat, height, x, y, image = line.split()
            marks = points.setdefault((float(lat), float(lon), float(height)), [])
            marks.append((image, float(x), float(y)))
    return points


def write_survey(points, controls, path):
    """Those of `controls` are control points, all others check points."""
    entries = []
    for number, (place, marks) in enumerate(points.items(), 1):
        entries.append({
            "id": str(number), "role": "control" if number in controls else "check",
            "lat_lon_height": place, "sigma": [0.01, 0.01, 0.1],
            "marks": [{"image": image, "pixel": [x + 0.5, y + 0.5]} for image, x, y in marks]})
    with open(path, "w", encoding="utf-8") as file:
        json.dump({"frame": {"kind": "geodetic"}, "points": entries}, file, indent=1)


def row_of(a, model, survey, words, gps):
    out = os.path.join(a.work, "out.json")
    command = [a.sheaf, words[0], model, "-o", os.path.join(a.work, "out"), *words[1:],
               "--constraints", survey, "--json", out, "--quiet"]
    if gps:
        command += ["--constraints", os.path.join(a.data, "images")]
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
    with open(out, encoding="utf-8") as file:
        document = json.load(file)
    residuals = document["survey"]["residuals"]
    cells = []
    for kind in ("control", "check"):
        if not residuals[kind]:
            cells += ["", ""]
            continue
        marks = [m for r in residuals[kind] for m in r["marks"]]
        squares = sum(m["residual_px"][0] ** 2 + m["residual_px"][1] ** 2 for m in marks)
        cells += [", ".join(f"{x:.3f}" for x in residuals[kind + "_rmse"]),
                  f"{(squares / len(marks)) ** 0.5:.1f}"]
    return cells


def print_row(cells):
    print("| " + " | ".join(cells) + " |", flush=True)


def main():
    a = parse_arguments()
    model = make_model(a)
    points = read_points(os.path.join(a.data, "gcp_list.txt"))
    in_all = [n for n, marks in enumerate(points.values(), 1) if len(marks) == 3]
    survey = os.path.join(a.work, "survey.json")
    print_row(["control", "COLMAP's model", "control, m", "px", "check, m", "px"])
    print_row(["---", "---", "--:", "--:", "--:", "--:"])
    for name, controls in ((f"{in_all[:3]}", in_all[:3]), ("all", range(1, len(points) + 1))):
        write_survey(points, controls, survey)
        for way, words, gps in WAYS:
            print_row([name, way, *row_of(a, model, survey, words, gps)])


if __name__ == "__main__":
    main()
