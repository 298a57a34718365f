#!/usr/bin/env python3
"""Checks that no two types or functions of one qualified name stand in different files of the whole tree.

    scripts/check_names.py [--libraries LIST]   the sources; also the symbol tables of the libraries that LIST names
    scripts/check_names.py --self-test          checks that planted doubles are found

LIST is a file with one archive a line, which CMake writes (tests/CMakeLists.txt): a build folder may also hold archives
of rooms that are no more.

Two definitions of one name are undefined behaviour as soon as one program holds both, and neither compiler nor linker
need notice: with inline members the linker keeps either. Rooms share one namespace, so the whole tree is one list.
"""
import argparse
import os
import subprocess
import sys
import tempfile
from collections import defaultdict
from pathlib import Path

from cpp_definitions import definitions

ROOT = Path(__file__).resolve().parent.parent
FOLDERS = ["src", "apps", "tests", "bench", "examples"]
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


def planted(text):
    return text[2:] if text.startswith("::") else f"namespace hm {{ {text}\n}}"


def self_test():
    wrong = []
    for name, first, second, doubled in PLANTED:
        with tempfile.TemporaryDirectory() as root:
            (Path(root) / "src").mkdir()
            (Path(root) / "src/a.hpp").write_text(planted(first))
            (Path(root) / "src/b.hpp").write_text(planted(second))
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
    print(f"names self-test: {len(PLANTED) + 2} cases, {len(wrong)} wrong")
    return 1 if wrong else 0


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--libraries", type=Path, metavar="LIST")
    parser.add_argument("--self-test", action="store_true")
    arguments = parser.parse_args()
    if arguments.self_test:
        return self_test()
    count, problems = doubled_in_sources(ROOT)
    if arguments.libraries:
        symbols, found = doubled_in_libraries(
            [Path(line) for line in arguments.libraries.read_text(encoding="utf-8").splitlines()])
        print(f"names: {symbols} symbols")
        problems += found
    for problem in problems:
        print(problem)
    print(f"names: {count} definitions, {len(problems)} problems")
    return 1 if problems or count == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
