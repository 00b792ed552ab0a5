#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Fails if a program shares Eigen's templates with a shared library.

    check_symbols.py PROGRAM...

Eigen's allocation depends on the machine flags of the including file, and shared libraries were compiled with others.
A template that a program exports, or takes from a library, is then used by both: memory that one allocates is freed
by the other in another way. nm lists what is exported and imported.
"""
import subprocess
import sys


def shared_templates(program):
    """The dynamic symbols of the program that belong to Eigen, demangled."""
    listing = subprocess.run(["nm", "--dynamic", "--demangle", program], check=True, capture_output=True, text=True)
    lines = listing.stdout.splitlines()
    if not lines:
        sys.exit(f"{program} has no dynamic symbols")
    return [line for line in lines if "Eigen::" in line]


def main(programs):
    if not programs:
        sys.exit(__doc__)
    found = {program: shared_templates(program) for program in programs}
    for program, symbols in found.items():
        for symbol in symbols[:5]:
            print(f"{program} shares with a library: {symbol}")
    return 1 if any(found.values()) else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
