#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Fails if the compiler's vectorizer fused multiplications and additions that the source does not fuse.

Whether it fuses depends on the generated code, so that a debug build or another version would compute different
numbers. Eigen fuses intentionally, but only with vfmadd. The alternating vfmaddsub and vfmsubadd are not in the source;
they come from the vectorizer, which ignores -ffp-contract=off.
Usage: check_rounding.py OBJDUMP PROGRAM
"""
import re
import subprocess
import sys

FUNCTION = re.compile(r"^[0-9a-f]+ <(.*)>:$")
FUSED = re.compile(r"\s(vfmaddsub|vfmsubadd)\w+\s")


def breaches(lines):
    found, function = {}, "?"
    for line in lines:
        match = FUNCTION.match(line.rstrip())
        if match:
            function = match.group(1)
        elif FUSED.search(line):
            found[function] = found.get(function, 0) + 1
    return [f"{name}: {count} fused" for name, count in sorted(found.items())]


def self_test():
    fine = ["0000000000001000 <f(double)>:",
            "    1000:\tvfmadd231pd %ymm2,%ymm1,%ymm0",
            "    1005:\tvaddsubpd %xmm1,%xmm0,%xmm0"]
    assert not breaches(fine), "Eigen's own instructions must be accepted"
    for name in ("vfmaddsub132pd", "vfmsubadd231ps"):
        found = breaches(fine + [f"    100a:\t{name} %xmm2,%xmm1,%xmm0"])
        assert found == ["f(double): 1 fused"], f"{name} must be found"


def disassemble(objdump, program):
    command = [objdump, "-d", "-C", "--no-show-raw-insn", program]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        yield from process.stdout
    if process.returncode != 0:
        sys.exit(f"{objdump} cannot read {program}.")


if __name__ == "__main__":
    if sys.argv[1:] == ["--self-test"]:
        self_test()
        sys.exit(0)
    problems = breaches(disassemble(sys.argv[1], sys.argv[2]))
    print("\n".join(problems))
    sys.exit(1 if problems else 0)
