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

# folder prefix -> project prefixes that it may include (the longest matching prefix decides)
ALLOWED = {
    "engine/base": ["engine/base"],
    "engine/geometry": ["engine/base", "engine/geometry"],
    "engine": ["engine"],
    "maps": ["engine", "maps"],
    "content": ["engine/base", "engine/geometry", "content"],
    "ui": ["engine", "content", "ui"],
    "app": ["engine", "maps", "content", "ui", "app"],
}
PROJECT = ("engine/", "maps/", "content/", "ui/", "app/")
# third-party header prefix -> the only places that may include it
RESTRICTED = {
    "ceres/": ["app/calibration/lens_solver.cpp",
              "app/evaluation/true_depth.cpp"],
    "sqlite3.h": ["maps/"],
    "tiny_gltf.h": ["content/"],
    "assimp/": ["content/"],
    "GLFW/": ["ui/"],
    "epoxy/": ["ui/"],
    "imgui": ["ui/"],
    "pango/": ["ui/"],
    "opencv2/": ["engine/vision/", "engine/map/", "engine/tracking/", "engine/mapping/",
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
