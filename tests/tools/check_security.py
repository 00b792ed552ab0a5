#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Checks that every threat of SECURITY.md names tests, fuzzers or files that exist: check_security.py SOURCE_FOLDER
With --self-test, checks that a name that does not exist is found.
"""
import pathlib
import re
import sys


def known_names(source):
    tests = set()
    for path in (source / "tests").rglob("*.cpp"):
        for suite, name in re.findall(r"^TEST(?:_F|_P)?\(\s*(\w+),\s*(\w+)\s*\)", path.read_text(encoding="utf-8"), re.MULTILINE):
            tests |= {f"{suite}.{name}", f"{suite}.*"}
    return tests | {path.stem for path in (source / "tests/fuzz").glob("*_fuzzer.cpp")}


def problems(text, names, exists):
    rows = [line for line in text.splitlines() if line.startswith("| ")]
    head = next((i for i, row in enumerate(rows) if row.endswith("| shown by |")), None)
    if head is None or len(rows) < head + 2:
        return ["there is no table of threats"]
    found = []
    for row in rows[head + 1:]:
        shown = re.findall(r"`([^`]+)`", row.split("|")[3])
        if not shown:
            found.append(f"nothing shows this row: {row}")
        found += [f"'{name}' does not exist" for name in shown if name not in names and not exists(name)]
    return found


def self_test():
    head = "| threat | what holds | shown by |\n|---|---|---|\n"
    names = {"Suite.Test"}
    assert problems(head + "| a | b | `Suite.Test` |", names, lambda name: False) == []
    assert problems(head + "| a | b | `Suite.Gone` |", names, lambda name: False)
    assert problems(head + "| a | b | |", names, lambda name: False)
    assert problems("", names, lambda name: False)


def main():
    if sys.argv[1:] == ["--self-test"]:
        return self_test()
    source = pathlib.Path(sys.argv[1])
    found = problems((source / "SECURITY.md").read_text(encoding="utf-8"), known_names(source),
                     lambda name: "/" in name and (source / name).exists())
    return "\n".join(found) or None


if __name__ == "__main__":
    sys.exit(main())
