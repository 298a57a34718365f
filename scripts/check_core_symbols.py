#!/usr/bin/env python3
"""Checks that libraries for a microcontroller need no heap, exceptions, run-time types, input, output or double maths.

    scripts/check_core_symbols.py LIBRARY...   prints every forbidden undefined symbol; exit code 1 if there is one
    scripts/check_core_symbols.py --self-test  compiles a file that needs them all and checks that each is found

NM names the program that lists symbols (nm).
"""
import os
import re
import subprocess
import sys
import tempfile
from pathlib import Path

FORBIDDEN = [
    (r"operator (new|delete)", "heap"), (r"\b(malloc|calloc|realloc|free|posix_memalign|aligned_alloc)\b", "heap"),
    (r"__cxa_(throw|begin_catch|end_catch|rethrow|allocate_exception)|std::__throw_", "exceptions"),
    (r"\btypeinfo for|__dynamic_cast|__cxxabiv1", "run-time types"),
    (r"\b(printf|fprintf|puts|fopen|fwrite|fread|abort|exit)\b|std::(cout|cerr|basic_ostream)", "input and output"),
    (r"\b(clock_gettime|gettimeofday|time)\b|std::chrono", "clock"),
    (r"(?<![\w:])(sin|cos|tan|atan2?|asin|acos|exp|log|pow|hypot)f?\b(?!\()", "the C library's functions, "
     "which round differently on each system"),
]


def undefined_symbols(library):
    listing = subprocess.run([os.environ.get("NM", "nm"), "-C", "--undefined-only", library], check=True,
                             capture_output=True, text=True).stdout
    return sorted({match[1] for match in re.finditer(r"^\s+U (.+)$", listing, re.M)})


def problems_of(library):
    return [f"{Path(library).name}: {symbol}: {why}" for symbol in undefined_symbols(library)
            for pattern, why in FORBIDDEN if re.search(pattern, symbol)]


def self_test():
    source = """#include <cmath>
    #include <cstdio>
    #include <ctime>
    struct A { virtual ~A() {} };
    struct B : A {};
    bool is_b(A* a) { return dynamic_cast<B*>(a) != nullptr; }
    int* heap() { return new int(1); }
    void thrown() { throw 1; }
    void printed() { std::printf("%d", 1); }
    float rounded(float x) { return std::sin(x); }
    long now() { return std::time(nullptr); }
    """
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, "bad.cpp")
        file.write_text(source, encoding="utf-8")
        subprocess.run([os.environ.get("CXX", "c++"), "-std=c++20", "-O0", "-c", file, "-o", file.with_suffix(".o")], check=True)
        found = "\n".join(problems_of(str(file.with_suffix(".o"))))
    missing = [why for _, why in FORBIDDEN if why not in found]
    for why in missing:
        print(f"not found: {why}")
    print(f"core symbols self-test: {len(FORBIDDEN)} kinds, {len(missing)} not found")
    return 1 if missing else 0


def main():
    if "--self-test" in sys.argv:
        return self_test()
    problems = [problem for library in sys.argv[1:] for problem in problems_of(library)]
    for problem in problems:
        print(problem)
    print(f"core symbols: {len(sys.argv) - 1} libraries, {len(problems)} problems")
    return 1 if problems or len(sys.argv) < 2 else 0


if __name__ == "__main__":
    sys.exit(main())
