"""What the architecture allows: which room may include which, and where third-party headers may stand."""

# Direct arrows; a room may also include whatever the rooms it points to may include.
ARROWS = {
    "core": [],
    "geometry": ["core"],
    "sensors": ["geometry"],
    "depth_camera": ["sensors"],
    "io": ["depth_camera"],
    "cameras": ["io"],
    "calibration": ["depth_camera"],
    "laser": ["sensors"],
    "estimation": ["sensors"],
    "mvog": ["sensors"],
    "tsdf": ["sensors"],
    "odometry": ["sensors"],
    "sim": ["sensors"],
    "control": ["geometry"],
    "flight": ["estimation", "control"],
    "link": ["geometry"],
    "mesh": ["tsdf"],
    "slam": ["laser", "odometry"],
    "evaluation": ["geometry"],
    "mapping": ["io", "slam", "mesh", "mvog"],
    "report": ["evaluation", "io"],
    "station": ["io"],
}
# pipeline wires all rooms together.
ARROWS["pipeline"] = list(ARROWS)
# What the tests of a room may include besides.
TEST_ARROWS = {"depth_camera": ["io"], "mapping": ["sim"]}

# First part of an include path -> (rooms whose .cpp may include it, why). "*" is every room.
FENCES = {
    "Eigen": "*", "fmt": "*", "tl": "*",
    "tbb": ["core"],
    "toml++": ["core", "io"],
    "nlohmann": ["io"], "sqlite3.h": ["io"], "zstd.h": ["io"], "zstd_errors.h": ["io"], "png.h": ["io"], "libdeflate.h": ["io"], "turbojpeg.h": ["io"],
    "octomap": ["io"], "zlib.h": ["io"], "bzlib.h": ["io"],
    "lz4frame.h": ["io"], "assimp": ["io"],
    "opencv2": ["odometry", "calibration"],
    "ceres": ["calibration", "slam"],
    "nanoflann.hpp": ["odometry"],
    "embree3": ["sim", "evaluation"],
    "boost": ["station"],
    "qrencode.h": ["station"],
    "hwy": ["sensors", "depth_camera", "tsdf", "mesh"],
    "meshoptimizer.h": ["mesh"],
    "OpenNI.h": ["cameras"], "libfreenect.h": ["cameras"],
    "CLI": ["apps"],
    "google": [],
}
# Only in test files (*_test.cpp and what stands under tests/); the last one in *_bench.cpp and bench/.
TEST_ONLY = {"gtest", "gmock", "rapidcheck", "rapidcheck.h", "Driver", "OniProperties.h"}
BENCH_ONLY = {"benchmark", "open3d"}
# What a public header may include besides the standard library and hm/.
PUBLIC_HEADER_LIBRARIES = {"Eigen", "fmt", "tl"}
# Headers of the operating system (POSIX, x86) and the compiler, in .cpp files only.
SYSTEM_HEADERS = {"unistd.h", "fcntl.h", "signal.h", "pthread.h", "sys", "immintrin.h", "dlfcn.h", "malloc.h", "linux",
                  "sanitizer", "termios.h", "poll.h", "netinet", "arpa", "net", "ifaddrs.h"}

# What also runs on a microcontroller: these folders and files include only the headers named here and each other, and
# name nothing of FREESTANDING_WORDS. What they include is checked in the same way, wherever it stands.
FREESTANDING = ["src/hm/geometry/float", "src/hm/control", "src/hm/flight", "src/hm/link/codec"]
# The same for the estimator, whose templates a host instantiates in double precision: these may name it.
FREESTANDING_TEMPLATES = [f"src/hm/estimation/{name}" for unit in
                          ["alpha_beta", "bias_kalman", "decoupled_kalman", "delayed_fusion", "filter_math",
                           "filter_types", "fusion_params", "state_estimator", "tilt_filter"]
                          for name in (unit + ".hpp", unit + ".cpp")]
FREESTANDING_HEADERS = {"Eigen/Core", "Eigen/Geometry", "Eigen/LU", "array", "bit", "cmath", "compare", "cstddef",
                        "cstdint", "limits", "numbers", "optional", "span", "string_view", "type_traits"}
# Heap, exceptions, run-time types, clocks, input and output; and double precision, in the folders of FREESTANDING.
FREESTANDING_WORDS = r"std::(vector|string\b|map|set|deque|function|unique_ptr|shared_ptr|make_|chrono|exception)|" \
                     r"\b(new|(?<!= )delete|malloc|free|throw|try|catch|dynamic_cast|typeid|fopen|printf)\b"
FREESTANDING_DOUBLE = r"\bdouble\b"

# At most so many units (thing.hpp, thing.cpp and their tests are one) in a folder.
MAX_UNITS = 15
MAX_LINES = 500
# Files that may be longer, each with its reason.
LONG_FILES = {}
MAX_README_LINES = 40
# The list of headers that are installed, and how many there may be at most.
PUBLIC_HEADERS = "src/hm/public_headers.txt"
MAX_PUBLIC_HEADERS = 60


def reachable(room):
    """Every room that `room` may include, itself among them."""
    seen, todo = set(), [room]
    while todo:
        name = todo.pop()
        if name not in seen:
            seen.add(name)
            todo.extend(ARROWS.get(name, []))
    return seen
