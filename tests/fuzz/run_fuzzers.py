#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Runs every fuzzer on its stored corpus, then on new inputs for a while. Fails on a finding, and says where it is.

    tests/fuzz/run_fuzzers.py build/fuzz/tests/fuzz [--seconds 300] [--jobs 2]
    tests/fuzz/run_fuzzers.py --self-test

SECONDS is the time of all fuzzers together while JOBS of them run at a time; the stored inputs take a few seconds more.
New inputs that reach new code are kept in BUILD_DIR/corpus/NAME, findings in BUILD_DIR/findings.
"""
import argparse
import concurrent.futures
import pathlib
import shutil
import subprocess
import sys
import tempfile

HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent
# Bytes of the longest input, where it is not libFuzzer's choice; and valid inputs that lie elsewhere in the tree.
LONGEST = {"vocabulary_fuzzer": 168496, "library_fuzzer": 80000}
MORE_INPUTS = {"vocabulary_fuzzer": [ROOT / "engine/recognition/vocabulary.bin"]}
# An input that takes longer, in seconds, or more memory is a finding.
INPUT_SECONDS, MEMORY_MB = 20, 2048


def names(folder=HERE):
    return sorted(path.stem for path in folder.glob("*_fuzzer.cpp"))


def problem_of(name, build, corpus):
    """What keeps a fuzzer from being run; an empty text if nothing does."""
    if not (build / name).is_file():
        return f"{name} was not built"
    if not corpus.is_dir() or not any(corpus.iterdir()):
        return f"{corpus} holds no input"
    return ""


def fuzz(name, build, seconds, corpus):
    """Returns whether all went well, and the output."""
    problem = problem_of(name, build, corpus)
    if problem:
        return False, problem
    findings, work = build / "findings", build / "corpus" / name
    findings.mkdir(exist_ok=True)
    work.mkdir(parents=True, exist_ok=True)
    for path in MORE_INPUTS.get(name, []):
        shutil.copy(path, work)
    common = [str(build / name), f"-timeout={INPUT_SECONDS}", f"-rss_limit_mb={MEMORY_MB}",
              f"-artifact_prefix={findings}/{name}-", "-print_final_stats=1"]
    if name in LONGEST:
        common.append(f"-max_len={LONGEST[name]}")
    output = ""
    # Without -max_total_time and with -runs=0 the stored inputs are run and nothing else.
    for options in (["-runs=0"], [f"-max_total_time={seconds}"]):
        folders = [str(corpus)] if options == ["-runs=0"] else [str(work), str(corpus)]
        result = subprocess.run(common + options + folders, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                                errors="replace", check=False)
        output += result.stdout
        if result.returncode != 0:
            return False, output
    return True, output


def executed(output):
    units = [line.split()[-1] for line in output.splitlines() if line.startswith("stat::number_of_executed_units:")]
    return " + ".join(units)


def main(arguments):
    if arguments == ["--self-test"]:
        self_test()
        return 0
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("--seconds", type=int, default=300)
    parser.add_argument("--jobs", type=int, default=2)
    options = parser.parse_args(arguments)
    fuzzers = names()
    seconds = max(1, options.seconds * options.jobs // len(fuzzers))
    build = options.build.resolve()
    bad = 0
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        results = {name: pool.submit(fuzz, name, build, seconds, HERE / "corpus" / name) for name in fuzzers}
        for name, result in results.items():
            good, output = result.result()
            print(f"{'ok ' if good else 'BAD'} {name}: {executed(output) or 'no'} inputs (stored + new)", flush=True)
            if not good:
                bad += 1
                print("\n".join(output.splitlines()[-60:]), flush=True)
    return 1 if bad else 0


def self_test():
    assert names(), "there is no fuzzer"
    for name in names():
        assert any((HERE / "corpus" / name).iterdir()), f"{name} has no stored input"
    with tempfile.TemporaryDirectory() as folder:
        build, corpus = pathlib.Path(folder), pathlib.Path(folder) / "inputs"
        assert "not built" in problem_of("f", build, corpus)
        program = build / "f"
        program.write_text('#!/bin/sh\necho "stat::number_of_executed_units: 3"\n', encoding="utf-8")
        program.chmod(0o755)
        assert "no input" in problem_of("f", build, corpus)
        corpus.mkdir()
        assert "no input" in problem_of("f", build, corpus)
        (corpus / "a").write_bytes(b"a")
        good, output = fuzz("f", build, 1, corpus)
        assert good and executed(output) == "3 + 3", "a fuzzer without a finding passes"
        # A finding among the stored inputs, and one among new ones.
        for option in ("-runs=0", "-max_total_time=1"):
            program.write_text(f'#!/bin/sh\ncase " $* " in *" {option} "*) echo found; exit 77 ;; esac\n', encoding="utf-8")
            good, output = fuzz("f", build, 1, corpus)
            assert not good and "found" in output, f"a finding with {option} must fail"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
