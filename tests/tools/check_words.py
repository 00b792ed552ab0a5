#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Fails when the tree uses a word that docs/glossary.md replaces by a term.

The forbidden words are the bold ones of the last column of the glossary's tables. Identifiers count too:
RestingMap and resting_map both contain `resting map`.
"""
import pathlib
import re
import sys
import tempfile

SUFFIXES = {".h", ".cpp", ".py", ".cmake", ".md", ".txt"}
FOLDERS = ("app", "content", "engine", "maps", "ui", "tests", "cmake", "docs", "examples")
# Names that cannot change: the glossary itself, and the tables of stored libraries.
EXEMPT_FILES = {"docs/glossary.md", "tests/tools/check_words.py"}
EXEMPT_TEXT = re.compile(r"\bpictures\b(?=[` .|,;\"]| (map_key|WHERE|SET|SELECT|\())")
EXEMPT_PLACES = ("maps/", "tests/maps/", "tests/fuzz/")


def forbidden_words(glossary):
    words = []
    for line in glossary.splitlines():
        if line.startswith("|"):
            words += re.findall(r"\*\*([^*]+)\*\*", line.rstrip().rstrip("|").split("|")[-1])
    return words


def pattern(word):
    lower = "[ _-]?".join(map(re.escape, word.lower().split()))
    camel = "".join(part.capitalize() for part in word.split())
    return re.compile(rf"(?<![A-Za-z]){lower}(?![a-z]*[A-Z])|(?<![A-Za-z]){lower.capitalize()}|{camel}")


def breaches(root):
    root = pathlib.Path(root)
    words = {word: pattern(word) for word in forbidden_words((root / "docs/glossary.md").read_text(encoding="utf-8"))}
    if not words:
        return ["docs/glossary.md names no forbidden word"]
    files = [path for path in root.glob("*") if path.suffix in SUFFIXES]
    for folder in FOLDERS:
        files += [path for path in sorted((root / folder).rglob("*")) if path.suffix in SUFFIXES]
    found = []
    for path in files:
        name = path.relative_to(root).as_posix()
        if name in EXEMPT_FILES:
            continue
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            if name.startswith(EXEMPT_PLACES):
                line = EXEMPT_TEXT.sub("", line)
            for word, expression in words.items():
                if expression.search(line):
                    found.append(f"{name}:{number}: '{word}' is not a term of docs/glossary.md: {line.strip()}")
    return found


def self_test():
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        (root / "docs").mkdir()
        (root / "engine").mkdir()
        (root / "docs/glossary.md").write_text("| term | meaning | not |\n| idle map | A map. | **resting map** |\n")
        for text, expected in (("int idle_map;", 0), ("int resting_map;", 1), ("struct RestingMap;", 1),
                               ("// A resting map waits.", 1), ("int resting;", 0)):
            (root / "engine/a.h").write_text(text + "\n")
            if len(breaches(root)) != expected:
                return f"'{text}' gives {breaches(root)}"
        (root / "CHANGELOG.md").write_text("- A resting map is saved.\n")
        if len(breaches(root)) != 1:
            return "the changelog is not checked"
    return ""


if __name__ == "__main__":
    problem = self_test() if sys.argv[1:] == ["--self-test"] else "\n".join(breaches(sys.argv[1]))
    if problem:
        print(problem)
        sys.exit(1)
