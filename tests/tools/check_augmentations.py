#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Measures the placement error of each augmentation of a tour, in pixels, and how often the right map was recognized.

  check_augmentations.py --docent build/docent --library L.docent --sequence FOLDER
                         --author AUTHOR_OUTPUT --tour TOUR_OUTPUT

The true position of an entity follows from the author's run: the similarity truth_from_map (Umeyama 1991) between the
author's camera centres in that map and groundtruth.txt transforms its position to the world. In each frame of the tour
the true pose projects this point through calibration.yaml; the error is its distance to the pixel in
augmentations.csv. The right map of a `visitK` segment is the map that was current in most frames of `buildK`. Needs
only Python's standard library.
"""
import argparse
import bisect
import collections
import csv
import json
import math
import pathlib
import subprocess


def rotation(qx, qy, qz, qw):
    n = math.sqrt(qx * qx + qy * qy + qz * qz + qw * qw)
    x, y, z, w = qx / n, qy / n, qz / n, qw / n
    return [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]


def apply(matrix, v):
    return [sum(row[i] * v[i] for i in range(3)) for row in matrix]


def transposed(matrix):
    return [list(column) for column in zip(*matrix)]


def largest_eigenvector(matrix):
    """The eigenvector of a symmetric 4x4 matrix with the largest eigenvalue, by Jacobi rotations."""
    a = [row[:] for row in matrix]
    n = len(a)
    v = [[float(i == j) for j in range(n)] for i in range(n)]
    for _ in range(60):
        for p in range(n):
            for q in range(p + 1, n):
                if abs(a[p][q]) < 1e-300:
                    continue
                theta = 0.5 * math.atan2(2 * a[p][q], a[q][q] - a[p][p])
                c, s = math.cos(theta), math.sin(theta)
                for k in range(n):
                    a[k][p], a[k][q] = c * a[k][p] - s * a[k][q], s * a[k][p] + c * a[k][q]
                for k in range(n):
                    a[p][k], a[q][k] = c * a[p][k] - s * a[q][k], s * a[p][k] + c * a[q][k]
                for k in range(n):
                    v[k][p], v[k][q] = c * v[k][p] - s * v[k][q], s * v[k][p] + c * v[k][q]
    best = max(range(n), key=lambda i: a[i][i])
    return [v[k][best] for k in range(n)]


def align(truth, points):
    """The least-squares similarity truth = scale * R * point + t; the rotation by Horn's quaternion method (1987)."""
    n = len(points)
    mean_t = [sum(p[i] for p in truth) / n for i in range(3)]
    mean_p = [sum(p[i] for p in points) / n for i in range(3)]
    s = [[0.0] * 3 for _ in range(3)]
    variance = 0.0
    for t, p in zip(truth, points):
        a = [p[i] - mean_p[i] for i in range(3)]
        b = [t[i] - mean_t[i] for i in range(3)]
        variance += sum(x * x for x in a)
        for i in range(3):
            for j in range(3):
                s[i][j] += a[i] * b[j]
    horn = [[s[0][0] + s[1][1] + s[2][2], s[1][2] - s[2][1], s[2][0] - s[0][2], s[0][1] - s[1][0]],
            [s[1][2] - s[2][1], s[0][0] - s[1][1] - s[2][2], s[0][1] + s[1][0], s[2][0] + s[0][2]],
            [s[2][0] - s[0][2], s[0][1] + s[1][0], -s[0][0] + s[1][1] - s[2][2], s[1][2] + s[2][1]],
            [s[0][1] - s[1][0], s[2][0] + s[0][2], s[1][2] + s[2][1], -s[0][0] - s[1][1] + s[2][2]]]
    w, x, y, z = largest_eigenvector(horn)
    r = rotation(x, y, z, w)
    scale = sum(r[j][i] * s[i][j] for i in range(3) for j in range(3)) / variance
    turned = apply(r, mean_p)
    return scale, r, [mean_t[i] - scale * turned[i] for i in range(3)]


def read_calibration(path):
    values = {}
    for line in path.read_text().splitlines():
        key, _, value = line.split("#")[0].partition(":")
        if value.strip():
            values[key.strip()] = value.strip()
    if values.get("model", "radial_tangential") not in ("radial_tangential", "radtan", "brown"):
        raise SystemExit(f"{path}: only radial-tangential lenses are supported")
    return {k: float(values.get(k, 0)) for k in
            ("width", "height", "fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3")}


def project(c, point):
    if point[2] <= 0:
        return None
    x, y = point[0] / point[2], point[1] / point[2]
    r2 = x * x + y * y
    radial = 1 + r2 * (c["k1"] + r2 * (c["k2"] + r2 * c["k3"]))
    u = x * radial + 2 * c["p1"] * x * y + c["p2"] * (r2 + 2 * x * x)
    v = y * radial + c["p1"] * (r2 + 2 * y * y) + 2 * c["p2"] * x * y
    return c["fx"] * u + c["cx"], c["fy"] * v + c["cy"]


class Truth:
    def __init__(self, path):
        rows = [[float(f) for f in line.split()] for line in path.read_text().splitlines()
                if line.strip() and not line.startswith("#")]
        self.times = [row[0] for row in rows]
        self.rows = rows

    def at(self, time):
        """(position, rotation) of the camera, or None if the nearest true pose is more than 10 ms away."""
        i = bisect.bisect(self.times, time)
        best = min((k for k in (i - 1, i) if 0 <= k < len(self.times)),
                   key=lambda k: abs(self.times[k] - time))
        if abs(self.times[best] - time) > 0.01:
            return None
        row = self.rows[best]
        return row[1:4], rotation(*row[4:8])


def read_labels(path):
    """Times and labels of segments.txt, or empty lists if it does not exist."""
    if not path.exists():
        return [], []
    rows = [line.split() for line in path.read_text().splitlines()
            if line.strip() and not line.startswith("#")]
    return [float(row[0]) for row in rows], [row[1] for row in rows]


def report_maps(author, tour, times, labels):
    def label_at(time):
        i = bisect.bisect(times, time + 1e-6) - 1
        return labels[i] if i >= 0 else ""
    built = collections.defaultdict(collections.Counter)
    for row in author:
        label = label_at(float(row["timestamp"]))
        if row["map"] and label.startswith("build"):
            built[label[5:]][row["map"]] += 1
    frames = named = right = 0
    for row in tour:
        label = label_at(float(row["timestamp"]))
        if not label.startswith("visit"):
            continue
        frames += 1
        named += bool(row["map"])
        right += bool(row["map"]) and built[label[5:]].most_common(1)[0][0] == row["map"]
    if frames:
        print(f"the map was right in {right} of {named} localized frames "
              f"({100 * right / max(1, named):.2f} %); {named} of {frames} frames of visits were localized "
              f"({100 * named / frames:.1f} %)")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    for name in ("docent", "library", "sequence", "author", "tour"):
        parser.add_argument("--" + name, required=True, type=pathlib.Path)
    arguments = parser.parse_args()
    truth = Truth(arguments.sequence / "groundtruth.txt")
    camera = read_calibration(arguments.sequence / "calibration.yaml")
    with open(arguments.author / "frames.csv", newline="") as file:
        author = list(csv.DictReader(file))
    with open(arguments.tour / "frames.csv", newline="") as file:
        tour = list(csv.DictReader(file))
    report_maps(author, tour, *read_labels(arguments.sequence / "segments.txt"))

    pairs = collections.defaultdict(lambda: ([], []))
    for row in author:
        pose = truth.at(float(row["timestamp"]))
        if row["map"] and row["tx"] and pose:
            pairs[row["map"]][0].append(pose[0])
            pairs[row["map"]][1].append([float(row[k]) for k in ("tx", "ty", "tz")])
    world_from_map = {name: align(*both) for name, both in pairs.items() if len(both[0]) >= 10}

    listing = subprocess.run([arguments.docent, "content", "list", "--json", "--library", arguments.library],
                             check=True, capture_output=True, text=True).stdout
    anchors = {}
    for entry in json.loads(listing)["content"]:
        if entry["map"] in world_from_map:
            scale, r, t = world_from_map[entry["map"]]
            turned = apply(r, entry["position"])
            anchors[entry["map"], entry["name"]] = [scale * turned[i] + t[i] for i in range(3)]

    errors = collections.defaultdict(list)
    with open(arguments.tour / "augmentations.csv", newline="") as file:
        for row in csv.DictReader(file):
            pose = truth.at(float(row["timestamp"]))
            anchor = anchors.get((row["map"], row["name"]))
            if pose is None or anchor is None:
                continue
            offset = [anchor[i] - pose[0][i] for i in range(3)]
            seen = project(camera, apply(transposed(pose[1]), offset))
            # The error is limited to the image width, also for an entity whose true position is behind the camera.
            error = camera["width"] if seen is None else math.dist(seen, (float(row["u"]), float(row["v"])))
            errors[row["map"], row["name"]].append(min(error, camera["width"]))
    everything = sorted(e for group in errors.values() for e in group)
    for (name, entity), group in sorted(errors.items()):
        group.sort()
        print(f"{name} / {entity}: {len(group)} frames, median {group[len(group) // 2]:.2f} px, "
              f"mean {sum(group) / len(group):.2f} px, 95 % below {group[int(0.95 * len(group))]:.2f} px")
    if not everything:
        raise SystemExit("No augmentation can be compared with the ground truth.")
    print(f"all: {len(everything)} augmentations drawn, median {everything[len(everything) // 2]:.2f} px, "
          f"mean {sum(everything) / len(everything):.2f} px, "
          f"95 % below {everything[int(0.95 * len(everything))]:.2f} px")


if __name__ == "__main__":
    main()
