# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""The commands of check-bits.py: every home, solver, precision, loss, format and verb.

In the words of a command {NAME} is the scene of that name, and @FILE a file of the command's own
folder, which is one of its outputs. Scenes are small and seeded; what is made by `sheaf` is an
output like any other.
"""

import collections
import pathlib

from bits import scenes

Command = collections.namedtuple("Command", "name words quick one_thread")
Made = collections.namedtuple("Made", "name write needs result")

SOLVERS = ("dense", "sparse", "iterative-explicit", "iterative-implicit")
LOSSES = ("huber:2", "soft-l1:2", "cauchy:2", "tukey:6", "geman-mcclure:6")
ROUNDS = ("huber:auto", "cauchy:auto", "tukey:auto:gnc", "geman-mcclure:auto:gnc", "tukey:6:gnc")
MODELS = ("SIMPLE_PINHOLE", "PINHOLE", "SIMPLE_RADIAL", "RADIAL", "OPENCV", "FULL_OPENCV",
          "OPENCV_FISHEYE", "SIMPLE_RADIAL_FISHEYE", "RADIAL_FISHEYE", "THIN_PRISM_FISHEYE", "FOV",
          "EUCM", "RAD_TAN_THIN_PRISM_FISHEYE", "DIVISION", "EQUIRECTANGULAR", "DOUBLE_SPHERE")


class Commands:
    """The list: scenes by name and commands in the order they run in."""

    def __init__(self):
        self.list = []
        self.results = {}

    def scene(self, name, words, result, quick=False):
        """A scene that `sheaf` writes; `result` is the file of its folder that stands for it."""
        self.results[name] = result
        self.run(name, words, quick)

    def made(self, name, write, needs=(), result=""):
        """A scene that is written here: write(folder, paths of what it needs)."""
        self.results[name] = result
        self.list.append(Made(name, write, needs, result))

    def run(self, name, words, quick=False, one_thread=False):
        """A command; with `one_thread` it runs a second time with one thread, which must not
        change a bit."""
        self.list.append(Command(name, words, quick, one_thread))

    def solve(self, name, scene, options="", quick=False, one_thread=False, result="result.txt"):
        self.run(f"solve.{name}", f"solve {{{scene}}} -o @{result} --json @json {options}", quick,
                 one_thread)


def add_bundle_scenes(c):
    c.scene("lake", "generate @scene.txt --truth @truth.txt --json @json --cameras 12 --points 900"
            " --mean-track 5 --seed 2", "scene.txt", quick=True)
    c.scene("street", "generate @scene.txt --truth @truth.txt --json @json --family street"
            " --cameras 40 --points 2500 --seed 3 --outliers 0.01", "scene.txt", quick=True)
    c.scene("spots", "generate @scene.txt --json @json --family collection --cameras 80"
            " --points 3000 --seed 4", "scene.txt", quick=True)
    c.scene("long", "generate @scene.txt --json @json --family street --cameras 1050 --points 6000"
            " --seed 5 --drift 0.5", "scene.txt")
    c.scene("like", "generate @scene.txt --json @json --like ladybug-138", "scene.txt")
    c.scene("wrong", "perturb {lake} @scene.txt --json @json --outliers 0.05 --outlier-size 60"
            " --seed 6", "scene.txt", quick=True)


def add_bundles(c):
    for solver in SOLVERS:
        iterative = solver.startswith("iterative")
        for precision in ("double", "mixed") if iterative else ("double",):
            way = f"--solver {solver} --precision {precision}"
            name = f"{solver}.{precision}"
            c.solve(f"spots.{name}", "spots", way, quick=precision == "double", one_thread=True)
            for points in ("xyz", "homogeneous", "inverse-depth"):
                c.solve(f"street.{name}.{points}", "street", f"{way} --points {points}")
            c.solve(f"street.{name}.dogleg", "street",
                    f"{way} --trust-region dogleg --initial-damping 1e-8", quick=iterative)
            c.solve(f"street.{name}.timid", "street", f"{way} --initial-damping 1e-8")
            for cheirality in ("reject", "hold-out"):
                c.solve(f"street.{name}.{cheirality}", "street", f"{way} --cheirality {cheirality}"
                        " --points inverse-depth")
            c.solve(f"wrong.{name}.cauchy", "wrong", f"{way} --loss cauchy:2")
        c.solve(f"like.{solver}", "like", f"--solver {solver} --max-iterations 8", one_thread=True)
        c.solve(f"like.{solver}.dogleg", "like", f"--solver {solver} --max-iterations 10"
                " --trust-region dogleg --initial-damping 1e-8")
        if solver != "dense":
            c.solve(f"long.{solver}", "long", f"--solver {solver} --max-iterations 6")
    c.solve("like.auto.inverse-depth", "like", "--points inverse-depth --max-iterations 10")
    c.solve("lake.auto", "lake", "--ply @both.ply", one_thread=True)
    c.solve("lake.one-step", "lake", "--max-iterations 1", quick=True)
    c.solve("lake.one-step.implicit", "lake", "--max-iterations 1 --solver iterative-implicit")
    c.solve("lake.no-inner", "lake", "--inner-iterations 0")
    c.solve("lake.tolerance", "lake", "--tolerance 1e-14")


def add_losses(c):
    for loss in LOSSES:
        name = loss.split(":")[0]
        c.solve(f"wrong.dense.{name}", "wrong", f"--loss {loss} --solver dense", quick=True)
        c.solve(f"wrong.implicit.{name}", "wrong", f"--loss {loss} --solver iterative-implicit"
                " --precision mixed")
        c.solve(f"street.{name}.charts", "street", f"--loss {loss} --points inverse-depth")
        c.solve(f"street.{name}.dogleg", "street",
                f"--loss {loss} --trust-region dogleg --initial-damping 1e-8")
    for loss in ROUNDS:
        c.solve(f"wrong.{loss.replace(':', '-')}", "wrong", f"--loss {loss}", one_thread=True)
        c.solve(f"wrong.explicit.{loss.replace(':', '-')}", "wrong",
                f"--loss {loss} --solver iterative-explicit")


HELD = {"poses": "--fix poses", "intrinsics": "--fix intrinsics", "focal": "--fix f",
        "distortion": "--fix k", "k1": "--fix k1", "one-pose": "--fix pose=0",
        "one-camera": "--fix camera=3", "one-image": "--fix image=2",
        "points-alone": "--fix poses,intrinsics", "some": "--fix pose=0,k --refine k1=4"}
POINTS_HELD = {"all": "--fix points", "poses": "--fix points,intrinsics",
               "lenses": "--fix points,poses",
               "new-image": "--fix points,poses,intrinsics --refine pose=3",
               "reject": "--fix points --cheirality reject", "huber": "--fix points --loss huber:2",
               "tukey": "--fix points --loss tukey:auto:gnc",
               "dogleg": "--fix points --trust-region dogleg --initial-damping 1e-8"}


def add_held(c):
    for name, options in HELD.items():
        c.solve(f"held.{name}", "lake", options)
        c.solve(f"held.{name}.implicit", "lake", f"{options} --solver iterative-implicit")
    for name, options in POINTS_HELD.items():
        c.solve(f"images.{name}", "wrong", options, quick=name == "all", one_thread=True)
    c.solve("images.street", "street", "--fix points")
    c.solve("images.shared", "opencv.shared", "--fix points", result="model/")
    c.solve("images.three", "opencv.three", "--fix points --refine pp", result="model/")
    c.solve("images.own", "opencv", "--fix points", result="model/")
    c.solve("images.radial", "simple_radial.shared", "--fix points,intrinsics", result="model/")


def add_lens_scenes(c):
    for model in MODELS:
        name = model.lower()
        size = f"--camera {model} --cameras 10 --points 500 --seed 7 --json @json"
        c.scene(name, f"generate @model {size}", "model", quick=model == "OPENCV")
        if model in ("SIMPLE_RADIAL", "OPENCV", "OPENCV_FISHEYE", "FULL_OPENCV", "FOV"):
            c.scene(f"{name}.shared", f"generate @model {size} --shared", "model",
                    quick=model == "OPENCV")
    c.scene("opencv.three", "generate @model --camera OPENCV --lenses 3 --cameras 12 --points 600"
            " --seed 8 --truth @truth/ --json @json", "model")
    c.scene("opencv.narrow", "generate @model --camera OPENCV --shared --field-of-view 30"
            " --cameras 10 --points 500 --json @json", "model")
    c.scene("opencv.many", "generate @model --camera OPENCV --shared --cameras 80 --points 2500"
            " --seed 9 --json @json", "model")
    c.scene("opencv.text", "convert {opencv.three} @model --format colmap-text --json @json",
            "model")
    c.made("mixture", lambda folder, paths: scenes.mixed_model(folder, paths[0]), ["opencv.text"])


def add_lenses(c):
    for model in MODELS:
        c.solve(f"lens.{model.lower()}", model.lower(), result="model/", quick=model == "OPENCV",
                one_thread=model == "OPENCV")
    shared = [name for name in c.results if name.endswith(".shared")]
    for scene in shared + ["opencv.three", "mixture"]:
        c.solve(f"lens.{scene}", scene, result="model/", one_thread=True,
                quick=scene == "opencv.shared")
        c.solve(f"lens.{scene}.pp", scene, "--refine pp --solver sparse", result="model/")
    for solver in SOLVERS:
        for precision in ("double", "mixed") if solver.startswith("iterative") else ("double",):
            for scene in ("opencv.three", "opencv_fisheye", "opencv.many"):
                c.solve(f"lens.{scene}.{solver}.{precision}", scene, result="model/",
                        options=f"--solver {solver} --precision {precision}")
    for loss in LOSSES + ROUNDS[-1:]:
        c.solve(f"lens.three.{loss.replace(':', '-')}", "opencv.three", f"--loss {loss}",
                result="model/")
        c.solve(f"lens.fisheye.{loss.replace(':', '-')}", "opencv_fisheye.shared",
                f"--loss {loss} --solver iterative-implicit", result="model/")
    for name, options in {"reject": "--cheirality reject", "hold-out": "--cheirality hold-out",
                          "no-inner": "--inner-iterations 0", "poses": "--fix poses",
                          "intrinsics": "--fix intrinsics",
                          "one": "--fix camera=2,pose=1 --refine pp",
                          "fx": "--fix fx,p1", "timid": "--initial-damping 1e-9"}.items():
        c.solve(f"lens.three.{name}", "opencv.three", options, result="model/")
    for scene in ("simple_radial.shared", "radial"):
        for points in ("homogeneous", "inverse-depth"):
            c.solve(f"lens.{scene}.{points}", scene, f"--points {points}", result="model/")
        c.solve(f"lens.{scene}.dogleg", scene, "--trust-region dogleg", result="model/")


def add_files(c):
    for name, out in {"gz": "a.txt.gz", "bz2": "a.txt.bz2", "bundler": "a.out",
                      "colmap": "model/", "ply": "a.ply"}.items():
        c.scene(f"as.{name}", f"convert {{lake}} @{out} --json @json", out, quick=name == "gz")
    c.scene("as.text", "convert {lake} @model --format colmap-text --json @json", "model")
    c.scene("as.nvm", "convert {simple_pinhole} @a.nvm --json @json", "a.nvm")
    c.scene("as.libmv", "convert {simple_radial.shared} @a.problem --json @json", "a.problem")
    c.scene("as.libmv.full", "convert {full_opencv.shared} @model --format colmap --json @json",
            "model")
    c.scene("doubled.text", "convert {opencv.shared} @model --format colmap-text --json @json",
            "model")
    c.made("rigs", lambda folder, paths: scenes.rigged_model(folder, paths[0]), ["doubled.text"])
    c.made("repeats", lambda folder, paths: (folder.mkdir(), scenes.repeated(
        folder / "scene.txt", paths[0])), ["wrong"], "scene.txt")
    for name, scene, result in (("gz", "as.gz", "a.txt.gz"), ("bz2", "as.bz2", "a.txt.bz2"),
                                ("bundler", "as.bundler", "a.out"),
                                ("colmap", "as.colmap", "model/"), ("text", "as.text", "model"),
                                ("nvm", "as.nvm", "a.nvm"),
                                ("libmv", "as.libmv", "a.problem"), ("rigs", "rigs", "model/"),
                                ("ply", "lake", "a.ply"), ("repeats", "repeats", "a.txt")):
        c.solve(f"file.{name}", scene, result=result)
        c.run(f"info.{name}", f"info {{{scene}}} --json @json --pattern @pattern.svg")
        c.run(f"check.{name}", f"check {{{scene}}} --json @json")
    for name, words in {"back": "{as.colmap} @a.txt", "from-bundler": "{as.bundler} @a.txt",
                        "from-nvm": "{as.nvm} @model/", "from-libmv": "{as.libmv} @model/",
                        "from-gz": "{as.gz} @a.txt", "rigs": "{rigs} @model --format colmap",
                        "text": "{opencv.text} @model --format colmap", "same": "{opencv} @model/",
                        "radial": "{simple_radial} @a.out --format bundler"}.items():
        c.run(f"convert.{name}", f"convert {words} --json @json")
    c.run("convert.clean", "convert {repeats} @a.txt --json @json --max-error 200 --drop-behind"
          " --drop-repeated --min-angle 2 --min-track 3", quick=True)
    c.run("convert.clean.model", "convert {opencv.three} @model/ --json @json --max-error 40"
          " --min-angle 4")


def add_verbs(c):
    for name in ("street", "like", "opencv.three", "mixture", "opencv_fisheye.shared"):
        c.run(f"info.{name}", f"info {{{name}}} --json @json --pattern @pattern.svg")
        c.run(f"check.{name}", f"check {{{name}}} --json @json", one_thread=True)
    noise = {"all": "--rotation 0.01 --center 0.02 --translation 0.01 --point 0.02 --pixel 0.5"
                    " --intrinsics 5,0.01,0.01 --seed 3",
             "relative": "--intrinsics 1% --normalize 50 --rotation 0.002", "ceres":
             "--protocol ceres --rotation 0.002 --translation 0.01", "rootba": "--protocol rootba",
             "outliers": "--outliers 0.1 --outlier-size 30 --min-depth 0.1"}
    for name, options in noise.items():
        c.run(f"perturb.{name}", f"perturb {{lake}} @a.txt --json @json {options}",
              quick=name == "all")
    c.run("perturb.model", "perturb {opencv.three} @model/ --json @json --center 0.01 --pixel 1")
    c.run("perturb.street", "perturb {street} @a.txt.gz --json @json --protocol rootba")
    for name, options in {"aligned": "", "as-is": "--no-align", "robust": "--robust"}.items():
        c.run(f"evaluate.{name}", "evaluate {lake} out/lake/truth.txt --json @json"
              f" --csv @errors.csv {options}", quick=not options)
        c.run(f"evaluate.model.{name}", "evaluate {opencv.three} out/opencv.three/truth"
              f" --json @json --csv @errors.csv {options}")
    c.run("generate.packed", "generate @a.txt.bz2 --truth @truth.txt.gz --cameras 9 --points 300"
          " --json @json --pixel-noise 0 --rotation-noise 0.01 --focal-noise 0.02")
    c.run("generate.stream", "generate @a.txt --like trafalgar-21 --json @json")
    c.run("generate.exact", "generate @a.txt --family collection --drift 0 --outliers 0 --seed 11"
          " --cameras 20 --points 500 --json @json")
    c.run("generate.bal", "generate @a.txt --camera RADIAL --cameras 8 --points 300 --json @json")
    c.run("compare", "compare {lake} --solvers sheaf,sheaf:sparse,sheaf:iterative-implicit"
          " --peers /nowhere --json @json --reference out/lake/truth.txt")
    c.run("compare.held", "compare {wrong} --solvers sheaf --peers /nowhere --fix points"
          " --json @json")
    c.run("demo", "demo --json @json --ply @demo.ply", one_thread=True)
    c.run("demo.small", "demo --json @json --cameras 8 --points 500 --mean-track 3 --seed 4")


PIXELS = {"default": "", "xyz": "--points xyz", "moved": "--warp translation",
          "bilinear": "--interpolation bilinear",
          "bilinear-exact": "--interpolation bilinear-exact",
          "plain": "--brightness none", "on-patch": "--loss-on patch", "free": "--leaving free",
          "held-poses": "--fix poses", "held-points": "--fix points",
          "exact": "--rows exact", "wide": "--pattern 8x8", "cross": "--pattern cross",
          "levels": "--levels 3 --rounds 2", "zncc": "--min-zncc 0.6 --rounds 2",
          "anchor": "--anchor 0.5", "anchor-loss": "--anchor 0.5 --anchor-loss cauchy:2",
          "anchor-exact": "--anchor 0.5 --rows exact", "anchor-xyz": "--anchor 0.5 --points xyz",
          "no-loss": "--loss none", "fixed-scale": "--loss huber:4", "soft-l1": "--loss soft-l1:4",
          "cauchy": "--loss cauchy:auto", "tukey": "--loss tukey:12",
          "geman-mcclure": "--loss geman-mcclure:12", "damped": "--initial-damping 1e-2",
          "compatible": "--interpolation bilinear --brightness none --loss huber:1 --loss-on patch"
          " --leaving free --points xyz --warp translation", "plain-xyz":
          "--points xyz --brightness none --fix points"}


def add_photometric(c):
    c.scene("greys", "generate @scene --photometric --truth @truth --json @json --cameras 4"
            " --points 250 --grey-noise 1 --brightness 0.1 --measured 0.3 --seed 5", "scene",
            quick=True)
    c.scene("shaded", "generate @scene --photometric --cameras 3 --points 150 --vignette 0.2"
            " --occluder --outliers 0.05 --relief 0.08 --wavelength 20 --start 2 --json @json",
            "scene")
    c.made("pinholes", lambda folder, paths: scenes.pinhole_model(
        folder, paths[0], (320, 240)), ["greys"])
    c.made("rgbd", lambda folder, paths: scenes.rgbd(folder, 5, (96, 72), 80, 0.1, False))
    c.made("numbered", lambda folder, paths: scenes.rgbd(folder, 210, (40, 30), 34, 0.25, True))
    for name, options in PIXELS.items():
        c.run(f"photometric.{name}", "photometric {greys} -o @refined --ply @both.ply --json @json"
              f" {options}", quick=name == "default",
              one_thread=name in ("default", "xyz", "anchor", "exact", "levels"))
    c.run("photometric.shaded",
          "photometric {shaded} -o @refined --pictures @pictures --json @json")
    c.run("photometric.model", "photometric {pinholes} --images out/greys/scene -o @refined/"
          " --json @json", one_thread=True)
    disturbed = "--disturb-rotation 0.003 --disturb-center 0.01 --seed 2"
    c.run("photometric.rgbd", "photometric {rgbd} -o @refined --fix points --levels 2 --cell 8"
          f" --json @json {disturbed}", one_thread=True)
    c.run("photometric.rgbd.free", "photometric {rgbd} -o @refined --cell 6 --every 2"
          " --max-points 100 --min-slope 1 --depth-tolerance 0.05 --json @json")
    c.run("photometric.sparse", "photometric {numbered} -o @refined --cell 10 --min-slope 1"
          f" --max-iterations 12 --json @json {disturbed}", one_thread=True)


DUBROVNIK, TRAFALGAR, LADYBUG = (f"data/bal/{name}-pre.txt" for name in (
    "dubrovnik-16-22106", "trafalgar-21-11315", "ladybug-49-7776"))
REAL = {
    "dubrovnik": f"solve {DUBROVNIK} -o @a.txt --json @json",
    "dubrovnik.implicit": f"solve {DUBROVNIK} -o @a.txt --json @json --solver iterative-implicit",
    "dubrovnik.images": f"solve {DUBROVNIK} -o @a.txt --json @json --fix points",
    "trafalgar": f"solve {TRAFALGAR} -o @a.txt --json @json --loss huber:auto",
    "trafalgar.sparse": f"solve {TRAFALGAR} -o @a.txt --json @json --solver sparse",
    "ladybug": f"solve {LADYBUG} -o @a.txt --json @json",
    "ladybug.charts": f"solve {LADYBUG} -o @a.txt --json @json --points inverse-depth",
    "ladybug.dogleg": f"solve {LADYBUG} -o @a.txt --json @json --trust-region dogleg"
                      " --initial-damping 1e-8",
    "ladybug.explicit": f"solve {LADYBUG} -o @a.txt --json @json --solver iterative-explicit"
                        " --precision mixed",
    "ladybug.check": f"check {LADYBUG} --json @json",
    "ladybug.info": f"info {LADYBUG} --json @json --pattern @pattern.svg",
    "door": "solve data/colmap/gtsfm-lund-door-12 -o @model/ --json @json",
    "door.pp": "solve data/colmap/gtsfm-lund-door-12 -o @model/ --json @json --refine pp",
    "crane": "solve data/colmap/gtsfm-crane-mast-8 -o @model/ --json @json",
    "villa": "solve data/bundler/balbianello/Balbianello.out -o @a.out --json @json",
    "libmv": "solve data/libmv/problem_01.bin -o @a.problem --json @json",
    "asteroid": "photometric data/colmap/gtsfm-astrovision-dawn -o @refined/ --json @json"
                " --max-iterations 30",
    "direct": "photometric data/direct/directba-shenlan-l7 -o @refined --json @json"
              " --intrinsics 277.34,291.402,312.234,239.777 --max-iterations 20",
    "room": "photometric data/direct/slambook2-dense-rgbd5 -o @refined --json @json --levels 3"
            " --intrinsics 518,519,325.5,253.5 --depth-scale 1000 --fix points --max-points 1000"
            " --max-iterations 20",
}


def all_commands(data):
    """Scenes and commands in their order, with those on the real scenes of the folder `data`."""
    c = Commands()
    for add in (add_bundle_scenes, add_bundles, add_losses, add_lens_scenes, add_held, add_lenses,
                add_files, add_verbs, add_photometric):
        add(c)
    for name, words in REAL.items() if data else ():
        scene = words.split()[1].replace("data/", "", 1)
        if (pathlib.Path(data) / scene).exists():
            c.run(f"real.{name}", words, one_thread=name in ("dubrovnik", "ladybug"))
    return c
