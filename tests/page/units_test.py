"""The page's own code: its unit tests in node, its types, its size."""
import json
import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
import page_support as page  # noqa: E402

WEB = page.SOURCE / "web"
MOST_BYTES = 250_000  # compressed; web/build.mjs refuses more


class Units(unittest.TestCase):
    def node(self, *words):
        result = subprocess.run(["node", *words], cwd=WEB, capture_output=True, text=True, timeout=200)
        self.assertEqual(result.returncode, 0, result.stdout[-4000:] + result.stderr[-2000:])
        return result.stdout

    def test_units(self):
        self.assertGreater(int(re.search(r"^# pass (\d+)$", self.node("test.mjs"), re.M)[1]), 50)

    def test_types(self):
        self.node("node_modules/typescript/bin/tsc", "--noEmit")
        self.node("node_modules/@biomejs/biome/bin/biome", "lint", "--error-on-warnings")

    @unittest.skipUnless(os.environ.get("HM_CODEC_FRAMES"), "HM_CODEC_FRAMES names no program that writes frames")
    def test_frames_of_the_server_are_read_as_they_were_written(self):
        with tempfile.TemporaryDirectory() as folder:
            subprocess.run([os.environ["HM_CODEC_FRAMES"], folder], check=True, timeout=60)
            self.assertIn("11 frames", self.node("testing/check_codec.mjs", folder))

    def test_size_and_what_the_program_embeds(self):
        with tempfile.TemporaryDirectory() as out:
            text = self.node("build.mjs", "--out", out)
            self.assertLess(int(re.search(r"(\d+) in all, compressed", text)[1]), MOST_BYTES)
            source = (Path(out) / "page_files.cpp").read_text()
            stamp = (Path(out) / "page_files.cpp").stat().st_mtime_ns
            for path in ("/index.html", "/page.js", "/live_worker.js", "/pilot_worker.js", "/page.css", "/icon.svg", "/licences.txt"):
                self.assertIn(f'{{"{path}", "', source)
            bundle = (Path(out) / "page/page.js").read_text()
            self.node("build.mjs", "--out", out)
            self.assertEqual((Path(out) / "page_files.cpp").stat().st_mtime_ns, stamp, "the same page was written again")
        # three names a page of its documentation in a warning; nothing is fetched from anywhere.
        self.assertEqual(set(re.findall(r"fetch\((?:\"|')https?:[^)]*", bundle)), set())

    def test_the_lock_file_names_no_registry(self):
        text = (WEB / "package-lock.json").read_text()
        self.assertEqual(text.count("://"), 0, "an address in package-lock.json")
        # `npm ci` refuses a lock file that lacks a package of some other system.
        packages = json.loads(text)["packages"]
        needed = {name for package in packages.values() for kind in ("dependencies", "optionalDependencies") for name in package.get(kind, {})}
        self.assertEqual([name for name in sorted(needed) if f"node_modules/{name}" not in packages], [])
        wanted = re.findall(r'"([^"]+)": "([\^~><*][^"]*)"', (WEB / "package.json").read_text().split('"dependencies"')[1])
        self.assertEqual(wanted, [], "versions have to be exact")


if __name__ == "__main__":
    page.main(page.missing_for_node)
