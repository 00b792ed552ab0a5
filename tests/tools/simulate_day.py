#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Lets many visitors walk through a simulated museum, and writes the page of their day.

Each visitor takes another walk through the same bays (the simulator's option walk), begins and leaves at another
time, rests now and then with the lens covered, and some skip a stop. Prints what the visits
needed of memory and descriptors.

    tests/tools/simulate_day.py --docent build/release/docent --library museum.docent --tour Bays \\
        --scene museum:6,fps=8 --from 54 --visits 200 --output day
"""
import argparse
import os
import pathlib
import random
import subprocess
import time


def visit(options, number):
    """Runs one visit; returns its peak memory in MB, its most descriptors, and its exit status."""
    choice = random.Random(number)
    begin = options.begin + choice.uniform(0, 8)
    end = begin + choice.uniform(*options.seconds)
    scene = f"{options.scene},walk={number}"
    if choice.random() < 0.3:
        rest = choice.choice([3, 8, 20])
        scene += f",rest={rest},rest-at={choice.uniform(begin, end):.1f}"
        end += rest
    script = options.output / "script.txt"
    # Later steps may not be possible, and one that is not ends the run; the first stop can always be skipped.
    skips = choice.random() < 0.4
    script.write_text(f"{choice.uniform(0.5, 3):.1f} tour skip\n" if skips else "")
    command = [options.docent, "--quiet", "tour", "--library", options.library, "--tour", options.tour, "--camera",
               "sim:" + scene, "--from", f"{begin:.1f}", "--until", f"{end:.1f}", "--pace", "lockstep",
               "--headless", "--log", options.output / "visits", "--script", script]
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
    descriptors = 0
    while True:
        ended, status, usage = os.wait4(process.pid, os.WNOHANG)
        if ended:
            break
        try:
            descriptors = max(descriptors, len(os.listdir(f"/proc/{process.pid}/fd")))
        except OSError:
            pass
        time.sleep(0.2)
    errors = process.stderr.read().decode(errors="replace").strip()
    if status:
        print(f"visit {number}: {errors}")
    return usage.ru_maxrss / 1024, descriptors, status


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--docent", required=True)
    parser.add_argument("--library", required=True)
    parser.add_argument("--tour", required=True)
    parser.add_argument("--scene", default="museum:6,fps=8", help="of the simulator, as the maps were made in")
    parser.add_argument("--from", dest="begin", type=float, required=True,
                        help="when the bays have been built, seconds from the first image")
    parser.add_argument("--seconds", type=float, nargs=2, default=(12, 30), help="shortest and longest visit")
    parser.add_argument("--visits", type=int, default=200)
    parser.add_argument("--output", type=pathlib.Path, required=True, help="folder for the records and the page")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    begin, results = time.monotonic(), []
    for number in range(1, options.visits + 1):
        results.append(visit(options, number))
    page = options.output / "report.html"
    subprocess.run([options.docent, "report", options.output / "visits", "--output", page], check=True)
    tenth = max(1, len(results) // 10)
    print(f"{len(results)} visits in {time.monotonic() - begin:.0f} s, {sum(s != 0 for _, _, s in results)} failed")
    for name, part in (("first", results[:tenth]), ("last", results[-tenth:])):
        print(f"{name} tenth: at most {max(m for m, _, _ in part):.0f} MB and {max(d for _, d, _ in part)} descriptors")
    print("the page is", page)


if __name__ == "__main__":
    main()
