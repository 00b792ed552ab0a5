#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Curators add signs to a map of a hub while devices pull it, each with the real program; then checks that all
libraries agree and nothing is missing.

    hub_devices.py build/release/docent postgresql:///docent MAP [--devices 30] [--curators 3] [--seconds 60]
"""
import argparse
import pathlib
import random
import statistics
import subprocess
import sys
import tempfile
import threading
import time


class Run:
    def __init__(self, options, folder):
        self.options = options
        self.folder = folder
        self.end = time.monotonic() + options.seconds
        self.errors = []
        self.times = {"push": [], "pull": []}
        self.added = []

    def docent(self, *arguments):
        done = subprocess.run([self.options.docent, *arguments], capture_output=True, text=True, check=False)
        if done.returncode != 0:
            self.errors.append(" ".join(arguments) + ": " + done.stdout + done.stderr)
        return done.stdout

    def exchange(self, verb, name):
        start = time.monotonic()
        self.docent("maps", verb, "--library", str(self.folder / name), "--hub", self.options.hub)
        self.times[verb].append(time.monotonic() - start)

    def curate(self, name):
        for number in range(1, 1_000_000):
            if time.monotonic() > self.end:
                return
            sign = f"{name} says {number}."
            self.docent("content", "add", "--signpost", sign, "--map", self.options.map, "--at", "0", "0", "2",
                        "--library", str(self.folder / name))
            self.exchange("push", name)
            self.added.append(sign)
            time.sleep(1)

    def follow(self, name):
        while time.monotonic() < self.end:
            self.exchange("pull", name)
            time.sleep(random.uniform(1, 4))


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("docent")
    parser.add_argument("hub")
    parser.add_argument("map")
    parser.add_argument("--devices", type=int, default=30)
    parser.add_argument("--curators", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=60)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        run = Run(options, pathlib.Path(folder))
        curators = [f"curator-{i}" for i in range(options.curators)]
        devices = [f"device-{i}" for i in range(options.devices)]
        for name in curators:
            run.exchange("pull", name)
        run.times = {"push": [], "pull": []}
        threads = [threading.Thread(target=run.curate, args=(name,)) for name in curators]
        threads += [threading.Thread(target=run.follow, args=(name,)) for name in devices]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for verb, times in run.times.items():
            times.sort()
            print(f"{verb}: {len(times)}, median {1000 * statistics.median(times):.0f} ms, "
                  f"95 % below {1000 * times[int(0.95 * len(times))]:.0f} ms")
        for name in curators:  # what a pull has merged is still to be pushed
            run.exchange("push", name)
        contents = set()
        for name in curators + devices:
            run.exchange("pull", name)
            run.docent("maps", "verify", "--library", str(run.folder / name))
            contents.add(run.docent("content", "list", "--library", str(run.folder / name), "--map", options.map))
        missing = [sign for sign in run.added if any(sign not in content for content in contents)]
        print(f"{len(run.added)} signs, {len(missing)} missing, {len(contents)} different states, {len(run.errors)} errors")
        print("\n".join(run.errors[:5]))
        return 1 if missing or run.errors or len(contents) != 1 else 0


if __name__ == "__main__":
    sys.exit(main())
