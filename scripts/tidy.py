#!/usr/bin/env python3
"""Runs clang-tidy-16 (the checks of .clang-tidy) over what a change touched, or over the files and folders named.

    scripts/tidy.py                       # sources changed since HEAD, or not known to git yet
    scripts/tidy.py --since REVISION
    scripts/tidy.py src/hm/io apps

Needs the package clang-tidy-16 and a configured build/release (`./hm --version` makes one). A file takes 5 to 10 s,
the whole tree half an hour, so this is no part of the tests. Exit code 1 when anything was found.
"""
import argparse
import os
import re
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FINDING = re.compile(r"^(.+?):(\d+):\d+: (?:warning|error): (.+)$", re.M)


def git_lines(*words):
    result = subprocess.run(["git", "-C", str(ROOT), *words], capture_output=True, text=True, check=True)
    return result.stdout.splitlines()


def changed_sources(since):
    names = git_lines("diff", "--name-only", "--diff-filter=d", since)
    names += git_lines("ls-files", "--others", "--exclude-standard")
    return sorted({ROOT / name for name in names if name.endswith(".cpp")})


def sources_below(paths):
    found = set()
    for path in map(Path, paths):
        found |= set(path.resolve().rglob("*.cpp")) if path.is_dir() else {path.resolve()}
    return sorted(found)


def findings_of(source):
    """Lines "file:line: what [check]"; what clang-tidy says when it cannot read the file at all is one, too."""
    result = subprocess.run(["clang-tidy-16", "--quiet", "-p", str(ROOT / "build/release"), str(source)],
                            capture_output=True, text=True)
    found = [f"{os.path.relpath(match[1], ROOT)}:{match[2]}: {match[3]}" for match in FINDING.finditer(result.stdout)]
    if found or result.returncode == 0:
        return found
    return [f"{os.path.relpath(source, ROOT)}: exit code {result.returncode}: {result.stderr.strip()[-500:]}"]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("paths", nargs="*", help="files or folders (default: what git says is changed)")
    parser.add_argument("--since", default="HEAD", help="a revision to compare with (default: HEAD)")
    arguments = parser.parse_args()
    sources = sources_below(arguments.paths) if arguments.paths else changed_sources(arguments.since)
    found = set()
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for lines in pool.map(findings_of, sources):
            for line in lines:  # a header's finding comes with every file that includes it
                if line not in found:
                    print(line, flush=True)
            found.update(lines)
    print(f"tidy: {len(sources)} files, {len(found)} findings")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
