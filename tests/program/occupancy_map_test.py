"""hm info and hm convert of a multi-volume occupancy grid (.mvog)."""
import re

import support


class OccupancyMap(support.SharedFolderTest):
    @classmethod
    def prepare(cls, keeper):
        keeper.simulate("flight", 200, "room", "--sensor", "laser_mav")
        keeper.run_json("laser", "flight", "-o", "result")
        cls.result = keeper.folder / "result"
        cls.map = cls.result / "map.mvog"

    def test_info(self):
        shown = self.run_json("info", self.map)
        self.assertEqual(shown["path_kind"], "occupancy_map")
        self.assertGreater(shown["volumes_positive"], 10)
        self.assertGreater(shown["volumes_negative"], 10)
        self.assertGreater(shown["columns"], 100)
        self.assertAlmostEqual(shown["area_m2"], shown["columns"] * shown["resolution_m"] ** 2, places=6)
        self.assertEqual(shown["file_bytes"], self.map.stat().st_size)
        self.assertLess(shown["bounds_m"]["min"][0], shown["bounds_m"]["max"][0])
        text = self.run_hm("info", self.map).stdout
        self.assertIn("multi-volume occupancy grid", text)
        self.assertIn(f"{shown['volumes_positive']:,} occupied", text)

    def test_convert_gives_what_the_run_wrote(self):
        self.assertGreater(self.run_json("convert", self.map, "map.bt")["items"], 100)
        self.assertEqual((self.folder / "map.bt").read_bytes(), (self.result / "map.bt").read_bytes())
        sliced = self.run_json("convert", self.map, "map.yaml")
        self.assertEqual(sliced["outputs"], ["map.yaml", "map.pgm"])
        self.assertEqual((self.folder / "map.pgm").read_bytes(), (self.result / "map.pgm").read_bytes())
        (self.folder / "picture").mkdir()
        picture = self.run_json("convert", self.map, "picture/map.pgm")
        self.assertEqual(picture["outputs"], ["picture/map.yaml", "picture/map.pgm"])
        for name in ("map.yaml", "map.pgm"):
            self.assertEqual((self.folder / "picture" / name).read_bytes(), (self.result / name).read_bytes(), name)
        low = self.run_json("convert", self.map, "low.yaml", "--set", "laser.slice_bottom_m=0", "--set",
                            "laser.slice_top_m=0.2")
        self.assertEqual(low["items"], sliced["items"])
        self.assertNotEqual((self.folder / "low.pgm").read_bytes(), (self.folder / "map.pgm").read_bytes())
        self.run_hm("convert", self.map, "map.ot")
        self.assertIn(b"id OcTree", (self.folder / "map.ot").read_bytes()[:200])
        points = self.run_json("convert", self.map, "points.ply")["items"]
        self.assertGreater(points, 100)
        head = (self.folder / "points.ply").read_bytes()[:400].decode("latin-1")
        self.assertEqual(int(re.search(r"element vertex (\d+)", head)[1]), points)

    def test_letter_case_of_extensions(self):
        for to, outputs in (("a.PGM", ["a.yaml", "a.PGM"]), ("b.YAML", ["b.YAML", "b.pgm"]),
                            ("c.yml", ["c.yml", "c.pgm"])):
            self.assertEqual(self.run_json("convert", self.map, to)["outputs"], outputs)
            description, image = (self.folder / name for name in outputs)
            self.assertEqual(image.read_bytes(), (self.result / "map.pgm").read_bytes(), to)
            self.assertIn(f"image: {image.name}\n", description.read_text(), to)
        for to, wanted in (("d.BT", "map.bt"), ("d.Ply", None), ("d.OT", None)):
            self.run_hm("convert", self.map, to)
            if wanted:
                self.assertEqual((self.folder / to).read_bytes(), (self.result / wanted).read_bytes(), to)
        upper = self.folder / "MAP.MVOG"
        upper.write_bytes(self.map.read_bytes())
        self.run_hm("convert", upper, "e.bt")
        self.assertEqual((self.folder / "e.bt").read_bytes(), (self.result / "map.bt").read_bytes())
        self.assertIn(".pgm", self.run_hm("convert", "--help").stdout)

    def test_wrong_input(self):
        self.assertIn("OctoMap", self.run_hm("convert", self.map, "map.obj", expect=2).stderr)
        damaged = self.folder / "damaged.mvog"
        damaged.write_bytes(self.map.read_bytes()[:-7])
        for words in (["info", "damaged.mvog"], ["convert", "damaged.mvog", "a.bt"]):
            self.assertIn("damaged.mvog", self.run_hm(*words, expect=3).stderr)


if __name__ == "__main__":
    support.main()
