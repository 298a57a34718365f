"""The script ./hm with pretended dpkg, apt, cmake and ninja: what it installs, when, and what it says."""
import json
import re
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import support

TOOLS = ["bash", "awk", "sed", "sort", "comm", "tr", "wc", "mktemp", "tail", "head", "grep", "dirname", "readlink",
         "rm", "mkdir", "tee", "nproc", "flock", "cat", "env", "touch", "chmod", "true", "ls", "find", "sha256sum", "timeout"]
FAKES = {
    "dpkg-query": 'for word in "$@"; do grep -qx "$word" "$STATE/installed" && echo "installed $word"; done; true',
    "apt-get": 'echo "apt-get $*" >> "$STATE/log"; [ ! -e "$STATE/apt_fails" ] || { echo "no network"; exit 100; }\n'
               'echo "dlstatus:1:50.5:Retrieving"; echo "pmstatus:libone-dev:80.0:Unpacking"\n'
               'case "$*" in *" install "*) for word in "$@"; do echo "$word" >> "$STATE/installed"; done;; esac',
    "sudo": 'echo "sudo $*" >> "$STATE/log"; [ ! -e "$STATE/sudo_refuses" ] || exit 1\n'
            '[ "$1" != -n ] || shift; exec "$@"',
    "id": 'cat "$STATE/uid"',
    "cmake": 'echo "cmake $*" >> "$STATE/log"; [ ! -e "$STATE/cmake_fails" ] || { echo "no compiler"; exit 1; }\n'
             'mkdir -p build/release; touch build/release/build.ninja\n'
             'echo "CMAKE_HOME_DIRECTORY:INTERNAL=$PWD" > build/release/CMakeCache.txt\n'
             'for word in "$@"; do case "$word" in -D*=*) word="${word#-D}"\n'
             'echo "${word%%=*}:STRING=${word#*=}" >> build/release/CMakeCache.txt;; esac; done',
    "ninja": 'case "$*" in *" -t targets "*) printf "a.o: CXX_COMPILER__hm_a\\nlibhm_a.a: CXX_STATIC_LIBRARY_LINKER\\n"; exit;; esac\n'
             'echo "ninja $*" >> "$STATE/log"; echo "[1/2] Building a"\n'
             'if [ -e "$STATE/build_fails" ]; then echo "FAILED: a.o"; echo "a.cpp:1: error: oh"; exit 1; fi\n'
             'echo "[2/2] Linking"; mkdir -p "$2/bin"\n'
             'printf \'#!/bin/bash\\necho "program: $*"\\n\' > "$2/bin/hm"; chmod +x "$2/bin/hm"',
    "ctest": 'echo "ctest $*" >> "$STATE/log"; [ ! -e "$STATE/tests_fail" ]',
    "cpack": 'echo "cpack $*" >> "$STATE/log"; mkdir -p "$4"; touch "$4/housemartin_1_amd64.deb"',
    "python3": "true",
}


class Clone(unittest.TestCase):
    """A clone with the script and a list of packages, and a PATH with the pretended programs only."""

    def setUp(self):
        self.root = Path(tempfile.mkdtemp(prefix="hm_bootstrap_")).resolve()
        self.addCleanup(shutil.rmtree, self.root)
        self.state, self.path, self.clone = (self.root / name for name in ("state", "path", "clone"))
        for folder in (self.state, self.path, self.clone):
            folder.mkdir()
        for tool in TOOLS:
            (self.path / tool).symlink_to(shutil.which(tool))
        for name, body in FAKES.items():
            (self.path / name).write_text(f"#!/bin/bash\n{body}\n")
            (self.path / name).chmod(0o755)
        shutil.copy(support.SOURCE / "hm", self.clone / "hm")
        (self.clone / "packages.txt").write_text(
            "# needs\n[dense]  # most\ng++  # compiler\nlibone-dev # why\n\nlibtwo-dev\n"
            "[all]\nlibbig-dev # slam\n[test]  # tests\nlibcheck-dev\n[node]\nnodejs # page\n[npm]\nnpm # page\n")
        for room in ("core", "pipeline", "slam"):
            (self.clone / "src" / "hm" / room).mkdir(parents=True)
        (self.clone / "src" / "hm" / "public_headers.txt").touch()
        (self.state / "installed").write_text("g++\nlibtwo-dev\n")
        (self.state / "uid").write_text("0\n")

    def hm(self, *words, expect=0, **environment):
        result = subprocess.run([str(self.clone / "hm"), *words], capture_output=True, text=True, cwd=self.root,
                                stdin=subprocess.DEVNULL, timeout=60,
                                env={"PATH": str(self.path), "STATE": str(self.state), "HOME": str(self.root),
                                     **environment})
        self.assertEqual(result.returncode, expect, result.stdout + result.stderr)
        return result

    def log(self):
        path = self.state / "log"
        return path.read_text() if path.exists() else ""


class Bootstrap(Clone):
    def test_help_of_the_tests_runs_nothing(self):
        self.assertIn("--sanitize", self.hm("test", "--help").stdout)
        self.assertEqual(self.log(), "")

    def test_first_call_installs_what_is_missing_builds_and_hands_over(self):
        result = self.hm("info", "a b", "--json")
        self.assertEqual(result.stdout, "program: info a b --json\n")
        self.assertIn("installing 1 missing packages: libone-dev", result.stderr)
        self.assertRegex(self.log(), r"apt-get .*update\n.*install -y --no-install-recommends libone-dev\n")
        self.assertNotIn("libtwo-dev", self.log())
        self.assertIn("cmake --preset release", self.log())

    def test_second_call_neither_installs_nor_configures(self):
        self.hm("info")
        (self.state / "log").unlink()
        result = self.hm("info")
        self.assertNotIn("apt-get", self.log())
        self.assertNotIn("cmake", self.log())
        self.assertEqual(result.stdout, "program: info\n")

    def test_dense_verbs_neither_install_nor_build_the_rest(self):
        for words in (["demo"], ["info", "x"], ["simulate", "house"], ["reconstruct", "x"], ["convert", "a", "b"],
                      ["evaluate", "mesh", "a", "b"], ["params", "show"], ["--help"]):
            self.hm(*words)
        self.assertNotIn("libbig-dev", self.log())
        self.assertNotIn("HM_PARTS=all", self.log())
        self.assertEqual(self.log().count("cmake --preset release -DHM_PARTS=dense -DHM_BUILD_TESTS=OFF"), 1)

    def test_another_verb_says_that_it_builds_the_rest_and_does_so(self):
        self.hm("info")
        for words in (["slam", "x"], ["simulate", "calibration"], ["evaluate", "uncertainty", "-o", "x"]):
            with self.subTest(words[0]):
                result = self.hm(*words)
                self.assertIn("program: " + words[0], result.stdout)
                if words[0] == "slam":
                    self.assertIn("slam needs more than dense reconstruction: building all verbs", result.stderr)
                    self.assertIn("libbig-dev", result.stderr)
                else:
                    self.assertNotIn("needs more", result.stderr)
        self.assertEqual(self.log().count("-DHM_PARTS=all -DHM_BUILD_TESTS=OFF"), 1)
        self.assertNotIn("libcheck-dev", self.log())

    def test_what_was_built_stays(self):
        self.hm("build", "all")
        self.assertIn("-DHM_PARTS=all", self.log())
        (self.state / "log").unlink()
        self.hm("info")
        self.hm("build")
        self.assertNotIn("cmake", self.log())

    def test_build_names_the_program_and_refuses_unknown_parts(self):
        self.assertIn("build/release/bin/hm", self.hm("build").stderr)
        self.assertIn("-DHM_PARTS=dense", self.log())
        self.assertIn("'everything' is no part", self.hm("build", "everything", expect=1).stderr)
        self.assertIn("./hm build all", self.hm("build", "--help").stdout)

    def test_progress_of_packages_and_compilation_is_shown(self):
        errors = self.hm("info").stderr
        self.assertIn("downloading packages, percent: 50 of 100", errors)
        self.assertIn("installing packages, percent: 80 of 100", errors)

    def test_every_package_is_in_a_known_section(self):
        section, seen = None, {}
        for line in (support.SOURCE / "packages.txt").read_text().splitlines():
            words = line.split("#")[0].split()
            if words and words[0].startswith("["):
                section = words[0]
            elif words:
                self.assertIsNotNone(section, line)
                self.assertIn("#", line)
                self.assertTrue(seen.setdefault((section, words[0]), line) is line, "twice: " + line)
        sections = {name for name, _ in seen}
        self.assertLessEqual({"[dense]", "[all]", "[test]", "[bench]"}, sections)
        dense = {package for name, package in seen if name == "[dense]"}
        self.assertFalse(dense & {"libopencv-dev", "libceres-dev", "libgtest-dev", "liboctomap-dev"})

    def test_sanitizers_build_and_run_every_room(self):
        result = self.hm("test", "--sanitize", "-R", "slam")
        self.assertRegex(self.log(), r"ninja -C \S*asan-ubsan -j \d+ hm_core_test hm_pipeline_test hm_slam_test hm_fuzz_corpus_test\n")
        self.assertRegex(self.log(), r"ctest --test-dir \S*asan-ubsan .*-L \^\(core\|pipeline\|slam\|fuzz_corpora\)\$ -R slam")
        self.assertRegex(result.stderr, r"asan-ubsan: built in \d+ s, tested in \d+ s")
        (self.state / "tests_fail").touch()
        self.hm("test", "--tsan", expect=1)
        self.assertRegex(self.log(), r"ninja -C \S*tsan .*hm_threads_test")

    def test_files_are_compiled_alone_but_not_linked(self):
        result = self.hm("test", "--alone")
        self.assertRegex(self.log(), r"cmake --preset alone\n")
        self.assertRegex(self.log(), r"ninja -C \S*alone -j \d+ -k 0 a\.o\n")
        self.assertIn("1 files compile by themselves", result.stderr)
        self.assertNotIn("ctest", self.log())
        self.assertIn("--alone takes no arguments", self.hm("test", "--alone", "-R", "io", expect=1).stderr)

    def test_packages_are_made_of_the_whole_program(self):
        result = self.hm("package")
        self.assertIn("-DHM_PARTS=all", self.log())
        self.assertRegex(self.log(), r"cpack --config \S*release/CPackConfig.cmake")
        self.assertIn("housemartin_1_amd64.deb", result.stdout)
        self.assertIn("no way to make packages", self.hm("package", "--everything", expect=1).stderr)

    def test_without_words_it_helps_and_does_nothing(self):
        self.assertIn("./hm demo", self.hm().stdout)
        self.assertEqual(self.log(), "")

    def test_not_root_uses_sudo_without_asking(self):
        (self.state / "uid").write_text("1000\n")
        self.hm("info")
        self.assertIn("sudo -n env DEBIAN_FRONTEND=noninteractive apt-get", self.log())

    def test_not_root_without_sudo_says_what_to_run(self):
        (self.state / "uid").write_text("1000\n")
        (self.path / "sudo").unlink()
        result = self.hm("info", expect=1)
        self.assertIn("apt-get install --no-install-recommends libone-dev", result.stderr)
        self.assertEqual(self.log(), "")

    def test_refused_sudo_says_what_to_run(self):
        (self.state / "uid").write_text("1000\n")
        (self.state / "sudo_refuses").touch()
        self.assertIn("please run as root", self.hm("info", expect=1).stderr)

    def test_failing_apt_is_shown(self):
        (self.state / "apt_fails").touch()
        result = self.hm("info", expect=1)
        self.assertIn("no network", result.stderr)
        self.assertIn("libone-dev", result.stderr)

    def test_no_install_on_request_and_no_dpkg_elsewhere(self):
        self.assertIn("missing: libone-dev", self.hm("info", expect=1, HM_NO_INSTALL="1").stderr)
        (self.path / "dpkg-query").unlink()
        self.assertIn("packages.txt", self.hm("info").stderr)

    def test_failing_configuration_and_build_are_shown(self):
        (self.state / "cmake_fails").touch()
        self.assertIn("no compiler", self.hm("info", expect=1).stderr)
        (self.state / "cmake_fails").unlink()
        (self.state / "build_fails").touch()
        result = self.hm("info", expect=1)
        self.assertIn("a.cpp:1: error: oh", result.stderr)
        self.assertEqual(result.stdout, "")
        (self.state / "build_fails").unlink()
        self.hm("info")

    def test_moved_sources_are_configured_anew(self):
        self.hm("info")
        moved = self.root / "moved"
        self.clone.rename(moved)
        self.clone = moved
        (self.state / "log").unlink()
        self.assertIn("moved", self.hm("info").stderr)
        self.assertIn("cmake --preset release", self.log())

    def test_called_through_a_link_and_from_elsewhere(self):
        (self.root / "link").symlink_to(self.clone / "hm")
        result = subprocess.run([str(self.root / "link"), "info"], capture_output=True, text=True, cwd="/",
                                env={"PATH": str(self.path), "STATE": str(self.state), "HOME": str(self.root)})
        self.assertEqual(result.stdout, "program: info\n", result.stderr)


class WithNode(Clone):
    """Where node and npm can be given."""
    NODE = 'echo "node $*" >> "$STATE/log"; [ ! -e "$STATE/bundle_fails" ] || exit 1\n' \
           'mkdir -p "$3"; echo "page" > "$3/page_files.cpp"'
    NPM = 'echo "npm $*" >> "$STATE/log"; [ ! -e "$STATE/npm_fails" ] || { echo "no network"; exit 1; }\nmkdir -p node_modules'

    def give(self, *names):
        for name in names:
            path = self.path / name
            path.write_text(f"#!/bin/bash\n{self.NODE if name == 'node' else self.NPM}\n")
            path.chmod(0o755)


class Page(WithNode):
    """The page of the ground station: a part of the program that node bundles, where there is one."""

    def setUp(self):
        super().setUp()
        web = self.clone / "web"
        (web / "src").mkdir(parents=True)
        for name in ("build.mjs", "package-lock.json", "src/main.ts"):
            (web / name).write_text(name)

    def test_is_built_once_for_verbs_that_show_it(self):
        self.give("node", "npm")
        self.hm("info", "x")
        self.assertNotIn("npm", self.log())
        self.assertIn("program: reconstruct x --serve", self.hm("reconstruct", "x", "--serve").stdout)
        self.assertIn("npm ci --omit=dev", self.log())
        self.assertIn("web/build.mjs --out", self.log())
        self.assertEqual(self.log().count("cmake --preset release"), 2)  # the program gets a source more
        self.assertNotIn("nodejs", self.log())
        (self.state / "log").unlink()
        for words in (["serve", "x"], ["scan"], ["demo", "--serve=0.0.0.0:8000"]):
            self.hm(*words)
        self.assertNotIn("npm", self.log())
        self.assertNotIn("build.mjs", self.log())

    def test_is_built_again_where_its_sources_changed(self):
        self.give("node", "npm")
        self.hm("serve", "x")
        (self.state / "log").unlink()
        (self.clone / "web/src/main.ts").write_text("changed")
        self.hm("serve", "x")
        self.assertIn("build.mjs", self.log())
        self.assertNotIn("npm", self.log())
        (self.clone / "web/package-lock.json").write_text("changed")
        self.hm("serve", "x")
        self.assertIn("npm ci", self.log())

    def test_missing_commands_are_installed_from_the_distribution(self):
        (self.path / "apt-get").write_text(
            (self.path / "apt-get").read_text() + f"cp {self.root}/given/* {self.path}/ 2>/dev/null; true\n")
        self.give("node", "npm")
        (self.root / "given").mkdir()
        for name in ("node", "npm"):
            shutil.move(self.path / name, self.root / "given" / name)
        (self.path / "cp").symlink_to(shutil.which("cp"))
        self.assertIn("program: serve x", self.hm("serve", "x").stdout)
        self.assertIn("--no-install-recommends nodejs npm", self.log())
        self.assertIn("build.mjs", self.log())

    def test_npm_is_added_to_the_distributions_node_only(self):
        self.give("node")
        result = self.hm("serve", "x")
        self.assertIn("node is not the distribution's", result.stderr)
        self.assertIn("all else works", result.stderr)
        self.assertIn("program: serve x", result.stdout)
        self.assertNotRegex(self.log(), "install .*npm")
        with (self.state / "installed").open("a") as installed:
            installed.write("nodejs\n")
        self.hm("serve", "x")
        self.assertRegex(self.log(), r"install -y --no-install-recommends npm\n")

    def test_without_network_all_else_works(self):
        self.give("node", "npm")
        (self.state / "npm_fails").touch()
        result = self.hm("serve", "x")
        self.assertIn("no network", result.stderr)
        self.assertIn("all else works", result.stderr)
        self.assertIn("program: serve x", result.stdout)
        (self.state / "npm_fails").unlink()
        (self.state / "bundle_fails").touch()
        self.assertIn("all else works", self.hm("serve", "x").stderr)
        (self.state / "bundle_fails").unlink()
        self.assertNotIn("all else works", self.hm("serve", "x").stderr)

    def test_tests_and_packages_have_it_where_node_is(self):
        self.hm("test")
        self.assertNotIn("nodejs", self.log())
        self.give("node", "npm")
        self.hm("test")
        self.assertRegex(self.log(), r"npm ci --fetch-retries")
        self.assertLess(self.log().rindex("build.mjs"), self.log().rindex("ctest"))
        (self.state / "log").unlink()
        self.hm("package")
        self.assertNotIn("npm ci", self.log())


class TestPeers(WithNode):
    """Other implementations that tests talk to, with locked packages of their own."""

    def setUp(self):
        super().setUp()
        for name in ("link", "station"):
            (self.clone / "tests" / name).mkdir(parents=True)
            (self.clone / "tests" / name / "package-lock.json").write_text(name)

    def test_are_fetched_once_for_the_tests_only(self):
        self.give("node", "npm")
        self.hm("info", "x")
        self.assertNotIn("npm", self.log())
        self.hm("test")
        self.assertEqual(len(re.findall(r"npm ci .*--fetch-retries=1 --fetch-timeout=20000", self.log())), 2)
        self.assertLess(self.log().rindex("npm ci"), self.log().rindex("ctest"))
        (self.state / "log").unlink()
        self.hm("test")
        self.assertNotIn("npm", self.log())
        (self.clone / "tests/link/package-lock.json").write_text("changed")
        self.hm("test")
        self.assertEqual(self.log().count("npm ci"), 1)

    def test_without_node_or_network_the_tests_run_all_the_same(self):
        self.hm("test")
        self.assertNotIn("npm", self.log())
        self.give("node", "npm")
        (self.state / "npm_fails").touch()
        result = self.hm("test")
        self.assertIn("warning: the packages of tests/link could not be fetched", result.stderr)
        self.assertIn("warning: the packages of tests/station could not be fetched", result.stderr)
        self.assertEqual(self.log().count("ctest"), 2)
        self.assertFalse((self.clone / "tests/link/node_modules").exists(), "half a package would not be skipped")
        (self.state / "npm_fails").unlink()
        self.assertNotIn("warning", self.hm("test").stderr)

    def test_lock_files_pin_every_package_and_name_no_host(self):
        for name in ("web", "tests/link", "tests/station"):
            with self.subTest(name):
                lock = json.loads((support.SOURCE / name / "package-lock.json").read_text())
                wanted = json.loads((support.SOURCE / name / "package.json").read_text()).get("dependencies", {})
                self.assertEqual(lock["packages"][""].get("dependencies", {}), wanted)
                for place, package in lock["packages"].items():
                    self.assertNotIn("resolved", package, place)
                    if place:
                        self.assertTrue(package["integrity"].startswith("sha512-"), place)


if __name__ == "__main__":
    unittest.main(argv=[sys.argv[0], "-v"])
