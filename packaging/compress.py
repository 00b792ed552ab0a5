#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""compress.py INPUT OUTPUT: gzip without name and time, so that the same input gives the same bytes."""
import gzip
import pathlib
import sys

if len(sys.argv) != 3:
    raise SystemExit("Usage: compress.py INPUT OUTPUT")
pathlib.Path(sys.argv[2]).write_bytes(gzip.compress(pathlib.Path(sys.argv[1]).read_bytes(), 9, mtime=0))
