#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Kills `docent author` with SIGKILL at random times and checks the library each time.

    tests/tools/kill_authors.py build/release/docent --kills 200

Each author walks through the simulated museum, makes its own map and saves it many times per second. After the kill,
the library must open and verify, and contain every map in at least the last revision that the author reported as
saved. After every --authors-per-library authors a new library is begun. Prints one line per hundred kills and a
summary, and ends with exit status 1 at the first library that fails.
"""
import argparse
import json
import os
import random
import re
import subprocess
import sys
import tempfile
import threading
import time

SAVED = re.compile(r"saved (.+): revision (\d+)")


def author(docent, library, name, folder, seed):
    script = os.path.join(folder, "script.txt")
    with open(script, "w") as file:
        file.write(f'0.1 map new "{name}"\n2.5 signpost "here" at pixel 320 290\n5.5 map stop\n')
    command = [docent, "author", "--library", library, "--camera", "sim:museum:2", "--headless", "--script", script,
               "--autosave", "0.1", "--until", "6", "--seed", str(seed), "--verbose"]
    return subprocess.Popen(command, stderr=subprocess.PIPE, stdout=subprocess.DEVNULL, text=True)


def listen(process, reported, first_save):
    for line in process.stderr:
        found = SAVED.search(line)
        if found:
            reported[found[1]] = max(reported.get(found[1], 0), int(found[2]))
            first_save.set()


def library_problem(docent, library, reported):
    """A sentence that describes what is wrong with the library, or None."""
    verify = subprocess.run([docent, "maps", "verify", "--library", library], capture_output=True, text=True)
    if verify.returncode != 0:
        if not reported and "does not exist" in verify.stderr:
            return None
        return "verify: " + verify.stdout + verify.stderr
    listed = subprocess.run([docent, "maps", "list", "--library", library, "--json"], capture_output=True, text=True)
    revisions = {m["name"]: m["revision"] for m in json.loads(listed.stdout)["maps"]}
    for name, revision in reported.items():
        if revisions.get(name, -1) < revision:
            return f"{name} was saved in revision {revision}, but the library has revision {revisions.get(name)}"
    return None


def main():
    arguments = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    arguments.add_argument("docent")
    arguments.add_argument("--kills", type=int, default=200)
    arguments.add_argument("--authors-per-library", type=int, default=10)
    arguments.add_argument("--seed", type=int, default=1)
    options = arguments.parse_args()
    rng = random.Random(options.seed)
    kills = saves = ended = 0
    with tempfile.TemporaryDirectory() as folder:
        library, reported, made = None, {}, 0
        while kills < options.kills:
            if made % options.authors_per_library == 0:
                if library:
                    for suffix in ("", "-wal", "-shm"):
                        if os.path.exists(library + suffix):
                            os.remove(library + suffix)
                library, reported = os.path.join(folder, f"library{made}.docent"), {}
            made += 1
            before = sum(reported.values())
            process = author(options.docent, library, f"Map {made}", folder, made)
            first_save = threading.Event()
            listener = threading.Thread(target=listen, args=(process, reported, first_save))
            listener.start()
            # One author in five is killed while it starts, the others between the first save and the end.
            if rng.random() < 0.2:
                time.sleep(rng.uniform(0, 1.0))
            else:
                while process.poll() is None and not first_save.wait(0.05):
                    pass
                time.sleep(rng.uniform(0, 1.5))
            if process.poll() is None:
                process.kill()
                kills += 1
            else:
                ended += 1
            process.wait()
            listener.join()
            saves += sum(reported.values()) > before
            problem = library_problem(options.docent, library, reported)
            if problem:
                print(f"after {kills} kills: {problem}")
                return 1
            if kills and kills % 100 == 0:
                print(f"{kills} kills", flush=True)
    print(f"{kills} kills ({saves} after a reported save; {ended} more authors ended before their kill): every library "
          "opened, verified and contained its last save")
    return 0


if __name__ == "__main__":
    sys.exit(main())
