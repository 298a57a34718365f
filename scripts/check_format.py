#!/usr/bin/env python3
"""Checks that the C++ files that git tracks are laid out as .clang-format says.

    scripts/check_format.py [--self-test]

Versions of clang-format differ in what they make of one .clang-format: where version 14 is absent, or git, nothing is
checked; the reason is printed and the exit code is 77 (skipped).
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
VERSION = 14
SKIPPED = 77
BATCH = 40  # files a process: its start costs as much as a file


def formatter():
    """(program, reason why there is none)."""
    reason = f"no clang-format {VERSION} here"
    for name in (f"clang-format-{VERSION}", "clang-format"):
        program = shutil.which(name)
        if not program:
            continue
        text = subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout
        found = re.search(r"version (\d+)\.", text)
        if found and int(found[1]) == VERSION:
            return program, ""
        reason = f"{name} is of another version than {VERSION}: {text.strip()}"
    return None, reason


def tracked_files():
    """(files, reason why they are not known)."""
    if not shutil.which("git"):
        return [], "no git here"
    listing = subprocess.run(["git", "-C", ROOT, "ls-files", "-z", "*.cpp", "*.hpp"], capture_output=True, text=True)
    files = [ROOT / name for name in listing.stdout.split("\0") if name]
    files = [path for path in files if path.is_file()]  # one that was removed stays listed until it is committed
    return files, "" if files else f"git tracks no C++ file here {listing.stderr.strip()}"


def badly_formatted(program, files):
    """clang-format's messages: the first line of each is `file:line:column: error: ...`."""
    def check(batch):
        return subprocess.run([program, "--dry-run", "-Werror", "--ferror-limit=3", *batch], cwd=ROOT,
                              capture_output=True, text=True)
    batches = [files[i:i + BATCH] for i in range(0, len(files), BATCH)]
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return [done.stderr for done in pool.map(check, batches) if done.returncode != 0]


def self_test(program):
    wrong = []
    cases = [("as .clang-format says", "int a = 1;\n", 0), ("spaces", "int  a = 1;\n", 1),
             ("a long line", f"int a = {' + '.join(['1'] * 60)};\n", 1)]
    for name, text, expected in cases:
        with tempfile.TemporaryDirectory() as folder:
            shutil.copy(ROOT / ".clang-format", folder)
            path = Path(folder, "a.cpp")
            path.write_text(text)
            found = badly_formatted(program, [path])
            if len(found) != expected or any("a.cpp:1:" not in message for message in found):
                wrong.append(f"{name}: {found or 'not found'}")
    for line in wrong:
        print("self-test:", line)
    print(f"format self-test: {len(cases)} cases, {len(wrong)} wrong")
    return 1 if wrong else 0


def main():
    program, reason = formatter()
    if program and sys.argv[1:] == ["--self-test"]:
        return self_test(program)
    files, no_files = tracked_files()
    if not program or no_files:
        print("skipped:", reason or no_files)
        return SKIPPED
    problems = badly_formatted(program, files)
    for problem in problems:
        print(problem)
    print(f"format: {len(files)} files, {sum(text.count(': error: ') for text in problems)} problems")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
