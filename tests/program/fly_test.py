"""hm fly: hover, way points, scripts, live orders; its files, keys, faults, mistakes, a stop, a kill."""
import hashlib
import json
import signal
import socket
import struct
import time
import zlib

import support

FILES = ["recording.bag", "rig.toml", "groundtruth.txt", "core.trace", "trajectory.tum", "map.mvog", "map.ply",
         "map.yaml", "map.pgm", "flight.svg", "parameters.toml", "report.json", "report.html", "pictures/plan.png"]
QUICK = ["--set", "laser.pictures=false"]
RECORD = 128


def whole_records(data):
    """Number of whole, undamaged records at the beginning of a core.trace."""
    count = 0
    for at in range(0, len(data) - RECORD + 1, RECORD):
        record = data[at:at + RECORD]
        if record[:4] != b"HMT1" or zlib.crc32(record[:124]) != struct.unpack("<I", record[124:])[0]:
            break
        count += 1
    return count


HEARTBEAT, COMMAND_LONG, COMMAND_ACK, STATUSTEXT = 0, 76, 77, 253
CRC_EXTRA = {HEARTBEAT: 50, COMMAND_LONG: 152, COMMAND_ACK: 143, STATUSTEXT: 83}
PAYLOAD_BYTES = {HEARTBEAT: 9, COMMAND_LONG: 33, COMMAND_ACK: 10, STATUSTEXT: 54}


def mavlink_crc(data):
    crc = 0xFFFF
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0x8408 if crc & 1 else 0)
    return struct.pack("<H", crc)


class GroundStation:
    """The other end of --mavlink: reads and writes frames of MAVLink 2 by itself."""

    def __init__(self, key=None):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", 0))
        self.socket.settimeout(120)
        self.key, self.sequence = key, 0

    def url(self):
        return f"udp:127.0.0.1:{self.socket.getsockname()[1]}"

    def read(self):
        """Number and payload of the next message that is known here; damaged or unsigned ones are an error."""
        while True:
            data, self.vehicle = self.socket.recvfrom(2048)
            length, signed = data[1], data[2] & 1
            message = int.from_bytes(data[7:10], "little")
            assert data[0] == 0xFD and len(data) == 12 + length + 13 * signed, data.hex()
            if message not in CRC_EXTRA:
                continue
            body, crc = data[1:10 + length], data[10 + length:12 + length]
            assert mavlink_crc(body + bytes([CRC_EXTRA[message]])) == crc, data.hex()
            assert bool(signed) == (self.key is not None)
            if signed:
                assert data[-6:] == hashlib.sha256(self.key + data[:-6]).digest()[:6], data.hex()
            return message, data[10:10 + length].ljust(PAYLOAD_BYTES[message], b"\0")

    def read_until(self, wanted):
        """Payloads of the messages before the wanted one, by number, and its own."""
        seen = {}
        while True:
            message, payload = self.read()
            if message == wanted:
                return seen, payload
            seen.setdefault(message, []).append(payload)

    def command(self, number):
        payload = struct.pack("<7fHBBB", *[0] * 7, number, 1, 1, 0).rstrip(b"\0")
        body = bytes([len(payload), 1 if self.key else 0, 0, self.sequence, 255, 190]) + COMMAND_LONG.to_bytes(3, "little")
        body += payload
        frame = b"\xfd" + body + mavlink_crc(body + bytes([CRC_EXTRA[COMMAND_LONG]]))
        if self.key:
            frame += b"\0" + int((time.time() - 1420070400) * 1e5).to_bytes(6, "little")
            frame += hashlib.sha256(self.key + frame).digest()[:6]
        self.sequence += 1
        self.socket.sendto(frame, self.vehicle)


class Fly(support.ProgramTest):
    def write(self, name, text):
        (self.folder / name).write_text(text)
        return name

    def test_hover_end_to_end(self):
        run = self.run_json("fly", "hover", "--duration", 6, "-o", "out")
        self.assertEqual(run["what"], "hover")
        self.assertEqual(run["collisions"], 0)
        self.assertEqual(run["end_state"], "landed")
        self.assertLess(run["hover"]["max_xy_m"], 0.25)
        self.assertLess(run["hover"]["max_z_m"], 0.10)
        self.assertGreater(run["hover"]["rms_m"], 0)
        self.assertAlmostEqual(run["hover"]["duration_s"], 3, delta=0.1)
        self.assertEqual(run["waypoints"], {"reached": 0, "missed": 0})
        self.assertEqual(run["failsafes"], [])
        self.assertGreater(run["realtime_ratio"], 0.2)
        self.assertFalse(run["interrupted"])
        self.assertEqual([order["outcome"] for order in run["orders"]], ["done"] * 3)
        self.check_results("out", FILES, ["commanded", "estimated", "Latencies", "Events", "<animateTransform"])
        trace = (self.folder / "out/core.trace").read_bytes()
        self.assertEqual(whole_records(trace) * RECORD, len(trace))
        self.assertGreater(len(trace) / RECORD, run["flight_s"] * 1000)  # every step, and what it was given
        # The recording is one: the laser's verb reads it, and finds the path again.
        laser = self.run_json("laser", "out", "-o", "again", *QUICK)
        self.assertEqual(laser["scans"]["total"], run["scans"])
        self.assertLess(laser["ate_rmse_m"], 0.05)
        # Nothing is replaced unasked.
        self.run_json("fly", "hover", "-o", "out", expect=2)

    def test_the_same_seed_gives_the_same_flight(self):
        kept = ("hover", "path_length_m", "estimate_error_m", "events", "flight_s")
        runs = [self.run_json("fly", "hover", "--duration", 4, "--seed", seed, "--threads", threads, "-o", name, *QUICK)
                for name, seed, threads in (("a", 5, 1), ("b", 5, 2), ("c", 6, 2))]
        first, second, other = [{key: run[key] for key in kept} for run in runs]
        self.assertEqual(first, second)
        self.assertNotEqual(first, other)
        self.assertEqual((self.folder / "a/core.trace").read_bytes(), (self.folder / "b/core.trace").read_bytes())

    def test_another_autopilot(self):
        wrong = self.run_hm("fly", "hover", "--autopilot", "px5", "-o", "x", expect=2)
        self.assertIn("neither core, qemu nor mavlink:URL", wrong.stderr)
        self.run_hm("fly", "hover", "--autopilot", "mavlink:tcp:1", "-o", "x", expect=2)
        inner = self.run_hm("fly", "hover", "--autopilot", "mavlink:udp:127.0.0.1:9", "--set",
                            "vehicle.inner_loop=second-order", "-o", "x", expect=2)
        self.assertIn("it needs motors", inner.stderr)
        # Nobody answers there: a failure, said by name, after ten seconds.
        silent = self.run_json("fly", "hover", "--autopilot", "mavlink:udp:127.0.0.1:9", "-o", "silent", *QUICK, expect=1)
        self.assertIn("does not answer", json.dumps(silent))

    def test_script_with_a_fault(self):
        self.write("tour.fly", "takeoff 1.2  # up\nfault laser_off at 3.2 for 0.6\ngoto 1.5 0 1.2\nwait 1\n"
                               "velocity 0 0.2 0 0 for 1\nhold\nland\n")
        run = self.run_json("fly", "script", "tour.fly", "-o", "out", *QUICK)
        self.assertEqual(run["collisions"], 0)
        self.assertEqual(run["end_state"], "landed")
        self.assertEqual(run["waypoints"]["reached"], 1)
        self.assertLess(run["waypoints"]["worst_m"], 0.15)
        self.assertIn("no pose", [entry["name"] for entry in run["failsafes"]])
        for entry in run["failsafes"]:
            self.assertGreater(entry["begin_s"], 3.2)
        texts = [event["text"] for event in run["events"]]
        self.assertIn("fault laser_off begins", texts)
        self.assertIn("phase: dead reckoning", texts)

    def test_way_points_and_go(self):
        self.write("tour.txt", "# x y z yaw\n1 0 1.2\n1 0.3 1.2 90\n")
        run = self.run_json("fly", "waypoints", "tour.txt", "-o", "out", *QUICK)
        self.assertEqual(run["waypoints"]["reached"], 2)
        self.assertEqual(run["waypoints"]["missed"], 0)
        run = self.run_json("fly", "go", "-0.5", "0.5", "1", "--world", "room", "-o", "there", *QUICK)
        self.assertEqual(run["waypoints"]["reached"], 1)

    def test_where_nothing_shows_the_position_it_lands(self):
        run = self.run_json("fly", "go", 3, 0, 1, "--world", "corridor", "-o", "out", *QUICK)
        self.assertEqual(run["waypoints"]["missed"], 1)
        self.assertIn("position lost", [entry["name"] for entry in run["failsafes"]])
        self.assertEqual(run["end_state"], "landed")
        self.assertIn("missed", run["warnings"][0])

    def test_a_take_off_without_a_height_goes_to_the_parameters(self):
        self.write("up.fly", "takeoff\nwait 4\nland\n")
        run = self.run_json("fly", "script", "up.fly", "--set", "guidance.takeoff_height_m=0.8", "--fault",
                            "camera_black at 5 for 1", "-o", "out", *QUICK)
        self.assertLess(run["hover"]["max_z_m"], 0.10)
        self.assertIn("camera_black", run["warnings"][0])

    def test_a_collision_is_a_failure(self):
        self.write("wall.fly", "takeoff 1\nvelocity 0 1 0 0 for 4\nland\n")
        run = self.run_json("fly", "script", "wall.fly", "-o", "out", *QUICK, expect=1)
        self.assertGreater(run["collisions"], 0)
        self.assertEqual(run["error"]["code"], "no result")
        self.assertTrue((self.folder / "out/report.html").exists())
        self.assertIn("collision at", (self.folder / "out/report.html").read_text())

    def test_mistakes(self):
        self.write("bad.fly", "takeoff 1\ngot 1 2 3\nwait long\nfault lser_off at 1 for 2\n")
        error = self.run_json("fly", "script", "bad.fly", "-o", "out", expect=2)["error"]
        self.assertEqual(error["where"], "bad.fly:2")
        for words in ("did you mean 'goto'?", "bad.fly:3: 'long' is not a number",
                      "bad.fly:4: unknown fault 'lser_off'; did you mean 'laser_off'?"):
            self.assertIn(words, error["message"])
        self.assertFalse((self.folder / "out").exists())
        self.write("bad.txt", "1 2\n")
        self.assertEqual(self.run_json("fly", "waypoints", "bad.txt", expect=2)["error"]["where"], "bad.txt:1")
        self.run_json("fly", "script", "none.fly", expect=3)
        self.run_json("fly", "hover", "--world", "moon", expect=2)
        self.assertIn("did you mean 'house'?", self.run_json("fly", "hover", "--world", "hous", expect=2)["error"]["message"])
        self.run_json("fly", "hover", "--fault", "gust at x for 1", expect=2)
        unknown = self.run_json("fly", "hover", "--set", "pilot.arival_m=1", expect=2)["error"]
        self.assertIn("pilot.arrival_m", unknown["message"])
        self.assertIn("did you mean 'hover'", self.run_hm("fly", "hovr", expect=2).stderr)

    def start_long(self, *more):
        """A flight of ten minutes; its process when it is in the air."""
        process = self.start("fly", "hover", "--duration", 600, "-o", "out", "--json", *QUICK, *more)
        self.addCleanup(process.kill)
        trace = self.folder / "out/.partial/core.trace"
        while process.poll() is None and not (trace.exists() and trace.stat().st_size > 6000 * RECORD):
            time.sleep(0.02)
        self.assertIsNone(process.poll(), "it ended before it could be stopped")
        return process

    def test_stop_lands(self):
        run, errors = self.interrupt(self.start_long())
        self.assertIn("the vehicle lands", errors)
        self.assertEqual(run["end_state"], "landed")
        self.assertEqual(run["collisions"], 0)
        self.assertLess(run["flight_s"], 300)
        self.check_results("out", ["recording.bag", "core.trace", "trajectory.tum", "flight.svg"], ["stopped"])
        self.assertEqual(json.loads((self.folder / "out/run.json").read_text())["state"], "stopped")

    def test_kill_leaves_readable_records(self):
        process = self.start_long()
        time.sleep(1)
        process.send_signal(signal.SIGKILL)
        process.communicate()
        self.assertFalse((self.folder / "out/report.json").exists())
        trace = (self.folder / "out/.partial/core.trace").read_bytes()
        self.assertEqual(whole_records(trace), len(trace) // RECORD)
        laser = self.run_json("laser", "out/.partial/recording.bag.partial", "-o", "rescued", *QUICK)
        self.assertGreater(laser["scans"]["posed"], 50)
        self.run_json("fly", "hover", "--duration", 4, "-o", "out", *QUICK)  # the folder can be used again
        self.assertFalse((self.folder / "out/.partial").exists())

    def test_live(self):
        process = self.start("fly", "teleop", "-o", "out", "--json", *QUICK, stdin=-1)
        self.addCleanup(process.kill)
        process.stdin.write("takeoff 0.5\nfly away\nwait 500\n")
        process.stdin.flush()
        time.sleep(6)
        process.stdin.write("now hold\n")
        output, errors = process.communicate(timeout=90)  # closes its input: it lands
        self.assertEqual(process.returncode, 0, errors)
        self.assertIn("line 2: unknown word 'fly'", errors)
        orders = {order["order"]: order["outcome"] for order in json.loads(output)["orders"]}
        self.assertEqual(orders, {"takeoff 0.5": "done", "wait 500": "skipped", "hold": "done", "land": "done"})

    def fly_beside(self, station, *more):
        """Heartbeats come, a command is answered with its reason; the flight ends with its input."""
        process = self.start("fly", "teleop", "--world", "room", "--mavlink", station.url(), "-o", "out", "--json",
                             *QUICK, *more, stdin=-1)
        self.addCleanup(process.kill)
        self.addCleanup(station.socket.close)
        for _ in range(3):
            _, heartbeat = station.read_until(HEARTBEAT)
            custom_mode, kind, autopilot, base_mode, status, version = struct.unpack("<I5B", heartbeat)
            self.assertEqual((kind, autopilot, base_mode & 128, status, version), (2, 0, 0, 3, 3))
        station.command(22)  # take-off, with the motors off
        seen, ack = station.read_until(COMMAND_ACK)
        self.assertEqual(struct.unpack("<HB", ack[:3]), (22, 1))  # temporarily rejected
        self.assertIn(b"the motors are off: engage first", b"".join(seen.get(STATUSTEXT, [])))
        output, errors = process.communicate(timeout=120)
        self.assertEqual(process.returncode, 0, errors)
        self.assertIn("command refused: the motors are off: engage first",
                      [event["text"] for event in json.loads(output)["events"]])

    def test_a_ground_station_sees_it_and_may_command(self):
        self.fly_beside(GroundStation())

    def test_with_a_key_mavlink_is_signed(self):
        key = bytes(range(100, 132))
        (self.folder / "key").write_text(key.hex() + "\n")
        self.fly_beside(GroundStation(key), "--mavlink-key", "key")
        (self.folder / "key").write_text(key.hex()[:40])
        for words, code, text in ((["--mavlink", "udp:127.0.0.1:9"], 3, "32 bytes or 64 hexadecimal digits"),
                                  ([], 2, "needs --mavlink or --autopilot mavlink:URL")):
            error = self.run_json("fly", "hover", "--mavlink-key", "key", *words, "-o", "x", expect=code)["error"]
            self.assertIn(text, error["message"])


if __name__ == "__main__":
    support.main()
