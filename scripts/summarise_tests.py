#!/usr/bin/env python3
"""Prints one line 'N passed, N failed, N skipped' from a JUnit file written by ctest.

    scripts/summarise_tests.py FILE [FOLDER]

FOLDER: where test programs that ctest ran as a whole (under sanitizers) wrote their own JUnit files, if they did: a second
line with the number of their cases, then one for each case that was left out, with its reason.
"""
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path


def in_words(counts):
    return ", ".join(f"{number} {word}" for word, number in counts.items())


def summarise(path):
    counts = {"passed": 0, "failed": 0, "skipped": 0}
    for case in ElementTree.parse(path).getroot().iter("testcase"):
        status = case.get("status", "")
        if status == "run":
            counts["passed"] += 1
        elif status in ("notrun", "disabled"):
            counts["skipped"] += 1
        else:
            counts["failed"] += 1
    return in_words(counts)


def reason_of(skipped):
    """What the test said; GoogleTest writes the place before it."""
    lines = skipped.get("message", "").strip().splitlines() if skipped is not None else []
    return lines[-1] if lines else "no reason given"


def summarise_cases(folder):
    """Lines about the cases in files of GoogleTest; those of another shard are in them too and do not count."""
    counts, left_out = {"passed": 0, "failed": 0, "skipped": 0}, []
    for path in sorted(folder.glob("*.xml")):
        for case in ElementTree.parse(path).getroot().iter("testcase"):
            skipped = case.find("skipped")
            if case.get("result") == "skipped":
                counts["skipped"] += 1
                left_out.append(f"skipped: {case.get('classname')}.{case.get('name')}: {reason_of(skipped)}")
            elif case.get("status") == "run":
                counts["failed" if case.find("failure") is not None else "passed"] += 1
    return ["cases: " + in_words(counts)] + left_out


if __name__ == "__main__":
    print(summarise(sys.argv[1]))
    if len(sys.argv) > 2 and Path(sys.argv[2]).is_dir():
        print("\n".join(summarise_cases(Path(sys.argv[2]))))
