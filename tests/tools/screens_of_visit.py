#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Takes images of what a visitor sees in each state of a visit, for every size of the screen and every language.

Two recordings are played in a window: one of a place that the library does not know (welcome, searching, the known
views after five seconds, the list of stops after thirty) and one of a place that it knows (arrival, guiding, a card,
the menu, the question whether to begin anew, the list of stops, the end of the tour, and the half second after the
place is lost, if the recording leaves it). The recordings are played fast where nothing is looked at. The images are DIR/SIZE-LANGUAGE-STATE.png, and DIR/SIZE-LANGUAGE.png has all of them.
Needs Xvfb, xdotool and ffmpeg.

    tests/tools/screens_of_visit.py --docent build/release/docent --library museum.docent --tour Highlights \\
        --known walk --calibration walk/calibration.yaml --from 34 --unknown elsewhere --output screens
"""
import argparse
import os
import pathlib
import signal
import subprocess
import time

SIZES = ["800x480", "1280x800", "1920x1200", "1200x1920"]
LANGUAGES = ["en", "de", "es", "ar"]


class Screen:
    """A virtual screen that a tour fills."""

    def __init__(self, options, size, language, arguments, name):
        self.size, self.prefix, self.taken = size, options.output / f"{size}-{language}", []
        read, write = os.pipe()
        self.server = subprocess.Popen(["Xvfb", "-noreset", "-displayfd", str(write), "-screen", "0", size + "x24",
                                        "-dpi", str(options.dpi)], pass_fds=[write], stderr=subprocess.DEVNULL)
        os.close(write)
        self.display = ":" + os.fdopen(read).readline().strip()
        self.environment = dict(os.environ, DISPLAY=self.display)
        self.output = options.output / f"{size}-{language}-{name}"
        self.tour = subprocess.Popen(
            [options.docent, "tour", "--library", options.library, "--tour", options.tour, "--language", language,
             "--sound", "off", "--output", self.output, *arguments], env=self.environment,
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE)
        self.xdotool("search", "--sync", "--onlyvisible", "--name", "Docent", "windowfocus")
        self.xdotool("search", "--name", "Docent", "windowmove", "0", "0", "windowsize", *size.split("x"))

    def xdotool(self, *arguments):
        subprocess.run(["timeout", "60", "xdotool", *arguments], env=self.environment, stdout=subprocess.DEVNULL,
                       stderr=subprocess.DEVNULL, check=False)

    def key(self, *keys):
        for key in keys:
            self.xdotool("keydown", key, "sleep", "0.1", "keyup", key, "sleep", "0.1")

    def image(self, state):
        path = f"{self.prefix}-{state}.png"
        subprocess.run(["ffmpeg", "-loglevel", "error", "-y", "-f", "x11grab", "-draw_mouse", "0",
                        "-video_size", self.size, "-i", self.display, "-frames:v", "1", path], check=True, stdin=subprocess.DEVNULL)
        self.taken.append(path)

    def wait_for_image(self):
        """Waits until the window shows more than its dark ground."""
        end = time.monotonic() + 60
        while time.monotonic() < end:
            small = subprocess.run(
                ["ffmpeg", "-loglevel", "error", "-f", "x11grab", "-draw_mouse", "0", "-video_size", self.size, "-i",
                 self.display, "-frames:v", "1", "-vf", "scale=16:16:flags=area,format=gray", "-f", "rawvideo", "-"],
                check=True, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE).stdout
            if sum(small) / len(small) > 20:
                return
            time.sleep(0.02)

    def image_time(self):
        """The time of the newest image, in seconds from the first one."""
        try:
            lines = (self.output / "frames.csv.part").read_text().splitlines()
            column = lines[0].split(",").index("timestamp")
            return float(lines[-2].split(",")[column]) - float(lines[1].split(",")[column])
        except (FileNotFoundError, IndexError, ValueError):
            return 0

    def last_states(self):
        """The time of the newest image and of the newest one with a pose."""
        try:
            lines = (self.output / "frames.csv.part").read_text().splitlines()[:-1]
            columns = lines[0].split(",")
            rows = [dict(zip(columns, line.split(","))) for line in lines[-60:]]
            return float(rows[-1]["timestamp"]), max(float(row["timestamp"]) for row in rows if row["map"])
        except (FileNotFoundError, IndexError, KeyError, ValueError):
            return 0, 0

    def image_of_loss(self, state, seconds):
        """Waits for a loss of the place, and takes the image within the half second in which content is held."""
        end = time.monotonic() + seconds
        while time.monotonic() < end and self.tour.poll() is None:
            newest, posed = self.last_states()
            if 0.1 <= newest - posed <= 0.3:
                self.image(state)
                if self.last_states()[0] - posed <= 0.6:
                    return
                self.taken.pop()
            time.sleep(0.02)

    def wait(self, seconds):
        end = time.monotonic() + 120
        while self.image_time() < seconds and time.monotonic() < end and self.tour.poll() is None:
            time.sleep(0.02)

    def told(self, part):
        try:
            return part in (self.output / "events.csv.part").read_text()
        except FileNotFoundError:
            return False

    def close(self):
        self.tour.send_signal(signal.SIGINT)
        try:
            self.tour.wait(30)
        except subprocess.TimeoutExpired:
            self.tour.kill()
        self.server.terminate()
        self.server.wait()


def see_unknown(options, size, language):
    screen = Screen(options, size, language, ["--camera", options.unknown, "--pace", "eager", "--seed", "1"],
                    "unknown")
    screen.wait_for_image()
    screen.image("1-welcome")
    screen.wait(2.5)
    screen.image("2-entrances")
    screen.wait(6.5)
    screen.image("3-searching")
    screen.key("f")
    screen.wait(31)
    screen.key("f")
    screen.image("4-stops")
    screen.close()
    return screen.taken


def see_known(options, size, language):
    arguments = ["--camera", options.known, "--from", str(options.begin), "--pace", "eager"]
    if options.calibration:
        arguments += ["--calibration", options.calibration]
    screen = Screen(options, size, language, arguments, "known")
    end = time.monotonic() + 60
    while not screen.told("arrived at") and time.monotonic() < end:
        time.sleep(0.02)
    screen.wait_for_image()
    time.sleep(0.3)
    screen.image("5-arrival")
    time.sleep(2.5)
    screen.image("6-guiding")
    screen.key("Return")
    time.sleep(0.7)
    screen.image("7-card")
    screen.key("Escape", "m")
    time.sleep(0.5)
    screen.image("8-menu")
    screen.key("Escape", "r")
    time.sleep(0.5)
    screen.image("9-anew")
    screen.key("Escape", "l")
    time.sleep(0.5)
    screen.image("A-list")
    screen.key("l")
    end = time.monotonic() + 30
    while not screen.told(",tour,finished") and time.monotonic() < end:
        screen.key("n")
    time.sleep(0.5)
    screen.image("B-finished")
    screen.close()
    taken = screen.taken
    screen = Screen(options, size, language, arguments, "moment")
    while not screen.told("arrived at") and time.monotonic() < end + 60 and screen.tour.poll() is None:
        time.sleep(0.02)
    screen.image_of_loss("C-moment", 30)
    screen.close()
    return taken + screen.taken


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--docent", required=True)
    parser.add_argument("--library", required=True)
    parser.add_argument("--tour", required=True)
    parser.add_argument("--known", required=True, help="camera that shows a stop of the tour")
    parser.add_argument("--calibration", help="of this camera")
    parser.add_argument("--from", dest="begin", type=float, default=0, help="seconds from its first image")
    parser.add_argument("--unknown", required=True, help="camera that shows a place that the library does not know")
    parser.add_argument("--dpi", type=int, default=96, help="of the screens")
    parser.add_argument("--sizes", nargs="+", default=SIZES)
    parser.add_argument("--languages", nargs="+", default=LANGUAGES)
    parser.add_argument("--output", type=pathlib.Path, required=True, help="folder for the images")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    for size in options.sizes:
        for language in options.languages:
            taken = see_unknown(options, size, language) + see_known(options, size, language)
            scale = "scale=640:-2" if size.split("x")[0] > size.split("x")[1] else "scale=360:-2"
            inputs = [argument for path in taken for argument in ("-i", path)]
            tiles = "".join(f"[{i}]{scale}[t{i}];" for i in range(len(taken))) + "".join(
                f"[t{i}]" for i in range(len(taken)))
            subprocess.run(["ffmpeg", "-loglevel", "error", "-y", *inputs, "-filter_complex",
                            f"{tiles}concat=n={len(taken)}:v=1:a=0,tile=4x3[out]", "-map", "[out]", "-frames:v",
                            "1", options.output / f"{size}-{language}.png"], check=True, stdin=subprocess.DEVNULL)
            print(options.output / f"{size}-{language}.png", flush=True)


if __name__ == "__main__":
    main()
