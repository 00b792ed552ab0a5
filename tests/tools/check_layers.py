#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Fails if an include violates the layer table of the architecture.

Each folder may include its own headers and those of the folders in its row; third-party headers are
restricted where the table names them.
"""
import pathlib
import re
import sys
import tempfile

# folder prefix -> project prefixes that it may include (the longest matching prefix decides). Every folder below
# engine/ and app/ has a row of its own, and a row names only folders that stand above it, so that there are no
# circles.
ENGINE_BASE = ["engine/base", "engine/geometry"]
ENGINE_MAP = ENGINE_BASE + ["engine/vision", "engine/map"]
ENGINE_MATCHING = ENGINE_MAP + ["engine/matching", "engine/recognition"]
MAPPING_PARTS = ["engine/mapping/points", "engine/mapping/panorama", "engine/mapping/bundle",
                 "engine/mapping/calibration", "engine/mapping/loops"]
ENGINE_MAPPING = ENGINE_MATCHING + ["engine/initialization", "engine/mapping"]
APP_INPUT = ["engine", "app/files", "app/calibration"]
ALLOWED = {
    "engine/base": ["engine/base"],
    "engine/geometry": ENGINE_BASE,
    "engine/vision": ENGINE_BASE + ["engine/vision"],
    "engine/map": ENGINE_MAP,
    "engine/matching": ENGINE_MAP + ["engine/matching"],
    "engine/recognition": ENGINE_MATCHING,
    "engine/dense": ENGINE_MAP + ["engine/dense"],
    "engine/initialization": ENGINE_MATCHING + ["engine/initialization"],
    "engine/mapping/points": ENGINE_MATCHING + MAPPING_PARTS[:1],
    "engine/mapping/panorama": ENGINE_MATCHING + MAPPING_PARTS[:2],
    "engine/mapping/bundle": ENGINE_MATCHING + MAPPING_PARTS[:3],
    "engine/mapping/calibration": ENGINE_MATCHING + MAPPING_PARTS[:4],
    "engine/mapping/loops": ENGINE_MATCHING + MAPPING_PARTS,
    "engine/mapping": ENGINE_MAPPING,
    "engine/tracking": ENGINE_MAPPING + ["engine/tracking"],
    "engine/system": ["engine"],
    "engine/public": ["engine"],
    "maps": ["engine", "maps"],
    "maps/storage": ["engine", "maps/storage"],
    "maps/index": ["engine", "maps/storage", "maps/index"],
    "maps/library": ["engine", "maps/storage", "maps/index", "maps/library"],
    "maps/exchange": ["engine", "maps/storage", "maps/index", "maps/library", "maps/exchange"],
    "maps/maintenance": ["engine", "maps/storage", "maps/index", "maps/library", "maps/exchange", "maps/maintenance"],
    "maps/hub": ["engine", "maps/storage", "maps/index", "maps/library", "maps/hub"],
    "content": ["engine/base", "engine/geometry", "content"],
    "content/gltf": ["engine/base", "engine/geometry", "content"],
    "ui": ["engine", "content", "ui"],
    "app": ["engine", "maps", "content", "ui", "app"],
    "app/files": ["engine", "maps", "app/files"],
    "app/calibration": APP_INPUT,
    "app/public": ["engine", "app/calibration", "app/cameras"],
    "app/output": APP_INPUT + ["maps", "ui", "content", "app/output"],
    "app/simulator": APP_INPUT + ["app/output", "app/simulator"],
    "app/cameras": APP_INPUT + ["app/simulator", "app/cameras"],
    "app/script": APP_INPUT + ["content", "maps", "app/script"],
    "app/sound": ["engine", "content", "app/sound"],
    "app/session": APP_INPUT + ["maps", "content", "ui", "app/output", "app/simulator", "app/cameras", "app/script",
                                "app/session"],
    "app/evaluation": APP_INPUT + ["maps", "app/output", "app/simulator", "app/cameras", "app/session",
                                   "app/evaluation"],
    "app/visits": APP_INPUT + ["app/evaluation", "app/visits"],
    "app/demo": APP_INPUT + ["maps", "content", "app/simulator", "app/script", "app/session", "app/demo"],
}
PROJECT = ("engine/", "maps/", "content/", "ui/", "app/")
# third-party header prefix -> the only places that may include it
RESTRICTED = {
    "ceres/": ["app/calibration/lens_solver.cpp",
              "app/evaluation/true_depth.cpp"],
    "sqlite3.h": ["maps/"],
    "pqxx/": ["maps/hub/hub_connection.cpp"],
    "libpq-fe.h": ["maps/hub/hub_address.cpp"],
    "tiny_gltf.h": ["content/"],
    "assimp/": ["content/"],
    "GLFW/": ["ui/"],
    "epoxy/": ["ui/"],
    "imgui": ["ui/"],
    "pango/": ["ui/"],
    "opencv2/": ["engine/vision/", "engine/map/", "engine/dense/", "engine/matching/", "engine/initialization/", "engine/tracking/", "engine/mapping/",
                 "engine/recognition/", "maps/", "ui/", "app/"],
    "filesystem": ["maps/", "content/", "ui/", "app/"],
    "fstream": ["maps/", "content/", "ui/", "app/"],
}
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^">]+)[">]')


def breaches(root):
    root = pathlib.Path(root)
    found = []
    for top in ("engine", "maps", "content", "ui", "app"):
        for path in sorted((root / top).rglob("*")):
            if path.suffix not in (".h", ".cpp"):
                continue
            name = path.relative_to(root).as_posix()
            row = max((p for p in ALLOWED if name.startswith(p + "/")), key=len)
            for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
                match = INCLUDE.match(line)
                if not match:
                    continue
                header = match.group(1)
                if header.startswith(PROJECT):
                    if not any(header.startswith(p + "/") for p in ALLOWED[row]):
                        found.append(f"{name}:{number}: {row} may not include {header}")
                for prefix, places in RESTRICTED.items():
                    if header.startswith(prefix) and not any(name.startswith(p) for p in places):
                        found.append(f"{name}:{number}: {prefix} belongs to {', '.join(places)}")
    return found


def self_test():
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        for top in ("engine/geometry", "maps", "content", "ui", "app"):
            (root / top).mkdir(parents=True)
        (root / "content/a.h").write_text('#include "engine/geometry/rigid3.h"\n')
        assert not breaches(root)
        (root / "content/a.h").write_text('#include "engine/map/map.h"\n')
        assert len(breaches(root)) == 1, "an include against the table must be found"
        (root / "content/a.h").write_text("")
        (root / "engine/geometry/b.h").write_text("#include <ceres/ceres.h>\n")
        assert len(breaches(root)) == 1, "a restricted header must be found"


if __name__ == "__main__":
    if sys.argv[1:] == ["--self-test"]:
        self_test()
        sys.exit(0)
    problems = breaches(sys.argv[1])
    print("\n".join(problems))
    sys.exit(1 if problems else 0)
