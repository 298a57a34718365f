"""The Debian packages: what they hold and need, and that they install and run in a clean Debian where one can be made.

HM_BUILD is the build folder. In the clean Debian, the time from `apt-get install` to the first picture is printed (bar:
60 s on an idle machine). With HM_CLEAN_ROOT=FOLDER a minimal Debian that is there already is used.
"""
import gzip
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.request
from pathlib import Path

BUILD = Path(os.environ["HM_BUILD"])
SOURCES = [path for path in (Path("/etc/apt/sources.list.d/debian.sources"), Path("/etc/apt/sources.list"))
           if path.exists()]

TRIANGLE = ("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n"
            "property list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n")


def run(*words, **options):
    result = subprocess.run([str(word) for word in words], capture_output=True, text=True, **options)
    if result.returncode:
        raise AssertionError(f"{' '.join(map(str, words))}\n{result.stdout[-2000:]}\n{result.stderr[-2000:]}")
    return result.stdout


class DebianPackages(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = Path(tempfile.mkdtemp(prefix="hm_packages_"))
        cls.addClassCleanup(shutil.rmtree, cls.folder, ignore_errors=True)
        if not shutil.which("dpkg-shlibdeps"):
            raise unittest.SkipTest("dpkg-shlibdeps is not installed (apt-get install dpkg-dev)")
        run("cpack", "--config", BUILD / "CPackConfig.cmake", "-B", cls.folder)
        cls.program, = cls.folder.glob("housemartin_*.deb")
        cls.development, = cls.folder.glob("libhousemartin-dev_*.deb")

    def test_the_program_depends_on_what_it_is_linked_to(self):
        depends = run("dpkg-deb", "--field", self.program, "Depends")
        for library in ("libtbb12", "libsqlite3-0", "libpng16-16", "libfmt9", "libembree3-3", "libc6"):
            self.assertIn(library, depends)
        self.assertNotIn("-dev", depends)
        contents = run("dpkg-deb", "--contents", self.program)
        self.assertIn("./usr/bin/hm\n", contents)
        self.assertNotIn("/usr/include", contents)

    def test_the_program_holds_the_built_page(self):
        """As the link that it prints shows; needed where node is there to build the page."""
        if not shutil.which("node") or not (BUILD.parent.parent / "web/node_modules/esbuild").is_dir():
            self.skipTest("no node, or no packages to bundle the page with (npm ci in web/)")
        unpacked = self.folder / "unpacked"
        run("dpkg-deb", "-x", self.program, unpacked)
        (self.folder / "one.ply").write_text(TRIANGLE)
        served = subprocess.Popen([unpacked / "usr/bin/hm", "serve", self.folder / "one.ply", "--listen", "0"], stdout=subprocess.DEVNULL,
                                  stderr=subprocess.PIPE, text=True)
        self.addCleanup(served.communicate)
        self.addCleanup(served.terminate)
        said = served.stderr.readline()
        link = re.match(r"live view: (http://\S+)", said)
        self.assertTrue(link, said)
        with urllib.request.urlopen(link[1], timeout=20) as page:
            self.assertEqual(page.headers["Content-Encoding"], "gzip")
            self.assertIn(b"page.js", gzip.decompress(page.read()))
        for name in ("page.js", "page.css", "live_worker.js", "pilot_worker.js", "licences.txt"):
            with urllib.request.urlopen(link[1] + name, timeout=20) as part:
                self.assertGreater(len(gzip.decompress(part.read())), 100, name)

    def test_development_holds_headers_libraries_and_what_they_need(self):
        depends = run("dpkg-deb", "--field", self.development, "Depends")
        for package in ("libeigen3-dev", "libfmt-dev", "libexpected-dev", "libceres-dev", "libopencv-dev"):
            self.assertIn(package, depends)
        self.assertNotIn("libgtest-dev", depends)
        contents = run("dpkg-deb", "--contents", self.development)
        for path in ("/usr/lib/libhm_core.a", "housemartin/housemartinConfig.cmake", "/usr/include/hm/"):
            self.assertIn(path, contents)
        self.assertNotIn("/usr/bin/hm", contents)

    def test_the_program_runs_where_nothing_else_is(self):
        root = self.clean_root()
        shutil.copy(self.program, root / "tmp")
        shutil.copy("/etc/resolv.conf", root / "etc/resolv.conf")
        environment = {"PATH": "/usr/sbin:/usr/bin:/sbin:/bin", "HOME": "/root", "LC_ALL": "C.UTF-8",
                       "DEBIAN_FRONTEND": "noninteractive"}
        run("mount", "-t", "proc", "proc", root / "proc")
        self.addCleanup(subprocess.run, ["umount", "-l", root / "proc"], check=False)
        begin = time.monotonic()
        install = f"apt-get -qq update && apt-get -qq install -y --no-install-recommends /tmp/{self.program.name}"
        run("chroot", root, "sh", "-c", install, env=environment)
        installed = time.monotonic()
        demo = subprocess.Popen(["chroot", root, "sh", "-c", "mkdir -p /work && cd /work && exec hm demo -o demo"],
                                env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(demo.wait)
        self.addCleanup(demo.kill)
        while not (root / "work/demo/first_room.png").exists():
            self.assertIsNone(demo.poll(), "hm demo ended without a picture")
            self.assertLess(time.monotonic() - begin, 600)
            time.sleep(0.1)
        total = time.monotonic() - begin
        print(f"deb_picture: installed in {installed - begin:.1f} s, first picture after {total:.1f} s", file=sys.stderr)

    def clean_root(self):
        if os.geteuid() != 0:
            self.skipTest("a root folder can be entered by root only")
        if given := os.environ.get("HM_CLEAN_ROOT"):
            return Path(given)
        if not shutil.which("mmdebstrap"):
            self.skipTest("mmdebstrap is not installed (./hm package --test installs it)")
        root = Path(tempfile.mkdtemp(prefix="hm_clean_root_"))
        self.addCleanup(shutil.rmtree, root, ignore_errors=True)
        root.chmod(0o755)
        made = subprocess.run(["mmdebstrap", "--quiet", "--variant=minbase", "bookworm", root, *SOURCES[:1]],
                              capture_output=True, text=True)
        if made.returncode:
            self.skipTest(f"no clean Debian can be made here: {made.stderr.strip()[-300:]}")
        return root


if __name__ == "__main__":
    unittest.main(verbosity=2)
