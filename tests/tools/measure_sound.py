#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Measures how far sounds and their captions are apart, in a tour in a window.

OpenAL writes what would be heard into a file in real time (ALSOFT_DRIVERS=wave), whose length at each moment tells
when a sample was played. The screen is captured with the times of its images. Needs Xvfb, xdotool and ffmpeg.

    tests/tools/measure_sound.py --docent build/release/docent --seconds 20 --output sound -- \\
        --library museum.docent --camera museum --pace realtime
"""
import argparse
import array
import os
import pathlib
import re
import signal
import subprocess
import threading
import time

WIDTH, HEIGHT, RATE = 640, 480, 30
HEADER_BYTES = 44


def watch_growth(path, stop, sizes):
    """Notes when the file of the sound was how long."""
    while not stop.is_set():
        try:
            sizes.append((time.time(), path.stat().st_size))
        except FileNotFoundError:
            pass
        time.sleep(0.005)


def time_of_byte(sizes, byte):
    """When this byte of the sound was written; the file grows by whole periods, so take the line through them."""
    grown = [(t, s) for i, (t, s) in enumerate(sizes) if i and s > sizes[i - 1][1] and s > HEADER_BYTES]
    near = sorted(grown, key=lambda g: abs(g[1] - byte))[:40]
    mean_t = sum(t for t, _ in near) / len(near)
    mean_s = sum(s for _, s in near) / len(near)
    slope = sum((t - mean_t) * (s - mean_s) for t, s in near) / sum((s - mean_s) ** 2 for _, s in near)
    return mean_t + slope * (byte - mean_s)


def onsets_of_sound(path, sizes):
    """When it became loud after at least half a second of silence."""
    data = path.read_bytes()
    channels = int.from_bytes(data[22:24], "little")
    rate = int.from_bytes(data[24:28], "little")
    bits = int.from_bytes(data[34:36], "little")
    begin = data.index(b"data") + 8
    kind = {16: "h", 32: "f" if int.from_bytes(data[20:22], "little") == 3 or b"\x03\x00\x00\x00\x00\x00\x10"
            in data[20:60] else "i"}[bits]
    step = channels * bits // 8
    samples = array.array(kind)
    samples.frombytes(data[begin:begin + (len(data) - begin) // step * step])
    loudest = max(1e-9, max(map(abs, samples)))
    onsets, quiet_since = [], 0
    for i in range(0, len(samples), channels):
        if abs(samples[i]) < 0.02 * loudest and (channels == 1 or abs(samples[i + 1]) < 0.02 * loudest):
            continue
        if i // channels - quiet_since > 0.5 * rate:
            onsets.append(time_of_byte(sizes, begin + i // channels * step))
        quiet_since = i // channels
    return onsets


def captions_on_screen(frames, times, first_sound):
    """When the caption appeared that stands on the screen about a second after the first sound. Other sentences stand
    there too, and other captions do not count."""
    band = [y * WIDTH + x for y in range(440, 470) for x in range(20, WIDTH - 20)]
    samples = [f for f, at in zip(frames, times) if 0.6 < at - first_sound < 1.6]
    letters = [i for i in band if all(f[i] > 220 for f in samples)]
    if not letters:
        return []
    first, last = min(i % WIDTH for i in letters), max(i % WIDTH for i in letters)
    gaps = [i for i in band if first <= i % WIDTH <= last and all(f[i] < 120 for f in samples)]
    begun, was_there = [], True
    for image, at in zip(frames, times):
        is_there = (sum(image[i] > 200 for i in letters) > 0.9 * len(letters) and
                    sum(image[i] < 150 for i in gaps) > 0.9 * len(gaps))
        if is_there and not was_there:
            begun.append(at)
        was_there = is_there
    return begun


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--docent", required=True)
    parser.add_argument("--seconds", type=float, default=20, help="of the measurement")
    parser.add_argument("--output", type=pathlib.Path, required=True, help="folder for the files of the tour")
    parser.add_argument("arguments", nargs="+", help="of docent tour")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    wave = (options.output / "sound.wav").resolve()
    wave.unlink(missing_ok=True)
    configuration = options.output / "alsoft.conf"
    configuration.write_text(f"[general]\nchannels=mono\nsample-type=int16\nfrequency=48000\n[wave]\nfile={wave}\n")
    read, write = os.pipe()
    server = subprocess.Popen(["Xvfb", "-noreset", "-displayfd", str(write), "-screen", "0",
                               f"{WIDTH}x{HEIGHT}x24"],
                              pass_fds=[write], stderr=subprocess.DEVNULL)
    os.close(write)
    display = ":" + os.fdopen(read).readline().strip()
    environment = dict(os.environ, DISPLAY=display, ALSOFT_DRIVERS="wave", ALSOFT_CONF=str(configuration))
    stop, sizes = threading.Event(), []
    watcher = threading.Thread(target=watch_growth, args=(wave, stop, sizes))
    watcher.start()
    tour = subprocess.Popen([options.docent, "tour", *options.arguments, "--sound", "on", "--output",
                             str(options.output)], env=environment, stdout=subprocess.DEVNULL)
    subprocess.run(["xdotool", "search", "--sync", "--onlyvisible", "--name", "Docent", "windowfocus"],
                   env=environment, stdout=subprocess.DEVNULL, check=True)
    # The times of the captured images are those of the machine's clock.
    capture = subprocess.Popen(
        ["ffmpeg", "-loglevel", "info", "-f", "x11grab", "-framerate", str(RATE), "-video_size",
         f"{WIDTH}x{HEIGHT}", "-t", str(options.seconds), "-i", display, "-vf", "format=gray,showinfo", "-copyts",
         "-fps_mode", "passthrough", "-f", "rawvideo", str(options.output / "screen.gray"), "-y"],
        stderr=subprocess.PIPE, stdin=subprocess.DEVNULL, text=True)
    printed = capture.communicate()[1]
    tour.send_signal(signal.SIGINT)
    tour.wait(60)
    stop.set()
    watcher.join()
    server.terminate()
    times = [int(t) / 1e6 for t in re.findall(r" pts:\s*([0-9]+) ", printed)]  # In microseconds.
    data = (options.output / "screen.gray").read_bytes()
    frames = [data[i:i + WIDTH * HEIGHT] for i in range(0, len(data), WIDTH * HEIGHT)]
    heard = onsets_of_sound(wave, sizes)
    read_times = captions_on_screen(frames, times, heard[0]) if heard else []
    print(f"{len(heard)} sounds and {len(read_times)} captions began, in {len(frames)} images of the screen")
    for onset in heard:
        if read_times:
            nearest = min(read_times, key=lambda t: abs(t - onset))
            print(f"the caption appeared {1000 * (nearest - onset):+.0f} ms after its sound began")


if __name__ == "__main__":
    main()
