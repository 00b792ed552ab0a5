#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Measures a tour in a window on a machine that is slowed down to a share of its processor.

The program runs for that share of every tenth of a second and is stopped for the rest, as a control group with
a processor quota would do, once it has had time to start. A key is pressed every few seconds, and the time until its
command stands in events.csv is measured. The screen is captured meanwhile, and the images on it that differ from the
one before are counted. Needs Xvfb, xdotool and ffmpeg. Images of a folder cost about what those of a camera
do; a simulated camera costs more than the whole share, and a video has to be decoded as a whole.

    tests/tools/measure_slow_machine.py --docent build/release/docent --share 0.1 --seconds 60 --output slow \\
        -- --library museum.docent --camera images --calibration camera.yaml --pace realtime --tour Highlights
"""
import argparse
import csv
import json
import os
import pathlib
import signal
import subprocess
import threading
import time

PERIOD_S = 0.1


def throttle(pid, share, stop):
    """Lets a process run for a share of each period until `stop` is set."""
    while not stop.is_set():
        try:
            os.kill(pid, signal.SIGCONT)
            time.sleep(share * PERIOD_S)
            if share < 1:
                os.kill(pid, signal.SIGSTOP)
            time.sleep((1 - share) * PERIOD_S)
        except ProcessLookupError:
            return
    try:
        os.kill(pid, signal.SIGCONT)
    except ProcessLookupError:
        pass


def count_commands(events):
    try:
        return sum(1 for line in events.read_text(errors="replace").splitlines() if ",command," in line)
    except FileNotFoundError:
        return 0


def press_keys(environment, events, seconds):
    """Presses N and B in turn and returns how long each took to be carried out, in seconds; None for never."""
    answers = []
    end = time.monotonic() + seconds
    while time.monotonic() + 3 < end:
        before = count_commands(events)
        begin = time.monotonic()
        key = "nb"[len(answers) % 2]
        subprocess.run(["xdotool", "search", "--name", "Docent", "windowfocus", "key", key], env=environment,
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
        answer = None
        while time.monotonic() - begin < 2.5:
            if count_commands(events) > before:
                answer = time.monotonic() - begin
                break
            time.sleep(0.01)
        answers.append(answer)
        time.sleep(max(0, begin + 3 - time.monotonic()))
    return answers


class ScreenWatch:
    """Captures the screen in grey and small, and notes when it has changed."""

    WIDTH, HEIGHT = 320, 200

    def __init__(self, display, size, seconds):
        self.seconds = seconds
        self.changes = []  # In seconds from the beginning.
        self.captured = 0
        self._begin = time.monotonic()
        self._ffmpeg = subprocess.Popen(
            ["ffmpeg", "-loglevel", "error", "-f", "x11grab", "-framerate", "25", "-video_size", size, "-i", display,
             "-vf", f"scale={self.WIDTH}:{self.HEIGHT}:flags=area,format=gray", "-f", "rawvideo", "-"],
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, stdin=subprocess.DEVNULL)
        self._thread = threading.Thread(target=self._watch)
        self._thread.start()

    def _watch(self):
        last = None
        while image := self._ffmpeg.stdout.read(self.WIDTH * self.HEIGHT):
            now = time.monotonic() - self._begin
            if now > self.seconds:
                break
            self.captured += 1
            if last is not None and image != last:
                self.changes.append(now)
            last = image

    def describe(self):
        """Waits for the end, and says how often the image on the screen has changed."""
        self._thread.join()
        self._ffmpeg.terminate()
        times = [0, *self.changes, self.seconds]
        gaps = [after - before for before, after in zip(times, times[1:])]
        longest = max(range(len(gaps)), key=gaps.__getitem__)
        return (f"{len(self.changes) / self.seconds:.1f} images a second on the screen ({self.captured} captures); "
                f"from one to the next: {summarize(gaps)} (from second {times[longest]:.1f} on)")


def summarize(seconds):
    if not seconds:
        return "none"
    ordered = sorted(seconds)
    return (f"median {ordered[len(ordered) // 2]:.2f} s, 95th percentile {ordered[int(0.95 * len(ordered))]:.2f} s, "
            f"longest {ordered[-1]:.2f} s")


def describe_frames(rows, begin):
    """Says how often images were tracked from `begin` on, in seconds from the first image."""
    times = [float(row["timestamp"]) for row in rows]
    tracked = [t for row, t in zip(rows, times) if row["state"] != "dropped" and t - times[0] >= begin]
    if len(tracked) < 2:
        return "no images were tracked"
    with_pose = sum(1 for row, t in zip(rows, times) if row["map"] and t - times[0] >= begin)
    gaps = [after - before for before, after in zip(tracked, tracked[1:])]
    return (f"{len(tracked) / (times[-1] - times[0] - begin):.1f} images a second tracked, {with_pose} of "
            f"{len(tracked)} with a pose; from one to the next: {summarize(gaps)}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--docent", required=True)
    parser.add_argument("--share", type=float, default=0.1, help="of the processor, 0 to 1")
    parser.add_argument("--seconds", type=float, default=60, help="of the measurement")
    parser.add_argument("--warm-up", type=float, default=8, help="seconds with the whole processor before")
    parser.add_argument("--screen", default="1280x800")
    parser.add_argument("--output", type=pathlib.Path, required=True, help="folder for the files of the tour")
    parser.add_argument("arguments", nargs="+", help="of docent tour")
    options = parser.parse_args()
    read, write = os.pipe()
    server = subprocess.Popen(["Xvfb", "-noreset", "-displayfd", str(write), "-screen", "0",
                               options.screen + "x24"],
                              pass_fds=[write], stderr=subprocess.DEVNULL)
    os.close(write)
    display = os.fdopen(read).readline().strip()
    environment = dict(os.environ, DISPLAY=":" + display)
    tour = subprocess.Popen([options.docent, "tour", *options.arguments, "--output", str(options.output)],
                            env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
    subprocess.run(["xdotool", "search", "--sync", "--onlyvisible", "--name", "Docent", "windowfocus"],
                   env=environment, stdout=subprocess.DEVNULL, check=True)
    subprocess.run(["xdotool", "search", "--name", "Docent", "windowsize", "100%", "100%"], env=environment,
                   stdout=subprocess.DEVNULL, check=False)
    events = options.output / "events.csv.part"
    while not events.exists() and tour.poll() is None:
        time.sleep(0.05)
    begin = time.monotonic()
    time.sleep(options.warm_up)
    stop = threading.Event()
    slow = threading.Thread(target=throttle, args=(tour.pid, options.share, stop))
    slow.start()
    slow_from = time.monotonic() - begin
    watched = ScreenWatch(":" + display, options.screen, options.seconds)
    answers = press_keys(environment, events, options.seconds)
    seen = watched.describe()
    stop.set()
    slow.join()
    tour.send_signal(signal.SIGINT)
    printed = tour.communicate(timeout=60)[0]
    server.terminate()
    camera = json.loads((options.output / "report.json").read_text())["cameras"][0]
    told = (options.output / "events.csv").read_text().splitlines()
    print(printed.strip())
    print("answers of keys in s:", [None if a is None else round(a, 2) for a in answers])
    print(f"{sum(a is not None and a <= 1 for a in answers)} of {len(answers)} keys answered within a second:",
          summarize([a for a in answers if a is not None]))
    with (options.output / "frames.csv").open() as file:
        print("while slow:", describe_frames(list(csv.DictReader(file)), slow_from))
    print("while slow:", seen)
    print("images:", camera["frames"], "dropped:", camera["dropped"], "tracking ms:", camera["tracking_ms"])
    print("latency ms:", camera["latency_ms"], "interval of drawn images ms:", camera.get("drawn_interval_ms"))
    print("\n".join(line for line in told if ",load," in line))


if __name__ == "__main__":
    main()
