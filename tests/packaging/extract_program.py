"""Writes the program of the README (its only ```cmake and ```cpp blocks) into a folder."""
import re
import sys
from pathlib import Path

readme, folder = Path(sys.argv[1]).read_text(), Path(sys.argv[2])
folder.mkdir(parents=True, exist_ok=True)
for language, name in (("cmake", "CMakeLists.txt"), ("cpp", "mine.cpp")):
    blocks = re.findall(rf"^```{language}\n(.*?)^```", readme, re.M | re.S)
    if len(blocks) != 1:
        sys.exit(f"the README has {len(blocks)} {language} blocks, not one")
    (folder / name).write_text(blocks[0])
