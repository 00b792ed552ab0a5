#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Makes the ordinary comments of a header readable for Doxygen: doxygen_filter.py HEADER.

A comment on lines of its own describes what follows (///), one behind code describes that code (///<). A declaration of
several names is divided, and each gets the comment, as Doxygen would give it to one of them only. Lines stay where they
are, so that warnings name the right ones. Comments in bodies of functions change too, which Doxygen ignores.
"""
import pathlib
import re
import sys

# Code, then a comment. No header has // inside a string.
BEHIND = re.compile(r"^(?P<code>.*\S.*?)(?P<space>\s+)// ?(?P<text>.*)$")
ALONE = re.compile(r"^(?P<indent>\s*)// ?(?P<text>.*)$")
NAME = r"\w+(?: = [^,;()]+|\{[^{};]*\})?"
SEVERAL = re.compile(rf"^\s*(?P<type>(?:const )?[\w:]+(?:<[^;]*>)?) (?P<names>{NAME}(?:, {NAME})+);$")


def divided(code, comment):
    """`int a = 0, b = 0;` as two declarations with the comment, on one line; empty if the code is no such list."""
    match = SEVERAL.match(code)
    if not match:
        return ""
    return " ".join(f"{match['type']} {name}; /**< {comment} */" for name in re.findall(NAME, match["names"]))


def filtered(text):
    lines = []
    column = None  # of the comment behind the code of the line before
    before = ""  # the comment on the lines above
    for line in text.splitlines():
        alone = ALONE.match(line)
        behind = None if alone else BEHIND.match(line)
        if alone and alone["text"].startswith("SPDX"):
            lines.append("")
        elif alone and column is not None and len(alone["indent"]) == column:
            lines.append(f"{alone['indent']}///< {alone['text']}")
        elif alone:
            before += alone["text"] + " "
            lines.append(f"{alone['indent']}/// {alone['text']}")
            column = None
        elif behind and not behind["text"].startswith("NOLINT") and not behind["code"].startswith("}"):
            column = len(behind["code"]) + len(behind["space"])
            lines.append(divided(behind["code"], behind["text"]) or f"{behind['code']}{behind['space']}///< {behind['text']}")
            before = ""
        else:
            code = re.sub(r"\s+// .*$", "", line)
            lines.append(before and divided(code, before.strip()) or code)
            column, before = None, ""
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.stdout.write(filtered(pathlib.Path(sys.argv[1]).read_text(encoding="utf-8")))
