#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Writes seed inputs for library_fuzzer: at least one valid input for each binary column (maps/README.md).

    tests/fuzz/make_library_seeds.py seeds && build/fuzz/tests/fuzz/library_fuzzer seeds
"""
import os
import struct
import sys
import zlib


def png(width, height):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    rows = b"".join(b"\0" + bytes((x * y) & 255 for x in range(width)) for y in range(height))
    head = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b"")


def text(words):
    return struct.pack("<I", len(words)) + words


CAMERA = [struct.pack("<BII4d5d", lens, 640, 480, 500, 500, 320, 240, *lens_numbers)
          for lens, lens_numbers in ((0, (-.1, .01, .001, .001, 0)), (1, (.9, 0, 0, 0, 0)), (2, (.1, .01, 0, 0, 0)))]
KEYFRAME = [struct.pack("<IBBIq4d3d2dQ", i, i % 2, i == 0, 0, 10**9 * i, 0, 0, 0, 1, .1 * i, 0, 0, 1, .5, 7)
            for i in range(3)]
POINT = [struct.pack("<I4dIB2f3f", i, .1 * i, 0, 1, i % 2, 0, 0, 5, 5, 0, 0, -1) for i in range(4)]
OBSERVATION = [struct.pack("<II2fB", 0, i, 5, 5, 0) for i in range(4)]
SEEDS = {
    "cameras": b"\0" + b"".join(CAMERA),
    "keyframes": b"\1" + b"".join(KEYFRAME),
    "points": b"\2" + b"".join(POINT),
    "observations": b"\3" + b"".join(OBSERVATION),
    "scene": b"\4" + struct.pack("<Q", 2) + text(b"{}") + text(b"asset-1") + text(b"asset-2"),
    "image": b"\5" + struct.pack("<I", 0) + png(64, 64),
    "envelope": b"\6DPNT" + struct.pack("<IQQ", 1, 7, 0) + bytes(8),
    "thumbnails": b"\7" + struct.pack("<Q", 2) + b"".join(struct.pack("<IHH", i, 4, 4) + bytes(16) for i in (1, 2)),
    "panoramas": b"\x08" + struct.pack("<QIII", 1, 4, 3, 0) + b"".join(struct.pack("<BII", i, i, 3) for i in range(3)),
    "words": b"\x09" + struct.pack("<QQ", 2, 77) + struct.pack("<IIHHH", 1, 1, 2, 5 << 4, 4095 << 4 | 15) +
             struct.pack("<IIH", 4, 1, 0),
    "many-assets": b"\4" + struct.pack("<Q", 9000) + text(b"") + b"".join(text(b"%04x" % i) for i in range(9000)),
    "many-thumbnails": b"\7" + struct.pack("<Q", 3000) +
                       b"".join(struct.pack("<IHH", i, 4, 4) + bytes(16) for i in range(3000)),
    "many-words": b"\x09" + struct.pack("<QQ", 3000, 77) + b"".join(struct.pack("<IIH", i, 0, 0) for i in range(3000)),
}


def main():
    if len(sys.argv) != 2:
        print(__doc__)
        return 2
    os.makedirs(sys.argv[1], exist_ok=True)
    for name, data in SEEDS.items():
        with open(os.path.join(sys.argv[1], name), "wb") as file:
            file.write(data)
    return 0


if __name__ == "__main__":
    sys.exit(main())
