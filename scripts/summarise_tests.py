#!/usr/bin/env python3
"""Prints one line 'N passed, N failed, N skipped' from a JUnit file written by ctest."""
import sys
import xml.etree.ElementTree as ElementTree


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
    return ", ".join(f"{number} {word}" for word, number in counts.items())


if __name__ == "__main__":
    print(summarise(sys.argv[1]))
