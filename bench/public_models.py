#!/usr/bin/env python3
# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""Models that people have put into public repositories: read, solved, written, read by COLMAP.

  public_models.py SHEAF --clones DIR [--from https://github.com] [--work DIR] [--table FILE]

bench/public_models.csv names them: repository, commit, path. Their files are taken out of git clones
(DIR/OWNER+NAME/repo or DIR/OWNER/NAME, bare or not); --from fetches the commits that are not there.
Nothing of them is kept in this repository. Each is read, solved for at most 20 steps and written as a COLMAP model, and again as
its own format where that is another one. What is compared:

  read    the cost before, by pycolmap of a COLMAP model as it lies there (only where all quaternions
          are unit quaternions and no point lies behind a camera, as COLMAP has no residual there)
  result  the cost after, by pycolmap of the model that was written
  own     the cost after, by Sheaf of the file that was written in the model's own format

The table has relative differences, and the speed of reading (the best of five).
"""
import argparse
import csv
import json
import os
import subprocess
import sys

import numpy as np

try:
    import pycolmap
except ImportError:
    pycolmap = None

OWN_NAMES = {"bundler": "o.out", "nvm": "o.nvm", "opensfm": "own/reconstruction.json",
             "openmvg": "o/sfm_data.json", "alicevision": "o.sfm", "libmv": "o.problem"}
PARTS = {"cameras.bin": ("images.bin", "points3D.bin", "rigs.bin", "frames.bin"),
         "cameras.txt": ("images.txt", "points3D.txt", "rigs.txt", "frames.txt"),
         "reconstruction.json": ("tracks.csv",)}


def clone_of(folder, repository):
    for path in (os.path.join(folder, repository.replace("/", "+"), "repo"),
                 os.path.join(folder, repository)):
        if os.path.isdir(os.path.join(path, ".git")):
            return os.path.join(path, ".git")
        if os.path.isdir(path):
            return path
    return None


def fetched(folder, source, repository, commit):
    """A bare clone of one commit, whose files come when they are asked for."""
    clone = os.path.join(folder, repository)
    steps = [["init", "--quiet", "--bare", clone],
             ["-C", clone, "remote", "add", "origin", f"{source}/{repository}"],
             ["-C", clone, "fetch", "--quiet", "--depth", "1", "--filter=blob:none", "origin",
              commit]]
    for step in steps:
        if subprocess.run(["git", *step]).returncode != 0:
            return None
    return clone


def take(clone, commit, path, to):
    """Writes one file of the commit; False where it is not there."""
    found = subprocess.run(["git", "-C", clone, "show", f"{commit}:{path}"], capture_output=True)
    if found.returncode != 0:
        return False
    os.makedirs(os.path.dirname(to), exist_ok=True)
    with open(to, "wb") as out:
        out.write(found.stdout)
    return True


def taken(clone, model, work):
    """The model's path in `work`, or None."""
    folder, name = os.path.split(model["path"])
    target = os.path.join(work, model["repository"].replace("/", "+"), folder.replace("/", "+"))
    if not take(clone, model["commit"], model["path"], os.path.join(target, name)):
        return None
    for part in PARTS.get(name, ()):
        take(clone, model["commit"], os.path.join(folder, part), os.path.join(target, part))
    return target if name.startswith("cameras.") else os.path.join(target, name)


def run(command, *arguments):
    """The result as JSON, or what was said on stderr."""
    file = os.path.join(run.work, "out.json")
    if os.path.exists(file):
        os.remove(file)
    done = subprocess.run([command, *arguments, "--json", file, "--quiet"], capture_output=True,
                          text=True)
    if not os.path.exists(file):
        return None, done.stderr.strip()
    with open(file) as text:
        return json.load(text), done.stderr.strip()


def colmap_cost(path):
    """1/2 sum |r|^2 of a COLMAP model by COLMAP, or None where it has no residual for some point."""
    model = pycolmap.Reconstruction(path)
    total = 0.0
    for image_id in model.reg_image_ids():
        image = model.images[image_id]
        camera = model.cameras[image.camera_id]
        pose = image.cam_from_world()
        for point in image.points2D:
            if not point.has_point3D():
                continue
            pixel = camera.img_from_cam(pose * model.points3D[point.point3D_id].xyz)
            if pixel is None:
                return None
            total += 0.5 * float(np.sum((pixel - point.xy) ** 2))
    return total


def relative(a, b):
    return None if a is None or b is None else abs(a - b) / max(abs(b), 1e-300)


def measure(command, path):
    info, said = run(command, "info", path)
    if info is None:
        return {"refused": said}
    seconds = min(run(command, "info", path)[0]["time"]["read_s"] for _ in range(5))
    megabytes = info["input"]["bytes"] / 1e6
    for part in PARTS.get(os.path.basename(path), ()):  # what lies beside a single file
        beside = os.path.join(os.path.dirname(path), part)
        megabytes += os.path.getsize(beside) / 1e6 if os.path.exists(beside) else 0
    row = {"format": info["input"]["format"], "images": info["input"]["poses"],
           "observations": info["input"]["observations"],
           "megabytes_per_s": megabytes / max(seconds, 1e-9),
           "bytes": info["input"]["bytes"], "cost": info["cost"]}
    if row["observations"] == 0:
        return row
    result = os.path.join(run.work, "result")
    subprocess.run(["rm", "-rf", result])
    solved, said = run(command, "solve", path, "-o", result + "/", "--max-iterations", "20")
    if solved is None or solved["final_cost"] is None:
        return {**row, "refused": said or "no usable step"}
    row["final"] = solved["final_cost"]
    behind = info["behind_camera"]["count"] > 0
    clean = not behind and info["rotation_norms"]["count"] == 0
    if pycolmap is not None:
        if row["format"].startswith("colmap") and clean:
            row["read"] = relative(colmap_cost(path), row["cost"])
        if solved["behind_camera"]["after"]["count"] == 0:
            row["result"] = relative(colmap_cost(result), row["final"])
    own = OWN_NAMES.get(row["format"])
    if own is not None:
        target = os.path.join(run.work, own)
        os.makedirs(os.path.dirname(target), exist_ok=True)
        again, said = run(command, "solve", path, "-o", target, "--max-iterations", "20")
        back, _ = run(command, "info", target)
        row["own"] = relative(back["cost"], again["final_cost"]) if again and back else said
    return row


def shown(value):
    if value is None or value == "":
        return ""
    return value if isinstance(value, str) else f"{value:.1e}"


def table(rows):
    lines = ["| Model | Format | Images | Observations | MB/s | Cost | After | read | result | own |",
             "|---|---|--:|--:|--:|--:|--:|--:|--:|--:|"]
    for name, row in rows:
        if "cost" not in row:
            lines.append(f"| {name} | {row['refused']} |" + " |" * 8)
            continue
        final = f"{row['final']:.6g}" if "final" in row else row.get("refused", "")
        lines.append(
            f"| {name} | {row['format']} | {row['images']} | {row['observations']} | "
            f"{row['megabytes_per_s']:.0f} | {row['cost']:.6g} | {final} | "
            f"{shown(row.get('read'))} | {shown(row.get('result'))} | {shown(row.get('own'))} |")
    return "\n".join(lines) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("sheaf")
    parser.add_argument("--clones", required=True)
    parser.add_argument("--from", dest="source", help="where repositories that are not there lie")
    parser.add_argument("--work", default="build/public-models")
    parser.add_argument("--table")
    parser.add_argument("--only", default="", help="models whose name has this in it")
    arguments = parser.parse_args()
    run.work = arguments.work
    os.makedirs(arguments.work, exist_ok=True)
    with open(os.path.join(os.path.dirname(os.path.abspath(__file__)), "public_models.csv")) as text:
        models = list(csv.DictReader(text))
    rows = []
    for model in models:
        name = f"{model['repository']}: {os.path.dirname(model['path']) or model['path']}"
        if arguments.only not in name:
            continue
        clone = clone_of(arguments.clones, model["repository"])
        if clone is None and arguments.source:
            clone = fetched(arguments.clones, arguments.source, model["repository"], model["commit"])
        path = taken(clone, model, arguments.work) if clone else None
        if path is None:
            print(f"{name}: not there", file=sys.stderr)
            continue
        rows.append((name, measure(arguments.sheaf, path)))
        print(f"{name}: {rows[-1][1]}", file=sys.stderr)
    if arguments.table:
        with open(arguments.table, "w") as out:
            out.write(table(rows))
    else:
        print(table(rows), end="")


if __name__ == "__main__":
    main()
