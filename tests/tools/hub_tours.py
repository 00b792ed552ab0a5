#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Devices tour a map of a hub while curators add signs to it, each as a process of the real program, and the network
is cut for a while; then checks that all libraries agree, and prints how long edits took to arrive, and tracking with and
without the network.

    docent simulate room --output walk --duration 12
    hub_tours.py build/release/docent postgresql://postgres@127.0.0.1:5432/docent MAP walk
                 [--devices 50] [--curators 3] [--seconds 600] [--cut-at 240] [--cut-seconds 60]

The hub's address must have a host and a port: devices and curators reach it through a relay in this program, which
passes nothing on during the cut, as a network does that is gone without a word.

A machine cannot track 50 cameras at once. So each camera delivers the images of the recording, which are a 30th of
a second apart, at --fps: they are tracked one by one as always, but more slowly.
"""
import argparse
import csv
import pathlib
import random
import re
import select
import socket
import sqlite3
import subprocess
import sys
import tempfile
import threading
import time


class Relay:
    """Passes bytes on between its own port and the hub's, but not while the network is cut."""

    def __init__(self, host, port):
        self.hub = (host, port)
        self.cut = threading.Event()
        self.listener = socket.create_server(("127.0.0.1", 0), backlog=256)
        self.port = self.listener.getsockname()[1]
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self):
        while True:
            near, _ = self.listener.accept()
            threading.Thread(target=self.serve, args=(near,), daemon=True).start()

    def serve(self, near):
        with near:
            try:
                while self.cut.is_set():
                    time.sleep(0.1)
                with socket.create_connection(self.hub) as far:
                    while True:
                        for ready in select.select([near, far], [], [], 0.2)[0]:
                            while self.cut.is_set():
                                time.sleep(0.1)
                            data = ready.recv(1 << 16)
                            if not data:
                                return
                            (far if ready is near else near).sendall(data)
            except OSError:
                return


class Run:
    def __init__(self, options, folder, relay):
        self.options = options
        self.folder = folder
        self.relay = relay
        self.hub = re.sub(r"@[^/]*/", f"@127.0.0.1:{relay.port}/", options.hub)
        self.begin = time.monotonic()
        self.end = self.begin + options.seconds
        self.errors = []
        self.pushed = {}  # when each sign was on the hub
        self.seconds = {"open a library (maps list)": [], "read a map (maps export)": [],
                        "from the start of a tour until its camera runs": [], "push": [],
                        "from a push to the library of a device": [], "the same, around the cut": []}
        self.frames = {"connected": [], "cut": []}  # tracking_ms of the images that were tracked
        self.lost = {"connected": 0, "cut": 0}      # number of the other images
        self.walk = self.slow_walk()

    def cut_begin(self):
        return self.begin + self.options.cut_at

    def cut_end(self):
        return self.cut_begin() + self.options.cut_seconds

    def docent(self, *arguments):
        done = subprocess.run([self.options.docent, *arguments], capture_output=True, text=True, check=False)
        if done.returncode != 0 and not self.cut_begin() - 1 < time.monotonic() < self.cut_end() + 60:
            self.errors.append(" ".join(arguments) + ": " + done.stdout + done.stderr)
        return done

    def library(self, name):
        return str(self.folder / f"{name}.docent")

    def exchange(self, verb, name):
        return self.docent("maps", verb, "--library", self.library(name), "--hub", self.hub).returncode == 0

    def control_network(self):
        time.sleep(max(0, self.cut_begin() - time.monotonic()))
        self.relay.cut.set()
        time.sleep(self.options.cut_seconds)
        self.relay.cut.clear()

    def curate(self, name):
        for number in range(1, 1_000_000):
            time.sleep(random.uniform(5, 15))
            if time.monotonic() > self.end - 20:
                return
            sign = f"{name} says {number}."
            self.docent("content", "add", "--signpost", sign, "--map", self.options.map, "--at", "0", "0", "2",
                        "--library", self.library(name))
            start = time.monotonic()
            if self.exchange("push", name):
                self.pushed[sign] = time.monotonic()
                self.seconds["push"].append(time.monotonic() - start)

    def slow_walk(self):
        """The recording with other times; returns its folder and the number of its images."""
        source, slow = pathlib.Path(self.options.recording).resolve(), self.folder / "walk"
        slow.mkdir()
        (slow / "rgb").symlink_to(source / "rgb")
        (slow / "calibration.yaml").symlink_to(source / "calibration.yaml")
        rows = [line.split() for line in (source / "rgb.txt").read_text().splitlines() if not line.startswith("#")]
        (slow / "rgb.txt").write_text("".join(f"{i / self.options.fps:.6f} {row[1]}\n" for i, row in enumerate(rows)))
        return slow, len(rows)

    def timed(self, what, *arguments):
        start = time.monotonic()
        self.docent(*arguments)
        self.seconds[what].append(time.monotonic() - start)

    def tour(self, name):
        """Visits, one after the other, from the first to the last second."""
        time.sleep(random.uniform(0, self.options.visit / 2))  # else all would start and end together
        visit = 0
        while time.monotonic() < self.end - self.options.visit:
            visit += 1
            self.timed("open a library (maps list)", "maps", "list", "--library", self.library(name))
            self.timed("read a map (maps export)", "maps", "export", self.options.map, "--library", self.library(name),
                       "--output", str(self.folder / f"{name}-{visit}.ply"))
            self.visit(name, self.folder / f"{name}-{visit}")

    def visit(self, name, output):
        walk, images = self.walk
        begin = random.uniform(0, max(0, images / self.options.fps - self.options.visit))
        start = time.monotonic()
        process = subprocess.Popen(
            [self.options.docent, "tour", "--headless", "--library", self.library(name), "--hub", self.hub,
             "--camera", str(walk), "--from", f"{begin:.3f}", "--until", f"{begin + self.options.visit:.3f}",
             "--pace", "realtime", "--output", str(output)],
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        while process.poll() is None and not (output / "frames.csv.part").exists():
            time.sleep(0.01)
        first = time.monotonic()
        self.seconds["from the start of a tour until its camera runs"].append(first - start)
        text = process.communicate()[1]
        if process.returncode != 0:
            self.errors.append(f"{name}: {text}")
            return
        with open(output / "frames.csv", newline="", encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
            for row in rows:
                at = first + float(row["timestamp"]) - float(rows[0]["timestamp"])
                key = "cut" if self.cut_begin() < at < self.cut_end() else "connected"
                if row["state"] != "lost":
                    self.frames[key].append(float(row["tracking_ms"]))
                else:
                    self.lost[key] += 1

    def watch(self, name):
        """Looks in the library of a device for the signs that were pushed."""
        seen = set()
        library = sqlite3.connect(f"file:{self.library(name)}?mode=ro", uri=True)
        while time.monotonic() < self.end:
            time.sleep(0.05)
            missing = [sign for sign in list(self.pushed) if sign not in seen]
            if not missing:
                continue
            try:
                data = b"".join(row[0] for row in library.execute("SELECT data FROM parts WHERE part = 'scene'"))
            except sqlite3.OperationalError:
                continue  # it is being written
            now = time.monotonic()
            for sign in missing:
                if sign.encode() not in data:
                    continue
                seen.add(sign)
                # The network was gone, or just back, when it was pushed or seen.
                after_cut = self.pushed[sign] < self.cut_end() + 60 and now > self.cut_begin()
                key = "the same, around the cut" if after_cut else "from a push to the library of a device"
                self.seconds[key].append(now - self.pushed[sign])


def text_of(values, unit, factor):
    values.sort()
    if not values:
        return "none"
    at = [factor * values[min(len(values) - 1, int(part * len(values)))] for part in (0.5, 0.95, 1)]
    return f"{len(values)}, median {at[0]:.0f}, 95 % below {at[1]:.0f}, longest {at[2]:.0f} {unit}"


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("docent")
    parser.add_argument("hub")
    parser.add_argument("map")
    parser.add_argument("recording", help="a folder that docent simulate has written")
    parser.add_argument("--devices", type=int, default=50)
    parser.add_argument("--curators", type=int, default=3)
    parser.add_argument("--seconds", type=float, default=600)
    parser.add_argument("--cut-at", type=float, default=240)
    parser.add_argument("--cut-seconds", type=float, default=60)
    parser.add_argument("--visit", type=float, default=60, help="seconds of a visit")
    parser.add_argument("--fps", type=float, default=0.5, help="images a second of each device")
    parser.add_argument("--watched", type=int, default=5, help="devices whose libraries are watched")
    options = parser.parse_args()
    host, port = re.search(r"@([^:/]+):(\d+)/", options.hub).groups()
    with tempfile.TemporaryDirectory() as folder:
        run = Run(options, pathlib.Path(folder), Relay(host, int(port)))
        curators = [f"curator-{i}" for i in range(options.curators)]
        devices = [f"device-{i}" for i in range(options.devices)]
        for name in curators + devices:
            run.exchange("pull", name)
        run.begin = time.monotonic()
        run.end = run.begin + options.seconds
        threads = [threading.Thread(target=run.control_network)]
        threads += [threading.Thread(target=run.curate, args=(name,)) for name in curators]
        threads += [threading.Thread(target=run.tour, args=(name,)) for name in devices]
        threads += [threading.Thread(target=run.watch, args=(name,)) for name in devices[:options.watched]]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        for name, values in run.seconds.items():
            print(f"{name}: {text_of(values, 'ms', 1000)}")
        for name, values in run.frames.items():
            print(f"tracking of an image, {name}: {text_of(values, 'ms', 1)}; {run.lost[name]} others")
        for name in curators:  # what a pull has merged is still to be pushed
            run.exchange("push", name)
        contents = set()
        for name in curators + devices:
            run.exchange("pull", name)
            run.docent("maps", "verify", "--library", run.library(name))
            contents.add(run.docent("content", "list", "--library", run.library(name), "--map", options.map).stdout)
        missing = [sign for sign in run.pushed if any(sign not in content for content in contents)]
        print(f"{len(run.pushed)} signs, {len(missing)} missing, {len(contents)} different states, "
              f"{len(run.errors)} errors")
        print("\n".join(run.errors[:5]))
        return 1 if missing or run.errors or len(contents) != 1 else 0


if __name__ == "__main__":
    sys.exit(main())
