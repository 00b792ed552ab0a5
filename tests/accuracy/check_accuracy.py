#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs `docent evaluate` on simulated scenes in lockstep and compares the worst run of each with limits.json.

    check_accuracy.py run DOCENT OUTPUT        runs the scenes; fails if a figure is beyond its limit
    check_accuracy.py check REPORT SCENE       compares one report.json with the limits of a scene
    check_accuracy.py measure DOCENT OUTPUT    runs every scene with MEASURED_SEEDS seeds and writes limits.json anew
    check_accuracy.py --self-test

A limit is the worst of the measured runs plus a margin (see limit_of). The margin is for changes that lead
to other, equally good runs; lockstep itself is reproducible.
"""
import copy
import json
import pathlib
import subprocess
import sys

LIMITS = pathlib.Path(__file__).with_name("limits.json")
MEASURED_SEEDS = 6
JOBS = 2
# Figure of report.json -> whether more is better, factor and constant of the margin. Errors may grow by half, and by what
# a scene without any error needs. A false initialization more is always a finding, so that counts have no margin.
MARGINS = {
    "tracked_share": (True, 1.5, 0.01),
    "ate_rmse_m": (False, 1.5, 0.001),
    "rotation_rmse_deg": (False, 1.5, 0.05),
    "first_3d_pose_s": (False, 1.5, 0.1),
    "false_starts": (False, 1.0, 0),
    "unnoticed_false_starts": (False, 1.0, 0),
}


def worst_of(figure, spread):
    return spread["min"] if MARGINS[figure][0] else spread["max"]


def limit_of(figure, worst):
    more_is_better, factor, constant = MARGINS[figure]
    # What is missing of a share grows by the margin, and not the share itself.
    limit = 1 - ((1 - worst) * factor + constant) if more_is_better else worst * factor + constant
    return round(limit, 4)


def figures_of(report, seeds):
    """Returns the figures of the only sequence of a report, or a sentence that says what is wrong with it."""
    sequences = report.get("sequences", [])
    if len(sequences) != 1 or "distribution" not in sequences[0]:
        return None, "the report has not exactly one sequence with several runs"
    distribution = sequences[0]["distribution"]
    if len(distribution["runs"]) != seeds:
        return None, f"the report has {len(distribution['runs'])} runs instead of {seeds}"
    for figure, spread in distribution["figures"].items():
        if spread is not None and spread["runs"] != seeds and figure in MARGINS:
            return None, f"only {spread['runs']} of {seeds} runs have {figure}"
    return distribution["figures"], None


def breaches(scene, report):
    """Compares a report with the limits of a scene: a list of sentences, empty if all is well."""
    figures, problem = figures_of(report, scene["seeds"])
    if problem:
        return [problem]
    if not scene["limits"]:
        return ["the scene has no limits"]
    found = []
    for figure, limit in scene["limits"].items():
        spread = figures.get(figure)
        if spread is None:
            found.append(f"{figure} is missing; its limit is {limit}")
            continue
        worst = worst_of(figure, spread)
        if worst < limit if MARGINS[figure][0] else worst > limit:
            found.append(f"{figure} is {worst:.4f}, its limit {limit} (measured {scene['measured'].get(figure)}), "
                         f"in the run with seed {spread['worst']['seed']}")
    return found


def evaluate(docent, scene, seeds, output):
    folder = pathlib.Path(output) / scene.replace(":", "-").replace(",", "-").replace("=", "-")
    command = [docent, "evaluate", scene, "--pace", "lockstep", "--seed", "1", "--seeds", str(seeds), "--jobs", str(JOBS),
               "--output", str(folder)]
    result = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False)
    if result.returncode != 0:
        sys.exit(f"{' '.join(command)} failed:\n{result.stdout}")
    return json.loads((folder / "report.json").read_text(encoding="utf-8"))


def load_limits():
    return json.loads(LIMITS.read_text(encoding="utf-8"))


def run(docent, output):
    failed = False
    for scene in load_limits()["scenes"]:
        report = evaluate(docent, scene["scene"], scene["seeds"], output)
        found = breaches(scene, report)
        figures, _ = figures_of(report, scene["seeds"])
        shown = [f"{figure} {worst_of(figure, figures[figure]):.4g}/{limit:g}" for figure, limit in scene["limits"].items()
                 if figures and figures.get(figure)]
        print(f"{'BAD' if found else 'ok '} {scene['scene']}: {', '.join(shown)}", flush=True)
        for sentence in found:
            print(f"    {sentence}")
        failed = failed or bool(found)
    return 1 if failed else 0


def check(report_file, name):
    scenes = [scene for scene in load_limits()["scenes"] if scene["scene"] == name]
    if not scenes:
        sys.exit(f"{LIMITS.name} has no scene {name}.")
    found = breaches(scenes[0], json.loads(pathlib.Path(report_file).read_text(encoding="utf-8")))
    print("\n".join(found))
    return 1 if found else 0


def measure(docent, output):
    limits = load_limits()
    for scene in limits["scenes"]:
        figures, problem = figures_of(evaluate(docent, scene["scene"], MEASURED_SEEDS, output), MEASURED_SEEDS)
        if problem:
            sys.exit(f"{scene['scene']}: {problem}")
        scene["measured"] = {"seeds": MEASURED_SEEDS}
        scene["limits"] = {}
        for figure in MARGINS:
            if figures[figure] is not None:
                worst = worst_of(figure, figures[figure])
                scene["measured"][figure] = round(worst, 5)
                scene["limits"][figure] = limit_of(figure, worst)
        print(scene, flush=True)
    LIMITS.write_text(json.dumps(limits, indent=2) + "\n", encoding="utf-8")
    return 0


def self_test():
    def spread(least, most):
        return {"runs": 2, "min": least, "median": least, "max": most, "worst": {"seed": 1, "start": 0}}

    figures = {"tracked_share": spread(0.9, 1), "ate_rmse_m": spread(0.01, 0.02), "rotation_rmse_deg": spread(0.1, 0.2),
               "first_3d_pose_s": None, "false_starts": spread(0, 1), "unnoticed_false_starts": spread(0, 0)}
    report = {"sequences": [{"name": "s", "distribution": {"runs": [{}, {}], "figures": figures}}]}
    worst = {"tracked_share": 0.9, "ate_rmse_m": 0.02, "rotation_rmse_deg": 0.2, "false_starts": 1,
             "unnoticed_false_starts": 0}
    scene = {"scene": "sim:s", "seeds": 2, "measured": {}, "limits": {f: limit_of(f, w) for f, w in worst.items()}}
    assert not breaches(scene, report), "the measured runs are within their limits"
    scene["limits"] = dict(worst)
    assert not breaches(scene, report), "a figure at its limit is within it"
    for figure, value in worst.items():
        changed = copy.deepcopy(report)
        changed["sequences"][0]["distribution"]["figures"][figure] = spread(value - 0.001, value + 0.001)
        found = breaches(scene, changed)
        assert len(found) == 1 and found[0].startswith(figure), f"a worse {figure} must be found"
        changed["sequences"][0]["distribution"]["figures"][figure] = None
        assert breaches(scene, changed), f"a missing {figure} must be found"
    fewer = copy.deepcopy(report)
    fewer["sequences"][0]["distribution"]["figures"]["ate_rmse_m"]["runs"] = 1
    assert breaches(scene, fewer), "a run without the figure must be found"
    fewer = copy.deepcopy(report)
    fewer["sequences"][0]["distribution"]["runs"].pop()
    assert breaches(scene, fewer), "a missing run must be found"
    assert breaches(scene, {"sequences": []}), "a missing sequence must be found"
    assert breaches({**scene, "limits": {}}, report), "a scene without limits must be found"
    assert limit_of("tracked_share", 1) < 1 and limit_of("false_starts", 2) == 2
    committed = load_limits()["scenes"]
    assert committed, "limits.json has no scene"
    for scene in committed:
        for figure, limit in scene["limits"].items():
            assert limit == limit_of(figure, scene["measured"][figure]) or abs(
                limit - limit_of(figure, scene["measured"][figure])) < 2e-4, f"{scene['scene']}: {figure} is not the measured"
        assert {"tracked_share", "rotation_rmse_deg", "false_starts"} <= set(scene["limits"]), scene["scene"]


def main(arguments):
    if arguments == ["--self-test"]:
        self_test()
        return 0
    commands = {"run": run, "check": check, "measure": measure}
    if len(arguments) != 3 or arguments[0] not in commands:
        print(__doc__)
        return 2
    return commands[arguments[0]](arguments[1], arguments[2])


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
