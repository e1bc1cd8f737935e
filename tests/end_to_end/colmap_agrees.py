# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""COLMAP reads a model and agrees with `sheaf info --json` on it: colmap_agrees.py MODEL INFO.json

Counts, the mean error of the points as the model states it (the figure of COLMAP's model_analyzer)
and as COLMAP computes it from the state, the last two to 1e-6. Exit code 77: no pycolmap here.
"""
import json
import sys

try:
    import pycolmap
except ImportError:
    sys.exit(77)


def main():
    model, path = sys.argv[1:]
    with open(path) as file:
        info = json.load(file)
    reconstruction = pycolmap.Reconstruction(model)
    counts = {"cameras": reconstruction.num_cameras(), "poses": reconstruction.num_reg_images(),
              "points": reconstruction.num_points3D(),
              "observations": reconstruction.compute_num_observations()}
    wrong = [f"{name}: {count} for COLMAP, {info['input'][name]} here"
             for name, count in counts.items() if count != info["input"][name]]
    ours = info["mean_error_px"]
    errors = {"stated": reconstruction.compute_mean_reprojection_error()}
    # Of panoramas COLMAP tells angles, as pixels at the equator; its bundle adjuster has pixels.
    if not any(camera.is_spherical() for camera in reconstruction.cameras.values()):
        reconstruction.update_point_3d_errors()
        errors["computed"] = reconstruction.compute_mean_reprojection_error()
    wrong += [f"mean error, as {how}: {error!r} for COLMAP, {ours!r} here"
              for how, error in errors.items() if not abs(error - ours) <= 1e-6 * max(1, ours)]
    print(counts, errors)
    if wrong:
        sys.exit("\n".join(wrong))


if __name__ == "__main__":
    main()
