#!/usr/bin/env python3
"""Checks that no two types or functions of one qualified name stand in different files of the whole tree, and that
files that may be compiled together have no equal names in their unnamed namespaces.

    scripts/check_names.py [--libraries LIST]   the sources; also the symbol tables of the libraries that LIST names
    scripts/check_names.py --self-test          checks that planted doubles are found

LIST is a file with one archive a line, which CMake writes (tests/CMakeLists.txt): a build folder may also hold archives
of rooms that are no more.

Two definitions of one name are undefined behaviour as soon as one program holds both, and neither compiler nor linker
need notice: with inline members the linker keeps either. Rooms share one namespace, so the whole tree is one list.

Which files are compiled together depends on the preset (cmake/HmUnity.cmake): under sanitizers any of a library, of
tests those of a folder. Two equal names in their unnamed namespaces (types, functions, constants, variables), or of
static functions, would then be errors in one preset alone.
"""
import argparse
import os
import re
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

from cpp_definitions import definitions, unnamed_definitions

ROOT = Path(__file__).resolve().parent.parent
FOLDERS = ["src", "apps", "tests", "bench", "examples"]
UNITY_FOLDERS = ["src/hm", "apps/hm"]
ALONE = re.compile("foreach_target.h|hm: compiled alone")  # as in cmake/HmUnity.cmake
EVERY_PROGRAM = ("main(", "LLVMFuzzerTestOneInput(", "operatornew", "operatordelete")  # one in each program
ALTERNATIVES = [{"bench/dense/peer_none.cpp", "bench/dense/peer_open3d.cpp"}]  # of which the build takes one


def listed(path, definition):
    """Whether a definition is seen by more than its own file, or must be the only one all the same."""
    if definition.kind == "alias" and (path.suffix == ".cpp" or path.name.endswith("_inl.hpp")):
        return False
    return not definition.name.startswith(EVERY_PROGRAM)


def is_double(found):
    """Whether definitions of one name, by file, contradict each other: only aliases of one type do not."""
    if len(found) < 2 or set(map(str, found)) in ALTERNATIVES:
        return False
    return len({definition.text for definition in found.values()}) > 1 or \
        any(definition.kind != "alias" for definition in found.values())


def doubled_in_sources(root):
    """(number of definitions, problems)."""
    places = defaultdict(dict)  # name -> {file: definition}
    for folder in FOLDERS:
        for path in sorted((root / folder).rglob("*.[ch]pp")):
            for definition in definitions(path.read_text(encoding="utf-8")):
                if listed(path, definition):
                    places[definition.name].setdefault(path.relative_to(root), definition)
    problems = []
    for name, found in sorted(places.items()):
        if is_double(found):
            where = ", ".join(f"{path}:{definition.line}" for path, definition in found.items())
            problems.append(f"{name} is defined in {len(found)} files: {where}")
    return sum(map(len, places.values())), problems


def compiled_together(root, path, libraries):
    """Name of what a source file may be compiled together with (cmake/HmUnity.cmake), or None: it is compiled alone.
    `libraries`: the sub-rooms that are libraries of their own."""
    place = path.relative_to(root)
    if path.suffix != ".cpp" or ALONE.search(path.read_text(encoding="utf-8")):
        return None
    if place.parts[:2] == ("apps", "hm"):
        return "apps/hm"
    if place.parts[:2] != ("src", "hm"):
        return None
    if path.stem.endswith("_test") or path.parent.name == "testing":
        return f"tests of {place.parent}"
    return next((name for name in libraries if str(place).startswith(f"src/hm/{name}/")), place.parts[2])


def sub_room_libraries(root):
    """HM_SUB_ROOM_LIBRARIES of CMakeLists.txt."""
    lists = root / "CMakeLists.txt"
    found = re.search(r"set\(HM_SUB_ROOM_LIBRARIES ([^)]*)\)", lists.read_text(encoding="utf-8")) if lists.is_file() else None
    return found[1].split() if found else []


def doubled_in_unnamed(root):
    """(number of definitions in unnamed namespaces, problems)."""
    libraries = sub_room_libraries(root)
    places = defaultdict(dict)  # (what is compiled together, name) -> {file: definition}
    for folder in UNITY_FOLDERS:
        for path in sorted((root / folder).rglob("*.cpp")):
            if together := compiled_together(root, path, libraries):
                for definition in unnamed_definitions(path.read_text(encoding="utf-8")):
                    places[together, definition.name].setdefault(path.relative_to(root), definition)
    problems = []
    for (together, name), found in sorted(places.items()):
        if is_double(found):
            where = ", ".join(f"{path}:{definition.line}" for path, definition in found.items())
            problems.append(f"{name} is in unnamed namespaces of {len(found)} files of {together}: {where}")
    return sum(map(len, places.values())), problems


def doubled_in_libraries(libraries):
    """(number of symbols, problems): symbols, none of them weak, that two object files of the libraries define."""
    places = defaultdict(set)
    problems = [f"{library} is not built" for library in libraries if not library.is_file()]
    for library in filter(Path.is_file, libraries):
        listing = subprocess.run(["nm", "-A", "-C", "--defined-only", "--extern-only", library], check=True,
                                 capture_output=True, text=True).stdout
        for line in listing.splitlines():
            where, _, symbol = line.partition(" ")
            kind, _, name = symbol.partition(" ")
            if kind in ("T", "D", "B", "R", "S", "G"):
                places[name].add(":".join(Path(part).name for part in where.split(":")[:2]))
    problems += [f"{name} is defined in {', '.join(sorted(found))}" for name, found in sorted(places.items())
                 if len(found) > 1]
    if not places:
        problems.append("no library defines a symbol")
    return len(places), problems


# (what is planted, texts of two files, whether it is a double); inside namespace hm unless they begin with "::"
PLANTED = [
    ("two classes", "class Twin { int a; };", "\nclass Twin { float b; };\n", True),
    ("classes of two nested namespaces", "namespace a { struct Twin {}; }", "namespace b { struct Twin {}; }", False),
    ("a class and a nested one", "struct Twin { int a; };", "struct A { struct Twin {}; };", False),
    ("one namespace written twice", "namespace a { enum class Twin : int { kOne }; }", "::namespace hm::a { enum Twin {}; }",
     True),
    ("anonymous namespaces", "namespace { struct Twin { int a; }; }", "namespace { struct Twin { float b; }; }", False),
    ("a declaration and a definition", "struct Twin;", "struct Twin final : Base {};", False),
    ("a class and an alias", "struct Twin {};", "using Twin = int;", True),
    ("aliases of two types", "using Twin = float;", "using Twin = int;", True),
    ("aliases of one type", "using Twin = int;", "using Twin = int;", False),
    ("functions", "inline int twin(int a) { return a; }", "int twin(int b = 2) { return b + 1; }", True),
    ("overloads", "inline int twin(int a) { return a; }", "int twin(float b) { return 1; }", False),
    ("static functions", "static int twin() { return 1; }", "static int twin() { return 2; }", False),
    ("templates with defaults", "template <class T, class U = int>\nT twin(T a) { return a; }\nstruct A {};", "struct A {};",
     True),
    ("members with initialisers", "A::A(int a) : b{a}, c(a) {}", "B::A(int a) : b{a}, c(a) {}", False),
    ("one member twice", "A::A(int a) : b{a}, c(a) {}", "A::A(int b) : b(b), c{b} {}", True),
    ("specialisations", "template <> struct Twin<int> {};", "template <> struct Twin<float> {};", False),
    ("comments, strings and macros", "// struct Twin {};\nauto a = \"struct Twin {};\";\n#define A struct Twin {}\n",
     "struct Twin {};", False),
    ("after braces", "void f() { if (true) { g({1}); } }\nstruct Twin {};", "int a[] = {1, 2};\nstruct Twin {};", True),
    ("tests of one name", "TEST(A, B) {}", "TEST(A, B) {}", True),
]


# As above, of two source files that are compiled together.
PLANTED_UNNAMED = [
    ("constants", "constexpr double kTwin = 1;", "constexpr double kTwin = 1;", True),
    ("constants of two types", "constexpr double kTwin{1};", "const std::array<int, 2> kTwin(f(), 2);", True),
    ("the second of a declaration", "constexpr int kA = f(1, 2), kTwin = 3;", "const char* const kTwin[] = {\"a, b\"};", True),
    ("variables", "thread_local std::map<int, int> twin;", "std::atomic<bool> twin = false;", True),
    ("functions", "int twin(int a) { return a; }", "double twin(int b) { return b; }", True),
    ("static functions", "static int twin(int a) { return a; }", "}\nstatic int twin(int b) { return b + 1; }\nnamespace {", True),
    ("a constant outside", "}\nconstexpr int kTwin = 1;\nnamespace {", "constexpr int kTwin = 2;", True),
    ("overloads", "int twin(int a) { return a; }", "int twin(float b) { return 1; }", False),
    ("types", "struct Twin { int a; };", "enum class Twin { kOne };", True),
    ("a constant inside a function", "void f() { constexpr int kTwin = 1; }", "constexpr int kTwin = 2;", False),
    ("a constant of a class", "struct A { static constexpr int kTwin = 1; };", "constexpr int kTwin = 2;", False),
    ("members of two classes", "struct A { static int twin; };\nint A::twin = 1;", "struct B { static int twin; };\nint B::twin = 1;",
     False),
    ("template arguments and values", "const std::map<kTwin, int> kA = f<int, kTwin>(kTwin, 1);", "constexpr int kTwin = 2;",
     False),
]
# (two files, whether they may be compiled together)
PLANTED_PLACES = [
    ("src/hm/room/a.cpp", "src/hm/room/sub/b.cpp", True),
    ("src/hm/room/a.cpp", "src/hm/room/apart/b.cpp", False),  # a library of its own
    ("src/hm/room/a.cpp", "src/hm/other/b.cpp", False),
    ("src/hm/room/a.cpp", "src/hm/room/b_test.cpp", False),
    ("src/hm/room/a_test.cpp", "src/hm/room/b_test.cpp", True),
    ("src/hm/room/a_test.cpp", "src/hm/room/sub/b_test.cpp", False),
    ("src/hm/room/a.cpp", "src/hm/room/alone.cpp", False),
    ("apps/hm/a.cpp", "apps/hm/verbs/b.cpp", True),
    ("apps/hm/a.cpp", "src/hm/room/b.cpp", False),
]


def planted(text):
    return text[2:] if text.startswith("::") else f"namespace hm {{ {text}\n}}"


def plant(root, files):
    for name, text in files.items():
        (Path(root) / name).parent.mkdir(parents=True, exist_ok=True)
        (Path(root) / name).write_text(text)


def unnamed_self_test():
    """What is wrong with the check of unnamed namespaces."""
    wrong = []
    for name, first, second, doubled in PLANTED_UNNAMED:
        with tempfile.TemporaryDirectory() as root:
            plant(root, {f"src/hm/room/{file}.cpp": planted(f"namespace {{ {text}\n}}") for file, text in (("a", first), ("b", second))})
            _, problems = doubled_in_unnamed(Path(root))
            if bool(problems) != doubled:
                wrong.append(f"{name}, unnamed: {problems or 'not found'}")
    for first, second, together in PLANTED_PLACES:
        with tempfile.TemporaryDirectory() as root:
            twin = planted("namespace { constexpr int kTwin = 1; }")
            plant(root, {"CMakeLists.txt": "set(HM_SUB_ROOM_LIBRARIES room/other\n    room/apart)\n", first: twin, second: twin})
            if "alone" in second:
                plant(root, {second: "// hm: compiled alone\n" + twin})
            _, problems = doubled_in_unnamed(Path(root))
            if bool(problems) != together:
                wrong.append(f"{first} and {second}: {problems or 'not found'}")
    return wrong


def self_test():
    wrong = unnamed_self_test()
    for name, first, second, doubled in PLANTED:
        with tempfile.TemporaryDirectory() as root:
            plant(root, {"src/a.hpp": planted(first), "src/b.hpp": planted(second)})
            _, problems = doubled_in_sources(Path(root))
            if bool(problems) != doubled:
                wrong.append(f"{name}: {problems or 'not found'}")
    with tempfile.TemporaryDirectory() as build:
        compiler = os.environ.get("CXX", "c++")
        for name in ("a", "b", "gone"):
            source = Path(build, name + ".cpp")
            # The macro hides the name from a reader of sources, not from the symbol table.
            source.write_text("#define MAKE(x) int x##n() { return 1; }\nMAKE(twi)\n"
                              "inline int shared() { return 1; }\nint (*use_" + name + ")() = shared;\n")
            subprocess.run([compiler, "-c", source, "-o", source.with_suffix(".o")], check=True)
            subprocess.run(["ar", "qc", Path(build, f"libhm_{name}.a"), source.with_suffix(".o")], check=True)
        # The archive of a room that is no more ("gone") is not listed.
        _, problems = doubled_in_libraries([Path(build, f"libhm_{name}.a") for name in ("a", "b")])
        if len(problems) != 1 or "twin() is defined in libhm_a.a:a.o, libhm_b.a:b.o" not in problems[0]:
            wrong.append(f"two symbols: {problems}")
        _, problems = doubled_in_libraries([Path(build, "libhm_a.a"), Path(build, "libhm_c.a")])
        if len(problems) != 1 or not problems[0].endswith("libhm_c.a is not built"):
            wrong.append(f"a missing library: {problems}")
    for line in wrong:
        print("self-test:", line)
    print(f"names self-test: {len(PLANTED) + len(PLANTED_UNNAMED) + len(PLANTED_PLACES) + 2} cases, {len(wrong)} wrong")
    return 1 if wrong else 0


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--libraries", type=Path, metavar="LIST")
    parser.add_argument("--self-test", action="store_true")
    arguments = parser.parse_args()
    if arguments.self_test:
        return self_test()
    count, problems = doubled_in_sources(ROOT)
    unnamed, found = doubled_in_unnamed(ROOT)
    problems += found
    if arguments.libraries:
        symbols, found = doubled_in_libraries(
            [Path(line) for line in arguments.libraries.read_text(encoding="utf-8").splitlines()])
        print(f"names: {symbols} symbols")
        problems += found
    for problem in problems:
        print(problem)
    print(f"names: {count} definitions, {unnamed} in unnamed namespaces, {len(problems)} problems")
    return 1 if problems or 0 in (count, unnamed) else 0


if __name__ == "__main__":
    sys.exit(main())
