#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs clang-tidy on what changed, and on a part of the rest that is another one after each commit.

    .ci/tidy.py BUILD_DIR         the units of BUILD_DIR/compile_commands.json that hold a changed file, and an eighth
    .ci/tidy.py BUILD_DIR --all   all units
    .ci/tidy.py --self-test

Several sources are one unit in a unity build, because parsing the libraries' headers takes most of the time. A unit
holds a changed header if one of its sources includes it directly.
"""
import concurrent.futures
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parent.parent
# The tests would take three times as long as all of these.
FOLDERS = ("engine/", "maps/", "content/", "ui/", "app/")
PARTS = 8
INCLUDE = re.compile(r'^\s*#\s*include\s*"([^"]+)"', re.MULTILINE)


def sources_of(unit, root):
    """The sources of a unit, relative to the root: those that a unity file includes, else the file itself."""
    if "/Unity/" not in unit:
        return [os.path.relpath(unit, root)]
    text = pathlib.Path(unit).read_text(encoding="utf-8")
    return [os.path.relpath(name, root) if os.path.isabs(name) else name for name in INCLUDE.findall(text)]


def includes_of(source, root):
    path = pathlib.Path(root) / source
    return set(INCLUDE.findall(path.read_text(encoding="utf-8"))) if path.is_file() else set()


def holds_change(unit, changed, root):
    sources = sources_of(unit, root)
    return any(source in changed or includes_of(source, root) & changed for source in sources)


def is_ours(unit, root):
    """Generated sources and tests are not checked; unity files, which lie in the build folder too, are."""
    return all(source.startswith(FOLDERS) for source in sources_of(unit, root))


def chosen(units, changed, part, root):
    """changed: None if it is not known what changed. Then, and when the checks changed, all units are chosen."""
    if changed is None or ".clang-tidy" in changed:
        return list(units)
    return [unit for i, unit in enumerate(units) if i % PARTS == part or holds_change(unit, changed, root)]


def changed_files():
    result = subprocess.run([ROOT / ".ci/changed"], stdout=subprocess.PIPE, text=True, check=False)
    return set(result.stdout.split("\n")) - {""} if result.returncode == 0 else None


def check(unit, build):
    start = time.monotonic()
    result = subprocess.run(["clang-tidy-14", "-p", build, "--quiet", unit], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                            text=True, check=False)
    return unit, result, time.monotonic() - start


def main(arguments):
    if arguments == ["--self-test"]:
        self_test()
        return 0
    if not arguments or arguments[1:] not in ([], ["--all"]):
        print(__doc__)
        return 2
    build = arguments[0]
    commands = json.loads((pathlib.Path(build) / "compile_commands.json").read_text(encoding="utf-8"))
    units = sorted({command["file"] for command in commands if is_ours(command["file"], ROOT)})
    changed = None if arguments[1:] else changed_files()
    commits = subprocess.run(["git", "rev-list", "--count", "HEAD"], stdout=subprocess.PIPE, text=True, check=False, cwd=ROOT)
    part = int(commits.stdout or 0) % PARTS
    wanted = chosen(units, changed, part, ROOT)
    print(f"tidy: {len(wanted)} of {len(units)} units", flush=True)
    bad = 0
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for unit, result, seconds in pool.map(lambda unit: check(unit, build), wanted):
            ok = result.returncode == 0
            print(f"{'ok ' if ok else 'BAD'} {seconds:5.1f} s  {', '.join(sources_of(unit, ROOT))}", flush=True)
            if not ok:
                bad += 1
                print(result.stdout or result.stderr, flush=True)
    return 1 if bad or not wanted else 0


def self_test():
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        (root / "app").mkdir()
        (root / "build/Unity").mkdir(parents=True)
        (root / "app/one.cpp").write_text('#include "app/one.h"\n', encoding="utf-8")
        (root / "app/two.cpp").write_text("", encoding="utf-8")
        (root / "app/three.cpp").write_text("", encoding="utf-8")
        unity, alone = str(root / "build/Unity/unity_0.cxx"), str(root / "app/three.cpp")
        pathlib.Path(unity).write_text(f'#include "{root}/app/one.cpp"\n#include "{root}/app/two.cpp"\n', encoding="utf-8")
        units = [f"/none/{i}.cpp" for i in range(PARTS)] + [unity, alone]
        assert sources_of(unity, root) == ["app/one.cpp", "app/two.cpp"]
        for changed, expected in (({"app/two.cpp"}, [unity]), ({"app/one.h"}, [unity]), ({"app/three.cpp"}, [alone]), (set(), [])):
            assert [unit for unit in chosen(units, changed, -1, root)] == expected, changed
        assert chosen(units, None, -1, root) == units, "all units if nothing is known"
        assert chosen(units, {".clang-tidy"}, -1, root) == units, "all units if the checks changed"
        rotated = [unit for part in range(PARTS) for unit in chosen(units, set(), part, root)]
        assert sorted(rotated) == sorted(units), "each unit has its turn"
        assert is_ours(unity, root)
        assert not is_ours(str(root / "tests/some_test.cpp"), root)
        assert not is_ours(str(root / "build/generated.cpp"), root)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
