#!/usr/bin/env python3
"""Runs every command of the documents, and of the program's own --help, in a folder of its own; checks that links to
files lead somewhere, pictures are small, and names of the code exist.

    scripts/check_docs.py --program build/release/bin/hm [--part texts|help]
    scripts/check_docs.py --names      only the names: those in backticks on a line with a link to a source file, files that READMEs
                                       name, rooms in the table of the architecture, parameters in messages,
                                       comments and documents
    scripts/check_docs.py --self-test

A block that starts with ```sh is run line by line with `hm` and `./hm` meaning the program. A block ```sh manual
is not run (it installs, clones or tests); its first words must be known. The folder holds `my_recording` and
`recording` (a simulated room), `my_flight` and `second_flight` (a laser's flight through it), `tour.txt` and `tour.fly` (way points and a script for a flight), and after `prepare` also `result`, `tracked`, `whole` and `flown`, their results, as the
texts assume; that of --help also `set`, pictures of calibration boards. A folder of results that a line writes anew is removed before.
"""
import argparse
import atexit
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from functools import lru_cache
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FENCE = re.compile(r"^```sh([ \w]*)\n(.*?)^```", re.M | re.S)
MANUAL_WORDS = {"git", "cd", "./hm", "cmake", "ninja", "qemu-system-arm", "sudo", "npm", "apt-get", ".ci/run", "bench/run", "bench/first_picture", "scripts/tidy.py"}
# The same command with fewer frames, coarse and without figures: what is checked is the command; the program's tests look at results
# and figures.
VOXEL = "0.05"
FEW_SAMPLES = ["--set", "mesh_error.samples=10000"]
PLAIN = ["--set", "reconstruction.pictures=false", "--set", f"tsdf.voxel_size_m={VOXEL}"] + FEW_SAMPLES
SHORT = {"demo": ["--set", "simulation.frame_limit=15"] + PLAIN, "reconstruct": PLAIN,
         "slam": PLAIN + ["--set", "slam.matrices=false"], "scan": PLAIN + ["--set", "slam.matrices=false"],
         "laser": ["--set", "laser.pictures=false"], "fly": ["--set", "laser.pictures=false"], "evaluate mesh": FEW_SAMPLES,
         "evaluate depth-compensation": PLAIN}
HELP_VERBS = ["simulate", "info", "reconstruct", "odometry", "slam", "scan", "laser", "calibrate", "calibrate intrinsics",
              "calibrate extrinsics", "calibrate depth", "calibrate noise", "evaluate", "evaluate trajectory", "evaluate mesh",
              "evaluate uncertainty", "evaluate depth-compensation", "convert",
              "fly", "fly hover", "fly waypoints", "fly go", "fly script", "fly teleop",
              "params", "params show", "params check", "params explain", "params diff", "demo"]
LIMIT_S = 240
SMALL_SET = "".join(f" --set calibration_simulation.{assignment}" for assignment in (
    "camera_views=8", "stereo_views=4", "depth_steps=3", "test_steps=2", "depth_images=6"))
LINK = re.compile(r"(!?)\[[^\]]*\]\(([^)#:]+)\)")  # no anchor in the page, no address on the web
PICTURE_LIMIT_BYTES = 300_000
SOURCE_REFERENCE = re.compile(r"\[`[^`]+`\]\(\.\./(src/[^)]+)\): ((?:`\w+`(?:, )?)+)")
PARAMETER = re.compile(r"^\| `(\w+\.\w+)`", re.MULTILINE)  # a row of docs/parameters.md
NAME_WITH_DOT = re.compile(r"(?<![\w./{|:-])([a-z]\w*)\.([a-z]\w*)(?![\w(/*]|\.\w|->)")
NOT_SECTIONS = {"self", "params"}
EXTENSIONS = set("cpp csv elf glb hpp html obj ply svg toml tum txt".split())
durations = []  # (seconds, command)


def blocks_of(text):
    """(marker, lines) of every ```sh block; a backslash at the end joins lines."""
    for match in FENCE.finditer(text):
        lines = match[2].replace("\\\n", " ").splitlines()
        yield match[1].strip(), [line.split(" #")[0].strip() for line in lines
                                 if line.strip() and not line.strip().startswith("#")]


def shortened(line):
    line = re.sub(r"simulation\.frame_limit=\d+", "simulation.frame_limit=15", line)
    line = re.sub(r"--voxel 0\.\d+", f"--voxel {VOXEL}", line)
    if "--realistic" in line:  # half a second a frame
        line = re.sub(r"--frames \d+", "--frames 8", line)
    words = shlex.split(line)
    if words[0] in ("hm", "./hm") and "--list" not in words:
        for verb in (" ".join(words[1:2]), " ".join(words[1:3])):
            line += "".join(" " + word for word in SHORT.get(verb, []))
    if words[1:3] == ["simulate", "calibration"]:
        return line + SMALL_SET
    if words[1:2] == ["simulate"] and "laser_mav" in words:
        return re.sub(r"--frames \d+", "--frames 200", line) if "--frames" in words else line + " --frames 200"
    if words[1:3] == ["evaluate", "uncertainty"] and "--frames" not in words:
        return line + " --views 1 --frames 12"
    if words[1:2] == ["experiment"] and words[2:3] != ["list"] and "--tiny" not in words:
        return line + " --tiny"
    if words[1:3] == ["fly", "hover"] and "--duration" not in words:
        return line + " --duration 4"
    if words[1:3] == ["simulate", "house"] and "--frames" not in words:
        return line + " --frames 12"
    if words[1:3] == ["simulate", "office"] and "--frames" not in words:
        return line + " --frames 150"
    return line


def remove_old_result(line, folder):
    """A reader's folder of results is not there yet; `result` of prepare() and those of other lines are."""
    words = line.split()
    if "-o" not in words or "--resume" in words or "--overwrite" in words:
        return
    output = Path(folder) / words[words.index("-o") + 1]
    if (output / "run.json").is_file():
        shutil.rmtree(output)


def serves_until_stopped(line):
    words = line.split()
    return words[1:2] == ["serve"] or (words[1:3] == ["fly", "teleop"] and "--serve" in line)


def serve_and_stop(line, folder, environment):
    """Starts a command that ends by Ctrl-C, waits until it serves, stops it. None when that worked."""
    process = subprocess.Popen(["bash", "-ec", "exec " + line], cwd=folder, env=environment, stdin=subprocess.DEVNULL,
                               stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
    watch = threading.Timer(LIMIT_S, process.kill)
    watch.start()
    said = ""
    for text in process.stderr:
        said += text
        if "http://" in text:
            process.send_signal(signal.SIGINT)
    watch.cancel()
    if process.wait() == 0 and "http://" in said:
        return None
    return f"exit code {process.returncode}: {said.strip()[-500:]}"


def run_line(line, folder):
    """None when the line worked, or what went wrong."""
    remove_old_result(line, folder)
    environment = {**os.environ, "PATH": f"{folder}:{os.environ['PATH']}"}
    begin = time.monotonic()
    try:
        if serves_until_stopped(line):
            return serve_and_stop(line, folder, environment)
        result = subprocess.run(["bash", "-ec", shortened(line)], cwd=folder, env=environment, capture_output=True,
                                text=True, timeout=LIMIT_S)
    except subprocess.TimeoutExpired:
        return f"took more than {LIMIT_S} s"
    finally:
        durations.append((time.monotonic() - begin, line))
    if result.returncode == 0:
        return None
    return f"exit code {result.returncode}: {(result.stderr or result.stdout).strip()[-500:]}"


@lru_cache(maxsize=None)
def prepared_folder(program):
    """The folder that the texts assume, made once, and what went wrong, or None."""
    folder = tempfile.mkdtemp(prefix="hm_docs_prepared_")
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    (Path(folder) / "hm").symlink_to(Path(program).resolve())
    lines = ["hm simulate room -o recording --frames 20 --quiet", "cp -r recording my_recording",
             "hm reconstruct recording -o result --quiet",
             "hm odometry recording -o tracked --quiet",
             "hm slam recording -o whole --quiet",
             "hm simulate room -o my_flight --sensor laser_mav --frames 200 --quiet", "cp -r my_flight second_flight",
             "hm laser my_flight -o flown --quiet",
             "printf '1 0 1.2\\n1 0.3 1.2 90\\n' > tour.txt",
             "printf 'takeoff 1.2\\ngoto 1 0 1.2\\nwait 1\\nland\\n' > tour.fly",
             "mkdir other", "cp result/parameters.toml other/", f"cp -r {ROOT}/configs configs"]
    for line in lines:
        if wrong := run_line(line, folder):
            return folder, f"{line}: {wrong}"
    return folder, None


def prepare(folder, program):
    """Copies the folder that the texts assume. Returns what went wrong, or None."""
    prepared, wrong = prepared_folder(program)
    shutil.copytree(prepared, folder, symlinks=True, dirs_exist_ok=True)
    return wrong


def check_text(name, text, folder):
    """(number of commands run, problems)."""
    count, problems = 0, []
    for marker, lines in blocks_of(text):
        for line in lines:
            if marker == "manual":
                if line.split()[0] not in MANUAL_WORDS:
                    problems.append(f"{name}: `{line}` is marked manual; that is for {sorted(MANUAL_WORDS)}")
                continue
            count += 1
            if wrong := run_line(line, folder):
                problems.append(f"{name}: `{line}`: {wrong}")
    return count, problems


def check_links(name, text, folder):
    """Links to files that are not there, and pictures that are too large."""
    problems = []
    for is_picture, target in LINK.findall(text):
        path = Path(folder) / target
        if not path.exists():
            problems.append(f"{name}: the link to {target} leads nowhere")
        elif is_picture and path.stat().st_size > PICTURE_LIMIT_BYTES:
            problems.append(f"{name}: {target} has {path.stat().st_size} bytes; {PICTURE_LIMIT_BYTES} at most")
    return problems


def check_names(name, text, root):
    """References to code ("[`file`](../src/file): `name`, `name`") whose file does not have the name."""
    count, problems = 0, []
    for source, names in SOURCE_REFERENCE.findall(text):
        path = Path(root) / source
        code = path.read_text(encoding="utf-8") if path.is_file() else ""
        for word in re.findall(r"`(\w+)`", names):
            count += 1
            if not re.search(rf"\b{word}\b", code):
                problems.append(f"{name}: {source} has no {word}")
    return count, problems


def named_files(text):
    """Source files in backticks, `a_{b,c}.hpp` as two."""
    for word in re.findall(r"`([\w./{},-]+\.(?:hpp|cpp|ts))`", text):
        if braces := re.search(r"\{([^}]*)\}", word):
            yield from (word[:braces.start()] + part + word[braces.end():] for part in braces[1].split(","))
        else:
            yield word


def check_files(readme, folders):
    """Source files that a README names and that are not there, from its own folder or one of these."""
    files = list(named_files(readme.read_text(encoding="utf-8")))
    return len(files), [f"{readme}: there is no {file}" for file in files
                        if not any((folder / file).is_file() for folder in (readme.parent, *folders))]


def check_rooms(table, rooms):
    """Rooms that the table of the architecture leaves out."""
    return [f"docs/architecture.md: its table has no room {room}" for room in rooms if f"`{room}`" not in table]


def check_words(name, text, code):
    """Types and functions in backticks (a capital or an underscore in them) that are nowhere in the code."""
    words = {part for word in re.findall(r"`((?:\w+::)?\w+)`", text) for part in word.split("::")
             if re.search(r"[A-Z_]", part)}
    return len(words), [f"{name}: {word} is nowhere in src/hm" for word in sorted(words - code)]


def words_of_code(text):
    """(line number, words) of every string and comment of C++; not of includes and of names of earlier versions."""
    for number, line in enumerate(text.splitlines(), 1):
        if not line.startswith("#include") and "add_renamed" not in line:
            strings = re.findall(r'"((?:[^"\\]|\\.)*)"', line)
            yield number, " ".join(strings + ([line[line.index("//"):]] if "//" in line else []))


def words_of_page(text):
    """(line number, words) of everything in backticks."""
    for number, line in enumerate(text.splitlines(), 1):
        yield number, " ".join(re.findall(r"`([^`]*)`", line))


def check_parameters(name, lines, parameters):
    """section.key with the section or the key of a parameter, but no parameter."""
    sections, keys = ({parameter.split(".")[part] for parameter in parameters} for part in (0, 1))
    count, problems = 0, []
    for number, words in lines:
        for section, key in NAME_WITH_DOT.findall(words):
            if (section not in sections and key not in keys) or section in NOT_SECTIONS or key in EXTENSIONS:
                continue
            count += 1
            if f"{section}.{key}" not in parameters:
                problems.append(f"{name}:{number}: there is no parameter {section}.{key}")
    return count, problems


def check_all_parameters():
    parameters = set(PARAMETER.findall((ROOT / "docs/parameters.md").read_text("utf-8")))
    total, problems = 0, []
    for path in sorted(path for part in ("src/hm", "apps") for path in (ROOT / part).rglob("*.[ch]pp")):
        if not path.name.endswith("_test.cpp"):
            count, found = check_parameters(path.relative_to(ROOT), words_of_code(path.read_text("utf-8")), parameters)
            total, problems = total + count, problems + found
    for path in (*sorted((ROOT / "docs").glob("*.md")), ROOT / "README.md"):
        count, found = check_parameters(path.relative_to(ROOT), words_of_page(path.read_text("utf-8")), parameters)
        total, problems = total + count, problems + found
    return total, problems


def check_all_names():
    code = {word for path in (ROOT / "src/hm").rglob("*.[ch]pp") for word in re.findall(r"\w+", path.read_text("utf-8"))}
    code |= {path.name for path in (ROOT / "src/hm").iterdir()}
    architecture = (ROOT / "docs/architecture.md").read_text("utf-8")
    total, problems = check_words("docs/architecture.md", architecture, code)
    problems += check_rooms(architecture, [path.name for path in sorted((ROOT / "src/hm").iterdir()) if path.is_dir()])
    readmes = [path for folder in ("src", "apps", "bench", "tests", "web", "firmware") for path in (ROOT / folder).rglob("README.md")
               if "node_modules" not in path.parts]
    for readme in sorted(readmes):
        count, found = check_files(readme, (ROOT / "src/hm", ROOT))
        total, problems = total + count, problems + found
    for path in sorted((ROOT / "docs").glob("*.md")):
        text = path.read_text(encoding="utf-8")
        count, found = check_names(str(path.relative_to(ROOT)), text, ROOT)
        total, problems = total + count, problems + found + check_links(path.name, text, path.parent)
    count, found = check_all_parameters()
    total, problems = total + count, problems + found
    for problem in problems:
        print(problem)
    print(f"names: {total} checked, {len(problems)} problems")
    return 1 if problems or total == 0 else 0


def help_examples(program, verb):
    text = subprocess.run([program, *verb.split(), "--help"], capture_output=True, text=True, check=True).stdout
    return [line.strip() for line in text.partition("Examples:")[2].splitlines() if line.strip()]


def check_all(program, part):
    texts = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))] if part != "help" else []
    total, problems, run_before = 0, [], set()
    for path in texts:
        with tempfile.TemporaryDirectory(prefix="hm_docs_") as folder:
            text = path.read_text(encoding="utf-8")
            problems += check_links(str(path.relative_to(ROOT)), text, path.parent)
            if not any(True for _ in blocks_of(text)):
                continue
            if wrong := prepare(folder, program):
                return total, [wrong]
            count, found = check_text(str(path.relative_to(ROOT)), text, folder)
            total, problems = total + count, problems + found
    if part == "texts":
        return total, problems
    with tempfile.TemporaryDirectory(prefix="hm_help_") as folder:
        if wrong := prepare(folder, program) or run_line("hm simulate calibration -o set --quiet", folder):
            return total, [wrong]
        shutil.copytree(Path(folder) / "result", Path(folder) / "result_of_prepare")
        for verb in HELP_VERBS:
            shutil.rmtree(Path(folder) / "result")  # of the verb before
            shutil.copytree(Path(folder) / "result_of_prepare", Path(folder) / "result")
            examples = help_examples(program, verb)
            if not examples:
                problems.append(f"hm {verb} --help has no examples")
            for line in examples:
                if re.match(r"hm simulate room -o recording ", line):
                    line = line.replace("-o recording", "-o fresh_recording")
                total += 1
                if line in run_before:  # another verb has the same example
                    continue
                run_before.add(line)
                if wrong := run_line(line, folder):
                    problems.append(f"hm {verb} --help: `{line}`: {wrong}")
    return total, problems


def self_test():
    text = "```sh\ntrue   # fine\nfalse\n```\n```sh manual\ngit clone x\nrm -r x\n```\n```cpp\nnothing\n```\n"
    with tempfile.TemporaryDirectory() as folder:
        count, problems = check_text("text", text, folder)
        (Path(folder) / "there.png").write_bytes(bytes(PICTURE_LIMIT_BYTES + 1))
        links = check_links("text", "![a](there.png) [b](there.png) [c](gone.md) [d](https://x.org) [e](#f)", folder)
        (Path(folder) / "src").mkdir()
        (Path(folder) / "src/a.hpp").write_text("struct There {};")
        names = check_names("text", "[`a`](../src/a.hpp): `There`, `Gone`; [`b`](../src/b.hpp): `There`", folder)
        (Path(folder) / "README.md").write_text("`src/a.hpp`, `src/{a,b}.hpp` and `gone.cpp`")
        files = check_files(Path(folder) / "README.md", ())
        rooms = check_rooms("| `core` `io` |", ["core", "io", "iodine"])
    words = check_words("text", "`There::is_it` and `Gone` but not `these` or `a/B.hpp`", {"There", "is_it"})
    code = '#include "a.key"\nlist.add_renamed("old.key", "new.key");\nfail("old.key");\nfail("new.key");  // new.gone\n'
    keys = check_parameters("a.cpp", words_of_code(code), {"new.key"})
    page = check_parameters("a.md", words_of_page("`new.key` old.key `old.key`, `new.toml`"), {"new.key"})
    good = keys[0] == 3 and len(keys[1]) == 2 and "a.cpp:3:" in keys[1][0] and page[0] == 2 and len(page[1]) == 1
    good = good and names[0] == 3 and len(names[1]) == 2 and words[0] == 3 and len(words[1]) == 1
    good = good and count == 2 and len(problems) == 2 and "`false`" in problems[0] and "`rm -r x`" in problems[1]
    good = good and len(links) == 2 and "bytes" in links[0] and "gone.md" in links[1]
    good = good and files[0] == 4 and len(files[1]) == 2 and len(rooms) == 1
    print("docs self-test:", "good" if good else f"wrong: {count} {problems} {links}")
    return 0 if good else 1


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--program")
    parser.add_argument("--names", action="store_true")
    parser.add_argument("--part", choices=["texts", "help"], help="only the documents, or only --help")
    parser.add_argument("--self-test", action="store_true")
    arguments = parser.parse_args()
    if arguments.names:
        return check_all_names()
    if arguments.self_test:
        return self_test()
    if not arguments.program:
        parser.error("--program says which hm runs the commands, as build/release/bin/hm")
    total, problems = check_all(arguments.program, arguments.part)
    for problem in problems:
        print(problem)
    for seconds, line in sorted(durations, reverse=True)[:8]:
        print(f"docs: {seconds:6.1f} s  {line}")
    print(f"docs: {total} commands run in {sum(seconds for seconds, _ in durations):.0f} s, {len(problems)} problems")
    return 1 if problems or total == 0 else 0


if __name__ == "__main__":
    sys.exit(main())
