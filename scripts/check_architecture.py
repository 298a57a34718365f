#!/usr/bin/env python3
"""Checks the arrows between rooms and between sub-rooms, fences, sizes, names and room READMEs of this repository.

    scripts/check_architecture.py [ROOT]      prints every violation; exit code 1 if there is one
    scripts/check_architecture.py --self-test checks that each rule finds a planted violation
"""
import re
import sys
from pathlib import Path

import architecture_rules as rules

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')
SOURCE_ENDINGS = {".cpp", ".hpp", ".py", ".sh", ".cmake", ".js", ".ts"}
SOURCE_FOLDERS = ["src", "firmware", "apps", "tests", "bench", "examples", "scripts", "cmake", "python", "web"]


def is_test(path):
    return "_test" in path.stem or path.name.startswith(("test_", "testing_")) \
        or bool({"tests", "testing"} & set(path.parts))


def is_bench(path):
    return path.name.endswith("_bench.cpp") or path.parts[0] == "bench"


def is_inlined(path):
    """Included by .cpp files only, as vector code that Highway compiles once per instruction set: may use fenced libraries."""
    return path.name.endswith("_inl.hpp")


class Checker:
    def __init__(self, root):
        self.root = Path(root)
        self.violations = []
        self.files_seen = 0
        self.folder_arrows = {}  # (folder, folder included) -> the first place where it stands
        self.units = {}          # folder -> stems of its units

    def report(self, path, line, text):
        self.violations.append(f"{path}:{line}: {text}" if line else f"{path}: {text}")

    def sources(self):
        for folder in SOURCE_FOLDERS:
            for path in sorted((self.root / folder).rglob("*")):
                relative = path.relative_to(self.root)
                if path.is_file() and path.suffix in SOURCE_ENDINGS and "node_modules" not in relative.parts:
                    yield relative

    def run(self):
        for path in self.sources():
            self.files_seen += 1
            lines = (self.root / path).read_text(encoding="utf-8").splitlines()
            self.check_length(path, lines)
            self.check_name(path)
            if path.suffix in (".cpp", ".hpp"):
                self.note_unit(path)
                self.check_text(path, lines)
                for number, line in enumerate(lines, 1):
                    if match := INCLUDE.match(line):
                        self.check_include(path, number, match[1], match[2])
        self.check_rooms()
        self.check_units()
        self.check_sub_room_circles()
        self.check_cmake_arrows()
        self.check_public_headers()
        self.check_freestanding()
        return self.violations

    def check_length(self, path, lines):
        if len(lines) > rules.MAX_LINES and str(path) not in rules.LONG_FILES:
            self.report(path, 0, f"has {len(lines)} lines, more than {rules.MAX_LINES}: "
                        "split it where its concepts part, or give LONG_FILES the reason")

    def check_name(self, path):
        number = r"(\d\d_)?" if path.parts[0] == "examples" else ""  # in reading order
        if not re.fullmatch(number + r"[a-z][a-z0-9_]*(\.in)?\.[a-z]+", path.name) and path.parts[0] != "cmake" \
                and path.name not in ("CMakeLists.txt", "__init__.py"):
            self.report(path, 0, "file names are snake_case")
        if path.name.endswith("_tests.cpp") or (path.suffix == ".cpp" and path.name.startswith("test_")):
            self.report(path, 0, "a test file is named thing_test.cpp")
        if path.parts[:2] == ("src", "hm") and path.name.endswith("_test.cpp"):
            self.check_test_has_subject(path)

    def check_test_has_subject(self, path):
        """thing_test.cpp stands beside thing.hpp/.cpp, or at least shares a word with such a file."""
        stem = path.name[:-len("_test.cpp")]
        folder = self.root / path.parent
        names = {p.stem for p in folder.iterdir() if p.suffix in (".cpp", ".hpp")
                 and not is_test(p.relative_to(self.root))} | {path.parent.name, path.parts[2]}
        words = {word for name in names for word in name.split("_")}
        if not words & set(stem.split("_")):
            self.report(path, 0, f"no file of this room belongs to '{stem}'")

    def check_text(self, path, lines):
        text = "\n".join(lines)
        if path.suffix == ".hpp" and not is_inlined(path) and "#pragma once" not in lines[:5]:
            self.report(path, 1, "a header starts with #pragma once")
        for number, line in enumerate(lines, 1):
            if re.search(r"\b(TODO|FIXME)\b(?!\s*\(#?\d+\))", line):
                self.report(path, number, "a TODO needs an issue number: TODO(12)")
        in_library = path.parts[:2] == ("src", "hm") and not is_test(path) and not is_bench(path)
        if in_library and str(path) != "src/hm/core/check.cpp":
            if match := re.search(r"std::(cout|cerr|clog)|\b(std::)?(printf|puts)\s*\(|fprintf\(std(out|err)", text):
                self.report(path, text[:match.start()].count("\n") + 1, "the library never prints")
            if match := re.search(r"std::random_device|\bs?rand\s*\(\)", text):
                self.report(path, text[:match.start()].count("\n") + 1, "random numbers come from a seeded Rng")

    def check_include(self, path, line, quote, target):
        first = target.split("/")[0]
        if first == "hm":
            self.check_arrow(path, line, target)
        elif quote == '"' and first != "hwy":  # Highway's own headers are quoted
            if path.parts[0] == "src" and not target.startswith("hm/"):
                self.report(path, line, f'"{target}": includes start with hm/')
        else:
            self.check_library(path, line, target, first)

    def check_arrow(self, path, line, target):
        if not (self.root / "src" / target).is_file() and not target.endswith("version.hpp"):
            self.report(path, line, f"{target} does not exist")
        if path.parts[:2] != ("src", "hm"):
            return
        room, wanted = path.parts[2], target.split("/")[1]
        if room not in rules.ARROWS:
            self.report(path, line, f"'{room}' is not a room of the architecture")
        elif wanted not in rules.reachable(room) and not (is_test(path) and wanted in rules.TEST_ARROWS.get(room, [])):
            self.report(path, line, f"{room} may not include {wanted} ({target})")
        if not is_test(path):
            folder, included = str(path.parent), str(Path("src", target).parent)
            if folder != included:
                self.folder_arrows.setdefault((folder, included), (path, line, target))

    def check_library(self, path, line, target, first):
        if re.fullmatch(r"[a-z_0-9]+", target) or re.fullmatch(r"c[a-z]+", target):
            if target == "iostream" and path.parts[:2] == ("src", "hm") and not is_test(path):
                self.report(path, line, "the library never prints (<iostream>)")
            return  # the standard library
        in_library = path.parts[:2] == ("src", "hm")
        if in_library and path.suffix == ".hpp" and first not in rules.PUBLIC_HEADER_LIBRARIES \
                and not is_test(path) and not is_inlined(path):
            self.report(path, line, f"<{target}> in a header: only Eigen, fmt and tl::expected may stand there")
            return
        if first in rules.TEST_ONLY:
            if not is_test(path):
                self.report(path, line, f"<{target}> outside of a test")
        elif first in rules.BENCH_ONLY:
            if not is_bench(path):
                self.report(path, line, f"<{target}> outside of a benchmark")
        elif first in rules.SYSTEM_HEADERS:
            return
        elif first not in rules.FENCES:
            self.report(path, line, f"<{target}> is a library that the architecture does not know")
        elif is_bench(path):
            return  # a benchmark may hold a peer's library against ours
        else:
            allowed = rules.FENCES[first]
            place = path.parts[2] if in_library else path.parts[0]
            if allowed != "*" and place not in allowed:
                self.report(path, line, f"<{target}> is fenced: only in {', '.join(allowed) or 'no room'}")

    def check_rooms(self):
        for room in sorted(p for p in (self.root / "src/hm").iterdir() if p.is_dir()):
            readme = room / "README.md"
            relative = readme.relative_to(self.root)
            if not readme.is_file():
                self.report(relative, 0, "every room has a README.md")
            elif (count := len(readme.read_text(encoding="utf-8").splitlines())) > rules.MAX_README_LINES:
                self.report(relative, 0, f"has {count} lines, more than {rules.MAX_README_LINES}")

    def note_unit(self, path):
        is_library = path.parts[:2] == ("src", "hm") and not is_bench(path)
        if (is_library or path.parts[0] in ("apps", "bench")) and not is_test(path):
            self.units.setdefault(path.parent, set()).add(path.stem)

    def check_units(self):
        for folder, units in sorted(self.units.items()):
            if len(units) > rules.MAX_UNITS:
                self.report(folder, 0, f"holds {len(units)} units, more than {rules.MAX_UNITS}: make sub-rooms")

    def check_sub_room_circles(self):
        """Folders whose files include each other in a circle: each is reported with the includes that close it."""
        arrows = {}
        for folder, included in self.folder_arrows:
            arrows.setdefault(folder, set()).add(included)

        def reaches(start, goal):
            seen, todo = set(), [start]
            while todo:
                folder = todo.pop()
                if folder == goal:
                    return True
                if folder not in seen:
                    seen.add(folder)
                    todo.extend(arrows.get(folder, ()))
            return False

        for (folder, included), (path, line, target) in sorted(self.folder_arrows.items()):
            if reaches(included, folder):
                self.report(path, line, f"{folder} and {included} include each other in a circle ({target})")

    def check_public_headers(self):
        """What is installed: headers that exist, include each other only, and are no part of an implementation."""
        path = self.root / rules.PUBLIC_HEADERS
        if not path.is_file():
            return
        listed = {}
        for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
            if line and not line.startswith("#"):
                if line in listed:
                    self.report(rules.PUBLIC_HEADERS, number, f"{line} is listed twice")
                listed[line] = number
        if len(listed) > rules.MAX_PUBLIC_HEADERS:
            self.report(rules.PUBLIC_HEADERS, 0, f"lists {len(listed)} headers, more than {rules.MAX_PUBLIC_HEADERS}")
        for header, number in listed.items():
            file = self.root / "src" / header
            if re.search(r"(_inl|_impl|_test)\.hpp$|/(testing|detail)/", header):
                self.report(rules.PUBLIC_HEADERS, number, f"{header} is part of an implementation: not installed")
                continue
            if not file.is_file():
                self.report(rules.PUBLIC_HEADERS, number, f"{header} does not exist")
                continue
            for at, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1):
                match = INCLUDE.match(line)
                if match and match[2].startswith("hm/") and match[2] not in listed:
                    self.report(f"src/{header}", at, f"a public header includes {match[2]}, which is not public")

    def check_freestanding(self):
        """What also runs on a microcontroller: its includes, theirs, and the words it may not use."""
        def files_of(names):
            places = [self.root / name for name in names]
            return [path for place in places for path in (sorted(place.rglob("*.[ch]pp")) if place.is_dir() else [place])
                    if path.is_file() and not is_test(path.relative_to(self.root))]

        single_precision = set(files_of(rules.FREESTANDING))
        files = [*single_precision, *files_of(rules.FREESTANDING_TEMPLATES)]
        seen = set()
        while files:
            path = files.pop()
            relative = path.relative_to(self.root)
            if path in seen or not path.is_file():
                continue
            seen.add(path)
            for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), 1):
                if match := INCLUDE.match(line):
                    if match[2].startswith("hm/"):
                        files.append(self.root / "src" / match[2])
                    elif match[2] not in rules.FREESTANDING_HEADERS:
                        self.report(relative, number, f"<{match[2]}> is not for what runs on a microcontroller")
                    continue
                code = line.split("//")[0]
                if match := re.search(rules.FREESTANDING_WORDS, re.sub(r'"[^"]*"', '""', code)):
                    self.report(relative, number, f"'{match[0]}' is not for what runs on a microcontroller")
                if path in single_precision and re.search(rules.FREESTANDING_DOUBLE, code):
                    self.report(relative, number, "double precision is not for what runs on a microcontroller")

    def check_cmake_arrows(self):
        cmake = self.root / "CMakeLists.txt"
        if not cmake.is_file():
            return
        for match in re.finditer(r"^hm_room\((\w+)(?:\s+USES((?:\s+[a-z_]+)+))?", cmake.read_text(), re.M):
            room, uses = match[1], (match[2] or "").split()
            for used in uses:
                if room in rules.ARROWS and used not in rules.reachable(room):
                    self.report("CMakeLists.txt", 0, f"{room} may not use {used}")


def main():
    if "--self-test" in sys.argv:
        import architecture_self_test
        return architecture_self_test.run(Checker)
    root = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parent.parent
    checker = Checker(root)
    violations = checker.run()
    for violation in violations:
        print(violation)
    print(f"architecture: {checker.files_seen} files, {len(violations)} violations")
    return 1 if violations or checker.files_seen == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
