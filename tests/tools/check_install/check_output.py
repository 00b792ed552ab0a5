#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Compares what the examples printed and drew with the truth of a simulated recording; for check_install.sh.

  check_output.py poses POSES RECORDING MIN_COUNT MAX_ERROR MAX_ANGLE_DEG
      aligns the positions (TUM format) to groundtruth.txt by a similarity; the root mean square of the distances is at
      most MAX_ERROR metres and that of the rotations at most MAX_ANGLE_DEG.
  check_output.py drawn FOLDER RECORDING
      in each image, between 0.2 % and 30 % of the pixels differ from the recording's image of that time, and these lie in
      one part of the image.

Needs Python's standard library, and ffmpeg to decode images.
"""
import math
import pathlib
import subprocess
import sys


def read_poses(path):
    """time: (centre, quaternion x y z w), world or map from camera."""
    poses = {}
    for line in pathlib.Path(path).read_text(encoding="utf-8").splitlines():
        if line.strip() and not line.startswith("#"):
            numbers = [float(x) for x in line.split()]
            poses[round(numbers[0], 6)] = (numbers[1:4], numbers[4:8])
    return poses


def product(a, b):
    x, y, z, w = a
    p, q, r, s = b
    return [w * p + x * s + y * r - z * q, w * q - x * r + y * s + z * p, w * r + x * q - y * p + z * s,
            w * s - x * p - y * q - z * r]


def conjugate(q):
    return [-q[0], -q[1], -q[2], q[3]]


def rotate(q, v):
    return product(product(q, [*v, 0.0]), conjugate(q))[:3]


def mean(vectors):
    return [sum(v[i] for v in vectors) / len(vectors) for i in range(3)]


def alignment(source, target):
    """The quaternion, scale and translation that map source to target with the least squares (Horn 1987)."""
    a, b = mean(source), mean(target)
    p = [[v[i] - a[i] for i in range(3)] for v in source]
    q = [[v[i] - b[i] for i in range(3)] for v in target]
    s = [[sum(x[i] * y[j] for x, y in zip(p, q)) for j in range(3)] for i in range(3)]
    n = [[s[0][0] - s[1][1] - s[2][2], s[0][1] + s[1][0], s[0][2] + s[2][0], s[1][2] - s[2][1]],
         [s[0][1] + s[1][0], s[1][1] - s[0][0] - s[2][2], s[1][2] + s[2][1], s[2][0] - s[0][2]],
         [s[0][2] + s[2][0], s[1][2] + s[2][1], s[2][2] - s[0][0] - s[1][1], s[0][1] - s[1][0]],
         [s[1][2] - s[2][1], s[2][0] - s[0][2], s[0][1] - s[1][0], s[0][0] + s[1][1] + s[2][2]]]
    # The eigenvector of the largest eigenvalue, by iteration with a shift that makes all eigenvalues positive.
    shift = math.sqrt(sum(x * x for row in n for x in row))
    rotation = [0.5, 0.4, 0.3, 0.7]
    for _ in range(20000):
        following = [sum(n[i][j] * rotation[j] for j in range(4)) + shift * rotation[i] for i in range(4)]
        norm = math.sqrt(sum(x * x for x in following))
        following = [x / norm for x in following]
        step = max(abs(x - y) for x, y in zip(following, rotation))
        rotation = following
        if step < 1e-15:
            break
    scale = math.sqrt(sum(x * x for v in q for x in v) / sum(x * x for v in p for x in v))
    return rotation, scale, [b[i] - scale * rotate(rotation, a)[i] for i in range(3)]


def check_poses(poses, recording, min_count, max_error, max_angle):
    found = read_poses(poses)
    truth = read_poses(pathlib.Path(recording) / "groundtruth.txt")
    # Before a map has finite points, only the rotation is known, and the position is the origin.
    times = [time for time in found if time in truth and any(found[time][0])]
    if len(times) < max(4, min_count):
        return f"{poses} has {len(times)} poses with a true one, fewer than {min_count}"
    rotation, scale, shift = alignment([found[t][0] for t in times], [truth[t][0] for t in times])
    squares = angles = 0.0
    for time in times:
        moved = [scale * x + y for x, y in zip(rotate(rotation, found[time][0]), shift)]
        squares += sum((x - y) ** 2 for x, y in zip(moved, truth[time][0]))
        error = product(conjugate(truth[time][1]), product(rotation, found[time][1]))
        angles += (2 * math.atan2(math.sqrt(sum(x * x for x in error[:3])), abs(error[3]))) ** 2
    distance, angle = math.sqrt(squares / len(times)), math.degrees(math.sqrt(angles / len(times)))
    print(f"{len(times)} poses, {distance * 1000:.2f} mm and {angle:.3f} degrees from the truth")
    if distance > max_error or angle > max_angle:
        return f"that is more than {max_error * 1000:g} mm or {max_angle:g} degrees"
    return ""


def pixels(path):
    """The width of an image, and the bytes of its red, green and blue values."""
    size = subprocess.run(["ffprobe", "-v", "error", "-show_entries", "stream=width", "-of", "csv=p=0", path],
                          check=True, capture_output=True, text=True).stdout
    data = subprocess.run(["ffmpeg", "-v", "error", "-i", path, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"], check=True,
                          capture_output=True).stdout
    return int(size), data


def check_drawn(folder, recording):
    drawn = sorted(pathlib.Path(folder).glob("*.png"))
    if len(drawn) < 5:
        return f"{folder} has {len(drawn)} images"
    for path in drawn[::3]:
        width, after = pixels(path)
        _, before = pixels(pathlib.Path(recording) / "rgb" / path.name)
        if len(after) != len(before):
            return f"{path} has another size than the recording"
        count = len(after) // 3
        changed = [i for i in range(count) if after[3 * i:3 * i + 3] != before[3 * i:3 * i + 3]]
        share = len(changed) / count
        if not 0.002 <= share <= 0.3:
            return f"in {path}, {100 * share:.2f} % of the pixels changed"
        columns, rows = [i % width for i in changed], [i // width for i in changed]
        area = (max(columns) - min(columns) + 1) * (max(rows) - min(rows) + 1)
        if len(changed) < 0.5 * area:
            return f"in {path}, the changed pixels are scattered"
    print(f"{len(drawn[::3])} images have a model in them")
    return ""


if __name__ == "__main__":
    if sys.argv[1] == "poses":
        problem = check_poses(sys.argv[2], sys.argv[3], int(sys.argv[4]), float(sys.argv[5]), float(sys.argv[6]))
    else:
        problem = check_drawn(sys.argv[2], sys.argv[3])
    if problem:
        sys.exit(problem)
