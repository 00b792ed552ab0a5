#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Measures tours with changed images: with motion blur, another exposure, a longer focal length, or people.

  visit_changed_sequence.py --docent build/release/docent --change-tool build/release/tests/tools/change_sequence \\
                            --sequence kitchen --output visits --seeds 1,2,3

A map is authored from the first half of the sequence (--build) and toured with the second half (--visit), unchanged
and with each of --changes. Existing sequences in the output folder are reused; authoring and tours are always repeated.
The map is aligned with the world by the similarity truth_from_map between the author's live camera centres and
groundtruth.txt (check_augmentations.py). A frame counts as posed in the states sixdof, hybrid, panorama and
relocalized; a pose is wrong if its camera centre is more than --wrong metres from the truth.
Needs only Python's standard library.
"""
import argparse
import collections
import csv
import json
import math
import pathlib
import subprocess

from check_augmentations import Truth, align, apply

POSED = ("sixdof", "hybrid", "panorama", "relocalized")
CHANGES = ("none", "blur:13", "exposure:1.9", "exposure:0.5", "tele:1.6", "people:0.333", "rim:0.8")


def run(*words):
    subprocess.run([str(word) for word in words], check=True)


def make_sequence(arguments, frames, change, folder):
    if (folder / "rgb.txt").exists():
        return folder
    extra = () if change == "none" else ("--change", change)
    run(arguments.change_tool, arguments.sequence, folder, "--frames", frames, *extra)
    return folder


def read_frames(folder):
    with open(folder / "frames.csv", newline="") as file:
        return list(csv.DictReader(file))


def centre(row):
    return [float(row[k]) for k in ("tx", "ty", "tz")] if row["tx"] else None


def maps_in_world(frames, truth):
    """truth_from_map of every map with at least ten poses that have ground truth, and the RMSE of each in metres.
    Poses without finite points do not count: their positions are those of a panorama map."""
    pairs = collections.defaultdict(lambda: ([], []))
    for row in frames:
        pose, point = truth.at(float(row["timestamp"])), centre(row)
        if row["map"] and int(row["finite"]) > 0 and point and pose:
            pairs[row["map"]][0].append(pose[0])
            pairs[row["map"]][1].append(point)
    placed = {name: align(*both) for name, both in pairs.items() if len(both[0]) >= 10}
    errors = {}
    for name, similarity in placed.items():
        squares = [math.dist(true, place(similarity, point)) ** 2 for true, point in zip(*pairs[name])]
        errors[name] = math.sqrt(sum(squares) / len(squares))
    return placed, errors


def place(similarity, point):
    scale, r, t = similarity
    turned = apply(r, point)
    return [scale * turned[i] + t[i] for i in range(3)]


def evaluate_visit(frames, truth, placed, wrong_m):
    """The results of one visit."""
    errors, posed, unplaced, first = [], 0, 0, None
    for i, row in enumerate(frames):
        if row["state"] not in POSED or not row["map"]:
            continue
        posed += 1
        first = i if first is None else first
        pose, point = truth.at(float(row["timestamp"])), centre(row)
        if point is None or row["map"] not in placed:
            unplaced += 1
        elif pose:
            errors.append(math.dist(pose[0], place(placed[row["map"]], point)))
    errors.sort()
    return {"frames": len(frames), "posed": posed, "posed_ratio": posed / max(1, len(frames)),
            "first_posed_frame": first, "without_position": unplaced,
            "wrong": sum(error > wrong_m for error in errors),
            "median_error_m": errors[len(errors) // 2] if errors else None,
            "max_error_m": errors[-1] if errors else None}


def visit(arguments, seed, visits, truth):
    folder = arguments.output / f"seed-{seed}"
    folder.mkdir(parents=True, exist_ok=True)
    library, script = folder / "library.docent", folder / "script.txt"
    for suffix in ("", "-wal", "-shm"):
        pathlib.Path(str(library) + suffix).unlink(missing_ok=True)
    script.write_text(f"0 map new \"{arguments.sequence.name}\"\n")
    common = ("--headless", "--pace", arguments.pace, "--seed", seed, "--library", library)
    run(arguments.docent, "--quiet", "author", *common, "--camera", arguments.output / "build", "--script", script,
        "--output", folder / "author", *arguments.author_option)
    placed, errors = maps_in_world(read_frames(folder / "author"), truth)
    built = "; ".join(f"map {name} built with {100 * e:.1f} cm RMSE" for name, e in errors.items())
    print(f"seed {seed}: " + (built or "no map has depth"), flush=True)
    results = {}
    for change, sequence in visits.items():
        output = folder / change.replace(":", "-")
        run(arguments.docent, "--quiet", "tour", *common, "--camera", sequence, "--output", output, *arguments.tour_option)
        result = results[change] = evaluate_visit(read_frames(output), truth, placed, arguments.wrong)
        median, maximum = (("%.1f" % (100 * result[k]) if result[k] is not None else "-")
                        for k in ("median_error_m", "max_error_m"))
        print(f"  {change:14} {100 * result['posed_ratio']:5.1f} % posed, first frame {result['first_posed_frame']}, "
              f"{result['wrong']} wrong, median {median} cm, maximum {maximum} cm", flush=True)
    return results


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name in ("docent", "change-tool", "sequence", "output"):
        parser.add_argument("--" + name, required=True, type=pathlib.Path)
    parser.add_argument("--build", default=":50%", help="range of frames that the map is built from")
    parser.add_argument("--visit", default="50%:", help="range of frames of the tour")
    parser.add_argument("--changes", default=",".join(CHANGES))
    parser.add_argument("--seeds", default="1")
    parser.add_argument("--pace", default="lockstep")
    parser.add_argument("--wrong", type=float, default=0.25, help="position error in metres above which a pose is wrong")
    parser.add_argument("--author-option", action="append", default=[], help="additional argument for docent author")
    parser.add_argument("--tour-option", action="append", default=[], help="additional argument for docent tour")
    arguments = parser.parse_args()
    arguments.output.mkdir(parents=True, exist_ok=True)
    truth = Truth(arguments.sequence / "groundtruth.txt")
    make_sequence(arguments, arguments.build, "none", arguments.output / "build")
    visits = {change: make_sequence(arguments, arguments.visit, change,
                                    arguments.output / ("visit-" + change.replace(":", "-").replace("@", "-")))
              for change in arguments.changes.split(",")}
    results = {seed: visit(arguments, seed, visits, truth) for seed in arguments.seeds.split(",")}
    (arguments.output / "visits.json").write_text(json.dumps(results, indent=1) + "\n")
    print("worst case over all seeds:")
    for change in visits:
        ratios = sorted(results[seed][change]["posed_ratio"] for seed in results)
        print(f"  {change:14} {100 * ratios[0]:5.1f} % posed (median {100 * ratios[len(ratios) // 2]:.1f} %), "
              f"{max(results[seed][change]['wrong'] for seed in results)} wrong")


if __name__ == "__main__":
    main()
