#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Repeats the outing of Castle, Klein and Murray (2011, section 6.1) in the simulator, in real time, and measures it.

An author builds a map of each bay of a museum for 45 minutes and places content; then a visitor tours the maps for
20 minutes. Memory, threads and descriptors are sampled every second. Writes outing.json, and outing.png with what is
tracked, which map is recognized, latency and memory over time. Fails if a program fails or a bay has no map. Needs
python3-matplotlib. With --tour-minutes 120 --build-minutes 0 and an existing library, only a tour is measured.

    tests/tools/measure_outing.py --docent build/release/docent --output outing
"""
import argparse
import csv
import json
import os
import pathlib
import subprocess
import sys
import time

MODEL = pathlib.Path(__file__).resolve().parent.parent.parent / "docs/examples/box.gltf"
# A map is started and left that long after the camera has come to a bay, and before it leaves it, seconds.
MARGIN_S = 1
NO_MAP = "-"


def labels_of(options):
    """Times (from the first image) and labels of the simulated walk, twice a bay visit or more."""
    folder = options.output / "walk"
    if not (folder / "segments.txt").is_file():
        subprocess.run([options.docent, "--quiet", "simulate", f"{options.scene},fps=0.5", "--output", folder], check=True)
    lines = [line.split() for line in (folder / "segments.txt").read_text().splitlines() if not line.startswith("#")]
    begin = float(lines[0][0])
    return [(float(when) - begin, label) for when, label in lines]


def stretches(labels):
    """[label, first, last] for each time that the walk is in one place."""
    found = []
    for when, label in labels:
        if found and found[-1][0] == label:
            found[-1][2] = when
        else:
            found.append([label, when, when])
    return found


def write_script(path, builds):
    lines = []
    for label, first, last in builds:
        bay = label.removeprefix("build")
        lines += [f'{first + MARGIN_S:.1f} map new "Bay {bay}"',
                  f'{first + 0.5 * (last - first):.1f} place "{MODEL}" at pixel 320 300',
                  f'{first + 0.6 * (last - first):.1f} signpost "Bay {bay}" at pixel 250 220',
                  f'{last - MARGIN_S:.1f} map stop']
    path.write_text("\n".join(lines) + "\n")


def sample(pid):
    status = dict(line.split(":", 1) for line in pathlib.Path(f"/proc/{pid}/status").read_text().splitlines())
    return {"rss_mb": int(status["VmRSS"].split()[0]) / 1024, "private_mb": int(status["RssAnon"].split()[0]) / 1024,
            "threads": int(status["Threads"]), "descriptors": len(os.listdir(f"/proc/{pid}/fd"))}


def run(command, log):
    """Runs a program to its end; returns its samples, one a second."""
    samples, begin = [], time.monotonic()
    with open(log, "w", encoding="utf-8") as output:
        process = subprocess.Popen([str(word) for word in command], stdout=output, stderr=subprocess.STDOUT)
        while process.poll() is None:
            try:
                samples.append({"seconds": time.monotonic() - begin, **sample(process.pid)})
            except (OSError, KeyError):  # it is just ending
                pass
            time.sleep(1)
    if process.returncode != 0:
        sys.exit(f"{command[2]} ended with status {process.returncode}; see {log}")
    return samples


def read_frames(folder):
    with open(folder / "frames.csv", newline="", encoding="utf-8") as file:
        frames = [row for row in csv.DictReader(file) if row["camera"] == "0"]
    begin = float(frames[0]["timestamp"])
    return [(float(row["timestamp"]) - begin, row["state"], row["map"], float(row["tracking_ms"])) for row in frames]


def flatness(samples):
    """Least and most of each figure after the first minute, and the medians of the minute after it and of the last."""
    later = [s for s in samples if s["seconds"] >= 60]
    if not later:
        return {}
    end = later[-1]["seconds"]

    def median(part, key):
        values = sorted(s[key] for s in part)
        return values[len(values) // 2] if values else None

    second = [s for s in later if s["seconds"] < 120]
    last = [s for s in later if s["seconds"] >= end - 60]
    return {key: {"least": min(s[key] for s in later), "most": max(s[key] for s in later),
                  "second_minute": median(second, key), "last_minute": median(last, key)}
            for key in ("rss_mb", "private_mb", "threads", "descriptors")}


def percentile(values, part):
    return sorted(values)[min(len(values) - 1, int(part * len(values)))] if values else None


def summary(folder, samples):
    frames = read_frames(folder)
    report = json.loads((folder / "report.json").read_text())["cameras"][0]
    times = [ms for _, state, _, ms in frames if state != "dropped"]
    posed = [f for f in frames if f[1] not in ("initializing", "lost", "dropped")]
    return {"seconds": frames[-1][0], "images": len(frames), "dropped": sum(f[1] == "dropped" for f in frames),
            "with_pose": len(posed), "tracking_ms": {"median": percentile(times, 0.5), "p95": percentile(times, 0.95),
                                                    "p99": percentile(times, 0.99), "max": max(times)},
            "latency_ms": report["latency_ms"], "resources": flatness(samples)}


def compare_places(frames, begin, labels):
    """How many images of a visit to a bay had the pose in its map, in another, in none; and seconds until the first."""
    counts = {"right": 0, "other": 0, "none": 0}
    delays = []
    for label, first, last in stretches(labels):
        if not label.startswith("visit") or first < begin or last > begin + frames[-1][0]:
            continue
        bay = "Bay " + label.removeprefix("visit")
        inside = [f for f in frames if first <= f[0] + begin <= last]
        for _, state, name, _ in inside:
            if state == "dropped":
                continue
            counts["none" if not name else "right" if name == bay else "other"] += 1
        named = [f[0] + begin - first for f in inside if f[2] == bay]
        delays.append(named[0] if named else None)
    found = [d for d in delays if d is not None]
    return {"images": counts, "visits": len(delays), "visits_recognized": len(found),
            "seconds_until_recognized": {"median": percentile(found, 0.5), "max": max(found, default=None)}}


def plot(parts, path):
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
    figure, rows = pyplot.subplots(4, len(parts), figsize=(7 * len(parts), 11), squeeze=False)
    for column, (title, frames, samples) in enumerate(parts):
        ratio, recognized, latency, memory = (rows[k][column] for k in range(4))
        bins = {}
        for when, state, _, ms in frames:
            bins.setdefault(int(when // 10), []).append((state, ms))
        minutes = [b / 6 for b in sorted(bins)]
        have = lambda b, states: 100 * sum(s in states for s, _ in bins[b]) / len(bins[b])
        ratio.plot(minutes, [have(b, ("sixdof", "hybrid", "panorama", "relocalized")) for b in sorted(bins)], label="with a pose")
        ratio.plot(minutes, [have(b, ("dropped",)) for b in sorted(bins)], label="came too late")
        ratio.set_ylabel("images, % of 10 s")
        ratio.set_title(title)
        ratio.legend(loc="center right")
        names = sorted({f[2] for f in frames if f[2]}, key=lambda name: int(name.split()[-1]) if name.split()[-1].isdigit() else 99)
        height = {name: k + 1 for k, name in enumerate(names)}
        recognized.plot([f[0] / 60 for f in frames], [height.get(f[2], 0) for f in frames], ",")
        recognized.set_yticks(range(len(names) + 1), [NO_MAP] + names, fontsize=7)
        recognized.set_ylabel("map of the pose")
        timed = [b for b in sorted(bins) if any(s != "dropped" for s, _ in bins[b])]
        values = {b: sorted(ms for s, ms in bins[b] if s != "dropped") for b in timed}
        latency.plot([b / 6 for b in timed], [percentile(values[b], 0.5) for b in timed], label="median of 10 s")
        latency.plot([b / 6 for b in timed], [values[b][-1] for b in timed], label="longest of 10 s", linewidth=0.8)
        latency.set_yscale("log")
        latency.set_ylabel("tracking an image, ms")
        latency.legend()
        at = [s["seconds"] / 60 for s in samples]
        memory.plot(at, [s["rss_mb"] for s in samples], label="resident, MB")
        memory.plot(at, [s["private_mb"] for s in samples], label="of it private, MB")
        memory.plot(at, [s["threads"] for s in samples], label="threads")
        memory.plot(at, [s["descriptors"] for s in samples], label="descriptors")
        memory.set_yscale("log")
        memory.set_ylabel("memory, threads, descriptors")
        memory.set_xlabel("minutes")
        memory.legend()
        for row in rows:
            row[column].grid(alpha=0.3)
    figure.tight_layout()
    figure.savefig(path, dpi=90)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--docent", required=True)
    parser.add_argument("--output", type=pathlib.Path, required=True)
    parser.add_argument("--bays", type=int, default=12)
    parser.add_argument("--fps", type=float, default=10, help="images a second; drawing one takes the simulator 40 ms")
    parser.add_argument("--build-minutes", type=float, default=45, help="0: take the library that is there")
    parser.add_argument("--tour-minutes", type=float, default=20)
    parser.add_argument("--library", type=pathlib.Path, help="default: outing.docent in the output folder")
    options = parser.parse_args()
    options.output = options.output.resolve()
    options.output.mkdir(parents=True, exist_ok=True)
    library = options.library or options.output / "outing.docent"
    # Walking from bay to bay takes four seconds; a round through all bays, ten seconds a bay.
    build_s = max(6, options.build_minutes * 60 / options.bays - 4)
    rounds = int(options.tour_minutes * 60 / (8 * options.bays)) + 2
    options.scene = f"museum:{options.bays},build={build_s:.0f},rounds={rounds}"
    labels = labels_of(options)
    builds = [s for s in stretches(labels) if s[0].startswith("build")]
    begin = builds[-1][2]
    camera = ["--camera", f"sim:{options.scene},fps={options.fps:g}", "--pace", "realtime", "--headless"]
    parts, results = [], {"scene": options.scene, "fps": options.fps}
    if options.build_minutes > 0:
        script = options.output / "author.txt"
        write_script(script, builds)
        samples = run([options.docent, "--quiet", "author", "--library", library, *camera, "--until", f"{begin:.1f}",
                       "--script", script, "--output", options.output / "author"], options.output / "author.log")
        parts.append(("Building", read_frames(options.output / "author"), samples))
        results["building"] = summary(options.output / "author", samples)
        listed = subprocess.run([options.docent, "maps", "list", "--library", library, "--json"], check=True,
                                stdout=subprocess.PIPE, text=True).stdout
        results["maps_missing"] = [f"Bay {k}" for k in range(options.bays) if f'"Bay {k}"' not in listed]
    if options.tour_minutes > 0:
        samples = run([options.docent, "--quiet", "tour", "--library", library, *camera, "--from", f"{begin:.1f}", "--until",
                       f"{begin + 60 * options.tour_minutes:.1f}", "--output", options.output / "tour"], options.output / "tour.log")
        frames = read_frames(options.output / "tour")
        parts.append(("Touring", frames, samples))
        results["touring"] = summary(options.output / "tour", samples)
        results["places"] = compare_places(frames, begin, labels)
    (options.output / "outing.json").write_text(json.dumps(results, indent=1) + "\n")
    print(json.dumps(results, indent=1))
    plot(parts, options.output / "outing.png")
    return 1 if results.get("maps_missing") else 0


if __name__ == "__main__":
    sys.exit(main())
