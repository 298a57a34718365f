#!/usr/bin/env python3
"""Checks that every C++ file reaches the standard, Eigen and fmt headers of what it uses through its own includes.

    scripts/check_includes.py [--self-test]

Precompiled headers give every file the same library headers, so no compiler sees that one is missing. Whether the
project's own headers are there is compiled: the asan-ubsan preset compiles every file alone.
"""
import re
import sys
import tempfile
from functools import lru_cache
from pathlib import Path

from cpp_definitions import NOISE

ROOT = Path(__file__).resolve().parent.parent
FOLDERS = ["src", "apps", "examples"]
INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', re.M)

# Names of namespace std -> headers of which one must be reached.
ALGORITHM = "sort stable_sort nth_element partial_sort clamp min_element max_element minmax_element lower_bound " \
    "upper_bound equal_range binary_search find_if find_if_not any_of all_of none_of count_if copy_if copy_n fill_n " \
    "transform remove_if partition stable_partition rotate unique reverse is_sorted set_difference set_union " \
    "set_intersection inplace_merge push_heap pop_heap make_heap generate replace_if adjacent_find"
CMATH = "sqrt sin cos tan asin acos atan atan2 hypot floor ceil round lround llround isfinite isnan isinf fmod pow exp log " \
    "log2 log10 cbrt remainder rint nearbyint lrint fma copysign"
NEEDS = {
    "<algorithm>": ALGORITHM, "<cmath>": CMATH, "<vector>": "vector", "<array>": "array to_array", "<span>": "span as_bytes",
    "<map>": "map multimap", "<set>": "set multiset", "<unordered_map>": "unordered_map", "<deque>": "deque",
    "<unordered_set>": "unordered_set", "<list>": "list", "<queue>": "queue priority_queue", "<variant>": "variant visit "
    "holds_alternative monostate", "<optional>": "optional nullopt", "<functional>": "function greater plus", "<bit>":
    "bit_cast popcount countr_zero countl_zero bit_width has_single_bit bit_ceil", "<numeric>": "accumulate iota "
    "partial_sum inner_product reduce gcd", "<numbers>": "numbers", "<limits>": "numeric_limits", "<tuple>": "tuple tie "
    "make_tuple", "<memory>": "unique_ptr shared_ptr weak_ptr make_unique make_shared", "<mutex>": "mutex scoped_lock "
    "lock_guard unique_lock once_flag call_once", "<thread>": "thread jthread this_thread", "<atomic>": "atomic atomic_ref "
    "memory_order_acquire memory_order_relaxed", "<future>": "future async promise", "<filesystem>": "filesystem",
    "<fstream>": "ifstream ofstream fstream", "<sstream>": "ostringstream istringstream stringstream", "<chrono>": "chrono",
    "<condition_variable>": "condition_variable condition_variable_any", "<stop_token>": "stop_token stop_source",
    "<string>": "to_string stoi stod stoul getline", "<charconv>": "from_chars to_chars", "<complex>": "complex",
    "<random>": "mt19937 mt19937_64 normal_distribution uniform_int_distribution", "<bitset>": "bitset",
    "<cstring>": "memcpy memcmp memset strlen memmove strerror", "<string_view>": "string_view",
    "<cstdio>": "FILE fopen fclose fprintf fputs fflush snprintf", "<cstdlib>": "getenv abort strtod strtol",
    "<typeinfo>": "type_info", "<exception>": "exception exception_ptr terminate", "<utility>": "exchange pair",
}
HEADER_OF = {name: header[1:-1] for header, names in NEEDS.items() for name in names.split()}
# What a header brings along, by the standard or as Eigen and fmt document it.
BRINGS = {"string": ["string_view"], "map": ["utility"], "unordered_map": ["utility"], "tuple": ["utility"],
          "thread": ["stop_token"], "fstream": ["string"], "sstream": ["string"], "iostream": ["string"],
          "filesystem": ["string", "chrono"], "stdexcept": ["string", "exception"], "future": ["exception"],
          "mutex": ["chrono"], "condition_variable": ["mutex"], "algorithm": ["utility"], "vector": ["utility"],
          "gtest/gtest.h": ["string", "memory", "vector", "utility"],
          "gmock/gmock.h": ["gtest/gtest.h", "functional", "string", "memory", "vector", "utility"]}


@lru_cache(maxsize=None)
def includes_of(path):
    return INCLUDE.findall(path.read_text(encoding="utf-8"))


def reached(root, path):
    """Every header that a file reaches through the project's own."""
    seen, todo = set(), [path]
    while todo:
        for target in includes_of(todo.pop()):
            if target in seen:
                continue
            seen.add(target)
            seen.update(BRINGS.get(target, []))
            for own in (root / "src" / target, path.parent / target):
                if own.is_file():
                    todo.append(own)
    return seen


def missing(root, path):
    """(line, what is used, header that is not reached), each header once."""
    text = NOISE.sub(lambda match: "\n" * match[0].count("\n"), path.read_text(encoding="utf-8"))
    there, found = reached(root, path), {}
    for match in re.finditer(r"\bstd::(\w+)|\b(Eigen|fmt)::", text):
        header = HEADER_OF.get(match[1]) if match[1] else match[2] + "/"
        is_there = header in there if match[1] else any(target.startswith(header) for target in there)
        if header and not is_there:
            found.setdefault(header, (text[:match.start()].count("\n") + 1, match[0]))
    return [(line, name, header) for header, (line, name) in found.items()]


def check(root):
    """(number of files, problems)"""
    count, problems = 0, []
    for folder in FOLDERS:
        for path in sorted((root / folder).rglob("*.[ch]pp")):
            if path.name.endswith("_inl.hpp"):
                continue  # part of the files that include it
            count += 1
            problems += [f"{path.relative_to(root)}:{line}: uses {name} without reaching <{header}>"
                         for line, name, header in missing(root, path)]
    return count, problems


def self_test():
    files = {"src/hm/a.hpp": "#pragma once\n#include <vector>\n", "src/hm/b.cpp":
             '#include "hm/a.hpp"\n#include <cmath>\n// std::map is only spoken of\nstd::vector<int> v;\n'
             "auto a = std::sqrt(2.0);\nstd::optional<int> o;\nEigen::Vector3d e;\n"}
    with tempfile.TemporaryDirectory() as root:
        for name, text in files.items():
            (Path(root) / name).parent.mkdir(parents=True, exist_ok=True)
            (Path(root) / name).write_text(text)
        count, problems = check(Path(root))
    good = count == 2 and problems == ["src/hm/b.cpp:6: uses std::optional without reaching <optional>",
                                       "src/hm/b.cpp:7: uses Eigen:: without reaching <Eigen/>"]
    print("includes self-test:", "good" if good else f"wrong: {count} {problems}")
    return 0 if good else 1


def main():
    if "--self-test" in sys.argv:
        return self_test()
    count, problems = check(ROOT)
    for problem in problems:
        print(problem)
    print(f"includes: {count} files, {len(problems)} problems")
    return 1 if problems or count == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
