"""Plants one violation of each rule in a small tree and checks that it is found, and nothing else."""
import tempfile
from pathlib import Path

CLEAN = {
    "src/hm/core/result.hpp": "#pragma once\n#include <vector>\n#include <fmt/format.h>\n",
    "src/hm/core/result.cpp": '#include "hm/core/result.hpp"\n#include <toml++/toml.h>\n',
    "src/hm/core/result_test.cpp": '#include "hm/core/result.hpp"\n#include <gtest/gtest.h>\n',
    "src/hm/core/README.md": "# core\n",
    "src/hm/tsdf/grid.hpp": '#pragma once\n#include <Eigen/Core>\n#include "hm/core/result.hpp"\n',
    "src/hm/tsdf/README.md": "# tsdf\n",
    "src/hm/geometry/small.hpp": "#pragma once\n#include <cstdint>\ninline double f();\n",
    "src/hm/geometry/README.md": "# geometry\n",
    "src/hm/control/law.hpp": '#pragma once\n#include <Eigen/Core>\n#include "hm/geometry/small.hpp"\n',
    "src/hm/control/README.md": "# control\n",
    "src/hm/tsdf/part/leaf.hpp": '#pragma once\n#include "hm/tsdf/grid.hpp"\n',
    "apps/hm/main.cpp": '#include <CLI/CLI.hpp>\n#include "hm/tsdf/grid.hpp"\n',
    "src/hm/public_headers.txt": "# core\nhm/core/result.hpp\n",
    "CMakeLists.txt": "hm_room(core LINK fmt::fmt)\nhm_room(tsdf USES core)\n",
}

# (what is planted, path, text, words of the message)
PLANTED = [
    ("arrow", "src/hm/core/bad.cpp", '#include "hm/tsdf/grid.hpp"\n', "core may not include tsdf"),
    ("unknown room", "src/hm/magic/bad.cpp", '#include "hm/core/result.hpp"\n', "not a room"),
    ("missing header", "src/hm/tsdf/bad.cpp", '#include "hm/core/nothing.hpp"\n', "does not exist"),
    ("relative include", "src/hm/tsdf/bad.cpp", '#include "grid.hpp"\n', "includes start with hm/"),
    ("fence", "src/hm/tsdf/bad.cpp", "#include <nlohmann/json.hpp>\n", "is fenced"),
    ("fence of the program", "src/hm/tsdf/bad.cpp", "#include <CLI/CLI.hpp>\n", "is fenced"),
    ("unknown library", "src/hm/tsdf/bad.cpp", "#include <pcl/point_cloud.h>\n", "does not know"),
    ("library in a header", "src/hm/core/bad.hpp", "#pragma once\n#include <toml++/toml.h>\n", "in a header"),
    ("test library", "src/hm/tsdf/bad.cpp", "#include <gtest/gtest.h>\n", "outside of a test"),
    ("bench library", "src/hm/tsdf/bad.cpp", "#include <benchmark/benchmark.h>\n", "outside of a benchmark"),
    ("printing", "src/hm/tsdf/bad.cpp", "void f() { std::cout << 1; }\n", "never prints"),
    ("iostream", "src/hm/tsdf/bad.cpp", "#include <iostream>\n", "never prints"),
    ("unseeded random", "src/hm/tsdf/bad.cpp", "std::random_device d;\n", "seeded Rng"),
    ("pragma", "src/hm/tsdf/bad.hpp", "int f();\n", "#pragma once"),
    ("todo", "src/hm/tsdf/bad.cpp", "// TODO mend\n", "issue number"),
    ("long file", "src/hm/tsdf/bad.cpp", "\n" * 501, "more than 500"),
    ("circle of sub-rooms", "src/hm/tsdf/grid.hpp", '#pragma once\n#include "hm/tsdf/part/leaf.hpp"\n', "in a circle"),
    ("long readme", "src/hm/tsdf/README.md", "\n" * 41, "more than 40"),
    ("file name", "src/hm/tsdf/BadName.cpp", "\n", "snake_case"),
    ("test name", "src/hm/tsdf/test_grid.cpp", "\n", "thing_test.cpp"),
    ("test without subject", "src/hm/tsdf/other_test.cpp", "\n", "no file of this room"),
    ("public header that is not there", "src/hm/public_headers.txt", "hm/core/nothing.hpp\n", "does not exist"),
    ("public header twice", "src/hm/public_headers.txt", "hm/core/result.hpp\n" * 2, "listed twice"),
    ("public header of an implementation", "src/hm/public_headers.txt", "hm/core/result_impl.hpp\n", "not installed"),
    ("private include of a public header", "src/hm/public_headers.txt", "hm/tsdf/grid.hpp\n", "is not public"),
    ("library of a microcontroller", "src/hm/control/bad.hpp", "#pragma once\n#include <vector>\n", "microcontroller"),
    ("library behind its include", "src/hm/geometry/small.hpp", "#pragma once\n#include <string>\n", "microcontroller"),
    ("heap of a microcontroller", "src/hm/control/bad.cpp", "int* f() { return new int(1); }\n", "'new' is not for"),
    ("double of a microcontroller", "src/hm/control/bad.cpp", "double f();\n", "double precision"),
    ("cmake arrow", "CMakeLists.txt", "hm_room(core USES tsdf)\n", "core may not use tsdf"),
]


def make_tree(root, files):
    for name, text in files.items():
        path = Path(root) / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)


def run(checker_class):
    wrong = []
    with tempfile.TemporaryDirectory() as root:
        make_tree(root, CLEAN)
        if found := checker_class(root).run():
            wrong.append(f"the clean tree: {found}")
    for name, path, text, words in PLANTED:
        with tempfile.TemporaryDirectory() as root:
            make_tree(root, {**CLEAN, path: text})
            found = checker_class(root).run()
            if not any(words in line for line in found):
                wrong.append(f"{name}: expected '{words}', got {found}")
    with tempfile.TemporaryDirectory() as root:
        make_tree(root, CLEAN)
        (Path(root) / "src/hm/tsdf/README.md").unlink()
        if not any("every room has a README" in line for line in checker_class(root).run()):
            wrong.append("a missing README was not found")
    with tempfile.TemporaryDirectory() as root:
        make_tree(root, {**CLEAN, **{f"src/hm/core/unit_{i}.hpp": "#pragma once\n" for i in range(15)}})
        if not any("holds 16 units" in line for line in checker_class(root).run()):
            wrong.append("a folder of 16 units was not found")
    for line in wrong:
        print("self-test:", line)
    print(f"architecture self-test: {len(PLANTED) + 3} cases, {len(wrong)} wrong")
    return 1 if wrong else 0
