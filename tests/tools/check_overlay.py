#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Measures, in each frame of a run, the distance between the drawn and the true corners of a checkerboard.

  check_overlay.py --sequence FOLDER --run OUTPUT/NAME [--columns 9 --rows 6 --square 0.04]

The board is the plane z = 0 of the sequence's groundtruth.txt, with its first inner corner at the origin. It is placed
in the map once, by the similarity that fits its corners best over all tracked frames, as a curator would place an
entity; then each frame's live pose (trajectory.txt) projects it. The true corners are projected with groundtruth.txt
and the same calibration.yaml (pinhole, radial-tangential). Prints the mean, the median and the 95th percentile of the
distances in pixels. Needs only Python's standard library.
"""
import argparse
import bisect
import math
import pathlib


def matrix(q):
    x, y, z, w = q
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]


def product(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def transposed(a):
    return [list(column) for column in zip(*a)]


def apply(a, v):
    return [a[i][0] * v[0] + a[i][1] * v[1] + a[i][2] * v[2] for i in range(3)]


def exponential(v):
    angle = math.sqrt(sum(x * x for x in v))
    if angle < 1e-12:
        return matrix([v[0] / 2, v[1] / 2, v[2] / 2, 1])
    s = math.sin(angle / 2) / angle
    return matrix([v[0] * s, v[1] * s, v[2] * s, math.cos(angle / 2)])


def read_poses(path):
    """(time, rotation world_from_camera, centre) of each line."""
    poses = []
    for line in path.read_text().splitlines():
        if line.startswith("#") or not line.strip():
            continue
        n = [float(x) for x in line.split()]
        norm = math.sqrt(sum(x * x for x in n[4:8]))
        poses.append((n[0], matrix([x / norm for x in n[4:8]]), n[1:4]))
    return poses


def read_calibration(path):
    values = {}
    for line in path.read_text().splitlines():
        key, colon, value = line.partition(":")
        if colon and not line.startswith("#"):
            values[key.strip()] = float(value)
    return values


def project(k, rotation, centre, point):
    """The pixel of a world point, or None behind the camera; rotation is world_from_camera."""
    d = [point[i] - centre[i] for i in range(3)]
    x, y, z = apply(transposed(rotation), d)
    if z <= 1e-6:
        return None
    x, y = x / z, y / z
    r2 = x * x + y * y
    radial = 1 + r2 * (k.get("k1", 0) + r2 * (k.get("k2", 0) + r2 * k.get("k3", 0)))
    p1, p2 = k.get("p1", 0), k.get("p2", 0)
    return (k["fx"] * (x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)) + k["cx"],
            k["fy"] * (y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y) + k["cy"])


class Similarity:
    """The similarity map_from_board."""

    def __init__(self, rotation, translation, scale):
        self.rotation, self.translation, self.scale = rotation, translation, scale

    def __call__(self, p):
        r = apply(self.rotation, p)
        return [self.scale * r[i] + self.translation[i] for i in range(3)]

    def perturbed(self, d):
        return Similarity(product(exponential(d[0:3]), self.rotation),
                          [self.translation[i] + d[3 + i] for i in range(3)],
                          self.scale * math.exp(d[6]))


def solve(a, b):
    n = len(b)
    m = [a[i][:] + [b[i]] for i in range(n)]
    for i in range(n):
        pivot = max(range(i, n), key=lambda r: abs(m[r][i]))
        m[i], m[pivot] = m[pivot], m[i]
        for r in range(n):
            if r != i:
                f = m[r][i] / m[i][i]
                m[r] = [x - f * y for x, y in zip(m[r], m[i])]
    return [m[i][n] / m[i][i] for i in range(n)]


def initial_similarity(pairs):
    """An initial value from the middle pose and the spread of the camera centres."""
    (_, rb, cb), (_, rm, cm) = pairs[len(pairs) // 2]
    spread = [math.sqrt(sum(math.dist(p[side][2], pairs[0][side][2]) ** 2 for p in pairs)) for side in (0, 1)]
    scale = spread[1] / spread[0]
    rotation = product(rm, transposed(rb))
    moved = apply(rotation, cb)
    return Similarity(rotation, [cm[i] - scale * moved[i] for i in range(3)], scale)


def residuals(k, board, pairs, place, truth):
    out = []
    for (_, (_, rotation, centre)), row in zip(pairs, truth):
        for corner, true in zip(board, row):
            seen = project(k, rotation, centre, place(corner))
            out.append((0.0, 0.0) if true is None or seen is None else (seen[0] - true[0], seen[1] - true[1]))
    return out


def fit(k, board, pairs, truth, place):
    steps = [1e-6] * 3 + [1e-6] * 3 + [1e-6]
    for _ in range(12):
        base = residuals(k, board, pairs, place, truth)
        columns = []
        for i, step in enumerate(steps):
            perturbation = [0.0] * 7
            perturbation[i] = step
            moved = residuals(k, board, pairs, place.perturbed(perturbation), truth)
            columns.append([((m[0] - b[0]) / step, (m[1] - b[1]) / step) for m, b in zip(moved, base)])
        # Huber's loss limits the influence of the first frames, while the map is still inaccurate.
        weights = [1.0 if math.hypot(*b) < 2 else 2 / math.hypot(*b) for b in base]
        normal = [[sum(w * (p[0] * q[0] + p[1] * q[1]) for w, p, q in zip(weights, columns[i], columns[j]))
                   for j in range(7)] for i in range(7)]
        right = [-sum(w * (p[0] * b[0] + p[1] * b[1]) for w, p, b in zip(weights, columns[i], base))
                 for i in range(7)]
        for i in range(7):
            normal[i][i] *= 1 + 1e-9
        step = solve(normal, right)
        place = place.perturbed(step)
        if max(abs(x) for x in step) < 1e-9:
            break
    return place


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sequence", required=True, type=pathlib.Path)
    parser.add_argument("--run", required=True, type=pathlib.Path)
    parser.add_argument("--columns", type=int, default=9)
    parser.add_argument("--rows", type=int, default=6)
    parser.add_argument("--square", type=float, default=0.04)
    parser.add_argument("--skip-seconds", type=float, default=0,
                        help="ignore frames this many seconds after the first, while the map is initialized")
    arguments = parser.parse_args()
    k = read_calibration(arguments.sequence / "calibration.yaml")
    board = [[c * arguments.square, r * arguments.square, 0.0]
             for r in range(arguments.rows) for c in range(arguments.columns)]
    true_poses = read_poses(arguments.sequence / "groundtruth.txt")
    times = [p[0] for p in true_poses]
    pairs = []
    for pose in read_poses(arguments.run / "trajectory.txt"):
        i = bisect.bisect_left(times, pose[0] - 0.005)
        if i < len(times) and abs(times[i] - pose[0]) <= 0.005:
            pairs.append((true_poses[i], pose))
    pairs = [p for p in pairs if p[1][0] - pairs[0][1][0] >= arguments.skip_seconds]
    if len(pairs) < 3:
        raise SystemExit("Fewer than three frames have both a pose and a true pose.")
    truth = [[project(k, rotation, centre, corner) for corner in board] for (_, rotation, centre), _ in pairs]
    some = range(0, len(pairs), max(1, len(pairs) // 60))
    place = fit(k, board, [pairs[i] for i in some], [truth[i] for i in some], initial_similarity(pairs))
    errors = sorted(math.hypot(*r) for r in residuals(k, board, pairs, place, truth))
    print(f"{len(pairs)} frames, {len(board)} corners: mean {sum(errors) / len(errors):.2f} px, "
          f"median {errors[len(errors) // 2]:.2f} px, 95 % below {errors[int(0.95 * len(errors))]:.2f} px")


if __name__ == "__main__":
    main()
