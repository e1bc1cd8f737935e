# Copyright (c) 2026, the Sheaf authors.
# SPDX-License-Identifier: BSD-3-Clause
"""Checks of the bench's own arithmetic on canned runs: side_by_side.py --self-test"""
import math
import os
import random
import sys
import tempfile
import xml.dom.minidom

import basin
import cost_plot
import evaluate
import losses
import old_new
import run_table
import side_by_side
import suite
import suite_report
import write_pages

sys.path.insert(0, os.path.join(side_by_side.HERE, "peers"))
import peer_sheaf  # noqa: E402

# Two cameras, two points, three observations; the residuals are worked out by hand below.
TINY = """2 2 3
0 0 1 0
1 0 0 2
0 1 0 0
0 0 0  0 0 0  10 0 0
0 0 1.5707963267948966  0 0 0  10 0.5 0
1 0 -5
0 0 -4
"""


def canned_run(name, trace, final, **more):
    return {"name": name, "config": "x", "solver": name, "threads": 1, "trace": trace,
            "seconds_per_iteration": 0.1, "setup_s": 0.1, "total_s": trace[-1][0],
            "cpu_percent": 100, "peak_bytes": 1e6, "iterations": len(trace) - 1,
            "final_cost_independent": final, "agrees": True, **more}


def canned_document():
    runs = []
    for slow in (1.0, 2.0, 30.0):  # one run of three is disturbed: medians must not see it
        runs.append(canned_run("sheaf", [[0.1 * slow, 500.0], [0.2 * slow, 100.00001]], 100.00001))
        runs.append(canned_run("ceres-head", [[1 * slow, 500.0], [2 * slow, 105.0],
                                              [3 * slow, 100.0]], 100.0))
        runs.append(canned_run("g2o", [[1 * slow, 500.0], [2 * slow, 150.0]], 150.0))
    runs.append({"name": "gtsam", "config": "x", "threads": 1, "failed": "no memory"})
    best = run_table.best_cost(runs)
    return {"problem": "tiny.txt", "threads": 1, "best_cost": best, "runs": runs,
            "header": {"cameras": 2, "points": 2, "observations": 3},
            "summary": run_table.summarise(runs, best)}


def check_evaluation():
    # Camera 0 sees point 0 at 10 * (1, 0) / 5 = (2, 0): r = (1, 0). Camera 1 is turned by 90
    # degrees: (0, 1) / 5 = p, n = 0.04, scale 10 * 1.02, so r = (0, 2.04 - 2). Point 1: r = 0.
    expected = 0.5 * (1 + 0.04 ** 2)
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "tiny.txt")
        with open(path, "w") as file:
            file.write(TINY)
        observations, cameras, points = evaluate.read_bal(path)
        assert math.isclose(evaluate.cost(path, path), expected, rel_tol=1e-12)
        assert math.isclose(evaluate.plain_cost(observations, cameras, points), expected,
                            rel_tol=1e-12)
        # Beyond 0.5 px Huber counts 2 * 0.5 * 1 - 0.5^2 instead of 1.
        loss = evaluate.loss_of("eigen-lambda=1e-2-huber=0.5")
        assert loss == ("huber", 0.5) and evaluate.loss_of("eigen-lambda=1") is None
        assert math.isclose(evaluate.cost(path, path, None, loss), 0.5 * (0.75 + 0.04 ** 2),
                            rel_tol=1e-12)
        assert math.isclose(evaluate.half_sum([3.0], ("cauchy", 1.0)), 0.5 * math.log(4.0))


def check_table():
    document = canned_document()
    rows = {r["name"]: r for r in document["summary"]}
    assert document["best_cost"] == 100.0
    assert rows["sheaf"]["time_to"]["1e-06"] == 0.4 and rows["sheaf"]["runs"] == 3
    assert rows["ceres-head"]["time_to"]["0.1"] == 4.0
    assert rows["ceres-head"]["time_to"]["0.01"] == 6.0
    assert rows["g2o"]["time_to"]["0.1"] is None
    liar = run_table.summary_row("x", "y", [canned_run("x", [[1, 1.0]], 200.0, agrees=False)], 100)
    assert liar["time_to"]["0.1"] is None and "200.0000 †" in run_table.markdown([liar])
    rounded = canned_run("x", [[1, 100.0]], 100.002, agrees=True, disagreement=2e-5, cut=True,
                         limit_s=7)
    row = run_table.summary_row("x", "y", [rounded], 100)
    assert row["time_to"]["0.001"] == 1 and row["time_to"]["0.0001"] is None
    assert "| x | y | 1.00 | 1.00 | 1.00 | > 7 | > 7 |" in run_table.markdown([row])
    text = run_table.markdown(document["summary"])
    assert "| g2o | x | miss | miss | miss | miss | miss |" in text and "failed" in text
    order = [line.split("|")[1].strip() for line in text.splitlines()[2:]]
    assert order == ["sheaf", "ceres-head", "g2o", "gtsam"]
    assert run_table.strongest(document["summary"], "g2o") is None
    assert [run_table.seconds(v) for v in (None, 0.0123, 1.234, 12.34, 1234)] == [
        "miss", "0.0123", "1.23", "12.3", "1234"]


def check_plot():
    document = canned_document()
    drawn = side_by_side.curves(document)
    assert [label for label, _ in drawn] == ["sheaf", "ceres-head x", "g2o x"]
    svg = cost_plot.draw("a < b", drawn, document["best_cost"])
    assert len(xml.dom.minidom.parseString(svg).getElementsByTagName("path")) > 10


def check_sheaf_adapter():
    steps = [{"cost": cost, "accepted": accepted, "time_s": 0.5 * i, "gradient_max": 8.0 - i,
              "linear_iterations": i} for i, (cost, accepted) in enumerate(
                  [(9.0, True), (9.0, False), (4.0, True)])]
    run = peer_sheaf.run_document({"time": {"setup_s": 0.25, "solve_s": 1.0}, "iterations": steps,
                                   "memory": {"peak_bytes": 7, "forecast_bytes": 6},
                                   "solver": {"name": "dense", "reason": "small"},
                                   "precision": "double", "termination": {"code": "x"},
                                   "final_cost": 4.0}, "auto", 1, 99)
    assert run["sheaf"]["gradient"] == [8.0, 6.0] and run["sheaf"]["linear_iterations"] == [1, 2]
    assert run["trace"] == [[0.25, 9.0], [0.75, 9.0], [1.25, 4.0]]
    assert run["seconds_per_iteration"] == 0.5 and run["total_s"] == 1.25


def check_pages():
    results = {"date": "2026-01-01", "runs": 3, "machine": {"cpu": "a cpu", "cores": 2},
               "missing": ["g2o-omp"], "problems": [canned_document()]}
    table = write_pages.readme_table(results)
    assert "| tiny | 1 | 0.400 | 6.00 | **15.0** |" in table, table
    assert "50 steps." in table and run_table.MARK not in table
    for r in results["problems"][0]["runs"]:
        r["limit_s"] = 60.0
    assert "50 steps and 60 s." in write_pages.readme_table(results)
    assert write_pages.between("a<!-- bench:begin -->old<!-- bench:end -->b", "new") == (
        "a<!-- bench:begin -->\nnew<!-- bench:end -->b")
    kernels = {"benchmarks": [{"name": "avx2/trial", "real_time": 4.0, "cpu_time": 2.0,
                               "time_unit": "ms", "Gflop/s": 30e9, "of peak": 0.25,
                               "flops/obs": 60.0, "bytes/obs": 20.0}]}
    results["machine"]["triad_gbytes_s"] = {"one": 20.0, "all": 20.0}
    text = write_pages.page(results, "plots", kernels)
    assert "a cpu" in text and "Not on this machine: g2o-omp." in text
    assert "| avx2/trial | 2.000 | 60 | 30.0 | 25 % | 20 | 10.0 | 50 % |" in text


def canned_ladder():
    """Two problems: `auto` takes 2 s and 4 s where the best explicit choice takes 2 s and 1 s; the
    peer takes 6 s and is cut at 7 s."""
    def document(name, cameras, autos, others, peer):
        said = {"solver": {"name": "dense"}, "precision": "double", "forecast_bytes": 9e5,
                "termination": {"code": "cost_converged"}, "gradient": [1.0, 1e-9],
                "linear_iterations": [0, 4, 8]}
        runs = [{**canned_run("sheaf", [[0.1, 500.0], [autos, 100.0]], 100.0), "config": "auto",
                 "sheaf": said},
                {**canned_run("sheaf", [[0.1, 500.0], [others, 100.0]], 100.0), "config": "sparse"},
                canned_run("g2o", [[0.1, 500.0], [6.0, peer]], peer, cut=peer > 100, limit_s=7)]
        return {"problem": name, "threads": 1, "best_cost": 100.0, "runs": runs, "missing": ["pba"],
                "header": {"cameras": cameras, "points": 2, "observations": 30 * cameras},
                "summary": run_table.summarise(runs, 100.0), "synthetic": True, "time_limit_s": 7,
                "turns": 3}
    return {"date": "2026-01-01", "machine": {"cpu": "a cpu", "cores": 2},
            "problems": [document("a", 10, 2.0, 2.0, 100.0),
                         document("b", 1000, 4.0, 1.0, 150.0)]}


def check_suite():
    results = canned_ladder()
    documents = suite_report.full(results)
    assert suite_report.profile(documents, 1e-3) == {"sheaf auto": [1.0, 1.0],
                                                     "g2o": [3.0, math.inf]}
    assert "| a | 1 | 2.00 | 6.00 | **3.0** |" in suite_report.speed_table(documents, 1e-3)
    assert "| b | 1 | 4.00 | > 7 | > 1.8 |" in suite_report.speed_table(documents, 1e-3)
    assert "| b | 1 | dense | 4.00 |  | 1.00 |  |  | 4.00 |" in suite_report.choice_table(
        documents, 1e-3)
    assert "| a | 1 | 0.90 | 1 |" in suite_report.memory_table(documents)
    assert "| a | cost_converged | double | 1 | 6 | 8 |" in suite_report.end_table(documents)
    drawn = suite_report.plots(results)
    assert {"suite-profile-0.001.svg", "suite-growth.svg", "cost-a-1-threads.svg", "cost-b-1-threads.svg"} <= set(drawn)
    for svg in drawn.values():
        xml.dom.minidom.parseString(svg)
    section = suite_report.markdown(results, "plots")
    assert run_table.MARK not in section
    b = documents[1]
    known = {**b, "problem": "ladybug-138", "best_cost": 33000.0, "time_limit_s": 2.5}
    lower = suite_report.markdown({**results, "problems": [known, {**known, "time_limit_s": 4}]}, "")
    assert "| ladybug-138 | synthetic | 1000 | 2 | 30000 | 33000 \u00b9 | 2.5, 4 | 3 |" in lower
    assert "\u00b9 Not the lowest" in lower and "; f* = 33000.000000 \u00b9; at most 4 s" in lower
    assert not run_table.footnote([{**known, "best_cost": 32103.53}])
    assert "Not on this machine: pba." in section
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "page.md")
        with open(path, "w") as file:
            file.write("before\n")
        for _ in range(2):  # the second one replaces the first
            suite_report.put(path, section)
        with open(path) as file:
            page = file.read()
        assert page.startswith("before\n") and page.count("## The ladder") == 1
        assert suite_report.cut(page).startswith(suite_report.BEGIN)


def check_ladder():
    documents = canned_ladder()["problems"]
    documents[0]["best_cost"] = 50.0
    suite.share_best_cost(documents)
    assert documents[1]["best_cost"] == 50 and documents[1]["summary"][0]["time_to"]["0.1"] is None
    assert [suite.time_limit(n) for n in (80_000, 1_000_000, 5_000_000)] == [20, 60, 240]
    with tempfile.TemporaryDirectory() as folder:
        path = os.path.join(folder, "tiny.txt")
        with open(path, "w") as file:
            file.write(TINY.replace("10 0 0", "10 0 0.25"))
        made = suite.without_k2("tiny", path, folder)
        _, cameras, points = evaluate.read_bal(made)
        assert [cameras[8], cameras[17], cameras[16]] == [0, 0, 0.5] and len(points) == 6


def check_losses():
    assert losses.read_scene("a=b/c.txt@0.25") == ("a", "b/c.txt", 0.25)
    (_, config, _), = losses.with_loss([("g2o", "eigen-lambda=1e-2", "p")], "cauchy", 1.0)
    assert config == "eigen-lambda=1e-2-cauchy=2.54863762395"
    assert losses.without_loss(config) == "eigen-lambda=1e-2"
    trace = [[0.0, 500.0], [1.0, 500.0], [2.0, 100.05]]
    runs = [{**canned_run("ceres", trace, 100.05), "config": "a-huber=1"},
            {**canned_run("ceres", [[2.5, 100.0]], 100.0), "config": "b-huber=1"},
            {**canned_run("ceres", [[9.0, 100.0]], 100.0), "config": "c-huber=1"},
            {**canned_run("sheaf", [[0.1, 500.0], [0.5, 100.0]], 100.0), "config": "auto-huber=1"},
            {**canned_run("g2o", [[1, 500.0]], 500.0, cut=True, limit_s=7), "config": "x-huber=1"}]
    assert losses.near_best(runs, "ceres", 100.0) == ["a-huber=1", "b-huber=1"]
    assert losses.steps_to(trace, 101.0) == 2 and losses.steps_to(trace, 100.0) is None
    document = {"scene": "a", "loss": "huber", "runs": runs, "best_cost": 100.0,
                "summary": run_table.summarise(runs, 100.0)}
    text = losses.tables({"problems": [document]})
    assert "| a | 0.001 | 0.500 (1) | 2.00 (2) | **4** | a | > 7 | > 14 |  |" in text, text
    assert "| a | 1e-06 | 0.500 (1) | 2.50 (0) | **5** | b | > 7 | > 14 |  |" in text, text
    xml.dom.minidom.parseString(losses.picture(document))


def check_old_new():
    # Fewer than 6 of 21 coins show heads with probability 0.0133, fewer than 7 with 0.0392.
    assert old_new.sign_interval([float(i) for i in range(1, 22)]) == (6.0, 16.0)
    assert old_new.sign_interval([3.0, 1.0, 2.0, 6.0, 5.0, 4.0]) == (1.0, 6.0)
    turns = []
    ratios = old_new.measure(4, lambda: turns.append("old") or {"a": 2.0, "b": 1.0},
                             lambda: turns.append("new") or {"a": 3.0})
    assert turns == ["old", "new", "new", "old"] * 2 and ratios == {"a": [1.5] * 4}
    text, slower = old_new.report({"a": [1.5] * 6, "b": [1.01] * 6}, 0.02)
    assert slower == ["a"] and "1.500  [+50.0 %, +50.0 %]  slower" in text


def check_basin():
    scene = basin.Scene(TINY)
    assert scene.counts == [2, 2, 3] and basin.Scene(scene.text()).text() == scene.text()
    camera = list(scene.cameras[1])
    camera[3:6] = [1.0, 2.0, 3.0]
    before = basin.back(basin.matrix(camera[:3]), camera[3:6])
    moved = list(camera)
    basin.move_camera(moved, random.Random(1), 0.5, 0)
    after = basin.back(basin.matrix(moved[:3]), moved[3:6])
    assert moved[:3] != camera[:3] and max(abs(a - b) for a, b in zip(before, after)) < 1e-12
    basin.put_at_depth(scene, 7)
    image, point, x, y = 0, 0, 1.0, 0.0  # the first observation of the first point
    local = [a + b for a, b in zip(basin.times(basin.matrix(scene.cameras[image][:3]),
                                               scene.points[point]), scene.cameras[image][3:6])]
    assert abs(local[2] + 7) < 1e-12 and abs(-local[1] / local[2] * 10 - y) < 1e-12, local
    assert abs(-local[0] / local[2] * 10 - x) < 1e-12


def run():
    for check in (check_evaluation, check_table, check_plot, check_sheaf_adapter, check_pages,
                  check_suite, check_ladder, check_losses, check_old_new, check_basin):
        check()
        print(f"{check.__name__}: passed")
    return 0
