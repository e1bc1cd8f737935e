# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""COLMAP reads a model and has the rigs, frames and poses that its text form states:
colmap_rigs_agree.py MODEL TEXT

MODEL is what COLMAP reads; TEXT the same model as text, which this script reads itself. Poses to
1e-12. Exit code 77: no pycolmap here.
"""
import sys

try:
    import numpy as np
    import pycolmap
except ImportError:
    sys.exit(77)


def records(folder, stem):
    with open(f"{folder}/{stem}.txt") as file:
        lines = [line.rstrip("\n") for line in file if not line.startswith("#")]
    return [line.split() for line in (lines[::2] if stem == "images" else lines) if line]


def pose(words):
    return np.array([float(word) for word in words[:7]])


def numbers_of(rigid):
    x, y, z, w = rigid.rotation.quat
    return np.array([w, x, y, z, *rigid.translation])


def differ(a, b):
    """Of poses w x y z, t; a quaternion and its negative are one rotation."""
    a, b = a.copy(), b.copy()
    for p in (a, b):
        p[:4] /= np.linalg.norm(p[:4])
    if a[:4] @ b[:4] < 0:
        b[:4] = -b[:4]
    return np.abs(a - b).max() > 1e-12 * max(1, np.abs(a).max())


def check_rigs(reconstruction, text):
    wrong = []
    stated = records(text, "rigs")
    if {int(words[0]) for words in stated} != set(reconstruction.rigs):
        wrong.append(f"rigs {sorted(reconstruction.rigs)}")
    for words in stated:
        rig = reconstruction.rigs[int(words[0])]
        if rig.num_sensors() != int(words[1]):
            wrong.append(f"rig {words[0]} has {rig.num_sensors()} sensors")
        reference = rig.ref_sensor_id
        if (reference.type.name, str(reference.id)) != (words[2], words[3]):
            wrong.append(f"rig {words[0]} has the reference {reference}")
        k = 4
        while k < len(words):
            sensor = pycolmap.sensor_t(getattr(pycolmap.SensorType, words[k]), int(words[k + 1]))
            has_pose = words[k + 2] == "1"
            found = rig.sensor_from_rig(sensor)
            if (found is not None) != has_pose:
                wrong.append(f"{sensor} of rig {words[0]}: pose {found}")
            elif has_pose and differ(pose(words[k + 3:]), numbers_of(found)):
                wrong.append(f"{sensor} of rig {words[0]}: {found}, stated {words[k + 3:k + 10]}")
            k += 10 if has_pose else 3
    return wrong


def check_frames(reconstruction, text):
    wrong = []
    stated = records(text, "frames")
    if {int(words[0]) for words in stated} != set(reconstruction.frames):
        wrong.append(f"frames {sorted(reconstruction.frames)}")
    for words in stated:
        frame = reconstruction.frames[int(words[0])]
        if frame.rig_id != int(words[1]):
            wrong.append(f"frame {words[0]} is of rig {frame.rig_id}")
        if differ(pose(words[2:]), numbers_of(frame.rig_from_world)):
            wrong.append(f"frame {words[0]}: {frame.rig_from_world}")
        data = {tuple(words[k:k + 3]) for k in range(10, len(words), 3)}
        found = {(d.sensor_id.type.name, str(d.sensor_id.id), str(d.id)) for d in frame.data_ids}
        if data != found or len(data) != int(words[9]):
            wrong.append(f"frame {words[0]} has {found}")
    return wrong


def check_images(reconstruction, text):
    return [f"image {words[0]}: {reconstruction.images[int(words[0])].cam_from_world()}"
            for words in records(text, "images")
            if differ(pose(words[1:]),
                      numbers_of(reconstruction.images[int(words[0])].cam_from_world()))]


def main():
    model, text = sys.argv[1:]
    reconstruction = pycolmap.Reconstruction(model)
    wrong = (check_rigs(reconstruction, text) + check_frames(reconstruction, text) +
             check_images(reconstruction, text))
    print(reconstruction.summary())
    if wrong:
        sys.exit("\n".join(wrong))


if __name__ == "__main__":
    main()
