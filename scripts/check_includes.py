#!/usr/bin/env python3
"""Checks that every C++ file reaches what it uses through its own includes: headers of the standard library, Eigen and
fmt, and the project's own types, constants and free functions; and that no file uses what another one keeps to itself.

    scripts/check_includes.py [--self-test]

Precompiled headers give every file the same library headers, and files of a folder are compiled together
(cmake/HmUnity.cmake), so no compiler sees that one is missing.
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


def places_of(root, path, target):
    """Where a header that a file names may lie: in the library, beside the file, in the program."""
    return root / "src" / target, path.parent / target, root / "apps/hm" / target


def reached(root, path):
    """Every header that a file reaches through the project's own."""
    seen, todo = set(), [path]
    while todo:
        for target in includes_of(todo.pop()):
            if target in seen:
                continue
            seen.add(target)
            seen.update(BRINGS.get(target, []))
            for own in places_of(root, path, target):
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


OWN_TYPE = re.compile(r"^(?:template <[^\n]*>\n)?(?:struct|class|enum class|enum) (?:\[\[\w+\]\] )?(\w+)\b[^;{]*\{", re.M)
OWN_CONSTANT = re.compile(r"^inline constexpr [\w:<>, ]+ (k[A-Z]\w*)\b", re.M)
# A free function: declared in a header at the beginning of a line. Names of one word are those of variables too.
OWN_FUNCTION = re.compile(r"^(?=\w|\[\[)(?!using\b|typedef\b)(?:\[\[\w+\]\] )?[\w:<>,&* ]+[ &*>]([a-z]\w*_\w+)\(", re.M)
DECLARED = re.compile(r"^(?:struct|class|enum class) (\w+)(?: : [\w:]+)?;", re.M)
# What a file defines in an anonymous namespace: functions, types, constants.
HIDDEN = re.compile(r"^namespace \{\n(.*?)^\}  // namespace\n", re.M | re.S)
HIDDEN_NAME = re.compile(r"^(?=\S)(?:(?:static |constexpr |inline )*[\w:<>,&* ]+[ &*](\w+)\(|(?:struct|class|enum class) (\w+)\b[^;]*\{|"
                         r"(?:const|constexpr) [\w:<>,&* ]+ (k[A-Z]\w*)\b)", re.M)


@lru_cache(maxsize=None)
def code_of(path):
    """A file without comments and strings."""
    return NOISE.sub(lambda match: "\n" * match[0].count("\n"), path.read_text(encoding="utf-8"))


def own_names(root):
    """Types and constants of namespace hm -> the one header that defines them."""
    homes = {}
    for path in sorted((root / "src").rglob("*.hpp")):
        for pattern in (OWN_TYPE, OWN_CONSTANT):
            for name in pattern.findall(code_of(path)):
                homes.setdefault(name, set()).add(path)
    return {name: next(iter(paths)) for name, paths in homes.items() if len(paths) == 1}


def own_functions(root):
    """Free functions of namespace hm -> the one header that declares them."""
    homes = {}
    for path in sorted((root / "src").rglob("*.hpp")):
        for name in OWN_FUNCTION.findall(code_of(path)):
            homes.setdefault(name, set()).add(path)
    return {name: next(iter(paths)) for name, paths in homes.items() if len(paths) == 1}


def own_files_reached(root, path):
    files = {path}
    for target in reached(root, path):
        for own in places_of(root, path, target):
            if own.is_file():
                files.add(own)
    return files


def missing_own(root, path, homes):
    """(line, name, its header) of the project's types and constants that a source file uses without reaching them."""
    files = own_files_reached(root, path)
    known = {name for file in files for name in DECLARED.findall(code_of(file))}
    found = {}
    for match in re.finditer(r"(?<![\w.:>])(?<!TEST\()(?:hm::)?([A-Z]\w+|k[A-Z]\w*)\b", code_of(path)):
        name = match[1]
        if name in homes and homes[name] not in files and name not in known:
            found.setdefault(name, code_of(path)[:match.start()].count("\n") + 1)
    # A name that stands in a header that is reached, or that the file itself defines in a class, is that one.
    nested = r"\b(?:struct|class|enum class|enum|using|typename|int|size_t|auto|const[\w:<>,* ]+|const char[\w*\[\] ]*)[ *]{0}\b|[{{,]\s*{0}\s*[,}}=]"
    return [(line, name, homes[name]) for name, line in found.items()
            if not re.search(nested.format(name), code_of(path)) and
            not any(re.search(rf"\b{name}\b", code_of(file)) for file in files - {path})]


def missing_functions(root, path, functions):
    """(line, name, its header) of the project's free functions that a source file calls without reaching them."""
    text, files, found = code_of(path), own_files_reached(root, path), []
    for name in set(re.findall(r"(?<![\w.:>&])(?:hm::)?([a-z]\w*_\w+)\(", text)) & functions.keys():
        if functions[name] in files or any(re.search(rf"\b{name}\b", code_of(file)) for file in files - {path}):
            continue
        if not is_defined(name, text):
            call = re.search(rf"(?<![\w.:>&])(?:hm::)?{name}\(", text)
            found.append((text[:call.start()].count("\n") + 1, name, functions[name]))
    return sorted(found)


def is_defined(name, text):
    """Whether a file itself defines something of this name: function, variable, member or type."""
    before = r"^ *(?!return\b|else\b|throw\b|case\b)(?:[\w:<>,\[\]]+[&*]* )+[&*]*"
    return re.search(rf"{before}{name}\(", text, re.M) or \
        re.search(rf"(?:[\w>&*\]] |[\[,{{(] ?|[&*]){name}\b *[={{,;:)\]]|\b(?:struct|class|using|typename) {name}\b", text)


@lru_cache(maxsize=None)
def hidden_names(path):
    blocks = [NOISE.sub("", block) for block in HIDDEN.findall(path.read_text(encoding="utf-8"))]
    return {name for block in blocks for names in HIDDEN_NAME.findall(block) for name in names
            if name and not name.isupper() and name != "static_assert"}


def borrowed(root, path, siblings):
    """(line, name, file) of what another file of the folder has in an anonymous namespace."""
    text, found = code_of(path), []
    words = set(re.findall(r"\w+", text))
    for sibling in siblings:
        for name in hidden_names(sibling) & words:
            if name in hidden_names(path) or any(re.search(rf"\b{name}\b", code_of(file)) for file in own_files_reached(root, path) - {path}):
                continue
            used = re.search(rf"(?<![\w.:>&]){name}\b" + ("" if name[0].isupper() or re.match("k[A-Z]", name) else r"\("), text)
            defined = re.search(rf"(?:[\w>&*\]] |[\[,{{(] ?|[&*]){name}\b *[(={{,;:)\]]|\b(?:struct|class|using|typename) {name}\b", text)
            if used and not defined:
                found.append((text[:used.start()].count("\n") + 1, name, sibling.name))
    return found


def own_problems(root, path, homes, functions):
    where = path.relative_to(root)
    problems = [f"{where}:{line}: uses {name} without reaching {home.relative_to(root / 'src')}"
                for line, name, home in missing_own(root, path, homes) + missing_functions(root, path, functions)]
    if path.suffix == ".cpp":
        siblings = [other for other in sorted(path.parent.glob("*.cpp")) if other != path and not other.stem.endswith("_test")]
        problems += [f"{where}:{line}: uses {name}, which {other} keeps to itself" for line, name, other in borrowed(root, path, siblings)]
    return problems


def check(root):
    """(number of files, problems)"""
    homes, functions = own_names(root), own_functions(root)
    count, problems = 0, []
    for folder in FOLDERS:
        for path in sorted((root / folder).rglob("*.[ch]pp")):
            if path.name.endswith("_inl.hpp"):
                continue  # part of the files that include it
            count += 1
            problems += [f"{path.relative_to(root)}:{line}: uses {name} without reaching <{header}>"
                         for line, name, header in missing(root, path)]
            problems += own_problems(root, path, homes, functions)
    return count, problems


def self_test():
    files = {"src/hm/a.hpp": "#pragma once\n#include <vector>\n", "src/hm/b.cpp":
             '#include "hm/a.hpp"\n#include <cmath>\n// std::map is only spoken of\nstd::vector<int> v;\n'
             "auto a = std::sqrt(2.0);\nstd::optional<int> o;\nEigen::Vector3d e;\n"}
    files |= {"src/hm/room/own.hpp": "#pragma once\nstruct Own {\n  int a;\n};\ninline constexpr int kOwn = 1;\nint own_sum(int a);\nint other_sum(int a);\n",
              "src/hm/room/keeps.cpp": "namespace {\nint hidden(int a) { return a; }\n}  // namespace\nint b = hidden(1);\n",
              "src/hm/room/uses.cpp": "int hides(int own) { return own; }\nint c = hidden(2) + hides(3);\nOwn d;\nint e = kOwn;\n"
              "int other_sum(int a) { return a; }\nint f = 1 + own_sum(2) + other_sum(3);\n"}
    with tempfile.TemporaryDirectory() as root:
        for name, text in files.items():
            (Path(root) / name).parent.mkdir(parents=True, exist_ok=True)
            (Path(root) / name).write_text(text)
        count, problems = check(Path(root))
    good = count == 5 and problems == ["src/hm/b.cpp:6: uses std::optional without reaching <optional>",
                                       "src/hm/b.cpp:7: uses Eigen:: without reaching <Eigen/>",
                                       "src/hm/room/uses.cpp:3: uses Own without reaching hm/room/own.hpp",
                                       "src/hm/room/uses.cpp:4: uses kOwn without reaching hm/room/own.hpp",
                                       "src/hm/room/uses.cpp:6: uses own_sum without reaching hm/room/own.hpp",
                                       "src/hm/room/uses.cpp:2: uses hidden, which keeps.cpp keeps to itself"]
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
