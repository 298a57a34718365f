#!/usr/bin/env python3
"""Draws the rooms and the arrows between them from the includes: docs/images/rooms.svg.

    scripts/draw_architecture.py           writes the picture
    scripts/draw_architecture.py --check   exit code 1 when the picture is not that of the sources

A room stands one layer above the highest room that it includes. Arrows that others imply (a room's rooms' rooms) are
left out; sub-rooms are listed inside their room.
"""
import re
import sys
from pathlib import Path
from xml.sax.saxutils import escape

import check_architecture

ROOT = Path(__file__).resolve().parent.parent
PICTURE = ROOT / "docs/images/rooms.svg"
INCLUDE = re.compile(r'^\s*#\s*include\s*"hm/([a-z_]+)/', re.M)
BOX_WIDTH, GAP_X, GAP_Y, LINE = 148, 14, 46, 15


def read_rooms():
    """{room: (rooms it includes, sub-rooms)} of the product's files."""
    rooms = {}
    for folder in sorted(p for p in (ROOT / "src/hm").iterdir() if p.is_dir()):
        used, parts = set(), set()
        for path in folder.rglob("*.[ch]pp"):
            relative = path.relative_to(ROOT)
            if check_architecture.is_test(relative) or check_architecture.is_bench(relative):
                continue
            used |= set(INCLUDE.findall(path.read_text(encoding="utf-8")))
            if path.parent != folder:
                parts.add(path.parent.name)
        rooms[folder.name] = (used - {folder.name}, sorted(parts))
    return rooms


def reachable(rooms, start):
    seen, todo = set(), list(rooms[start][0])
    while todo:
        room = todo.pop()
        if room not in seen:
            seen.add(room)
            todo.extend(rooms[room][0])
    return seen


def layers_of(rooms):
    layer = {}

    def place(room):
        if room not in layer:
            layer[room] = 1 + max((place(used) for used in rooms[room][0]), default=-1)
        return layer[room]

    for room in rooms:
        place(room)
    return layer


def draw(rooms):
    layer = layers_of(rooms)
    rows = [[room for room in sorted(rooms) if layer[room] == i] for i in range(max(layer.values()) + 1)]
    width = max(len(row) for row in rows) * (BOX_WIDTH + GAP_X) + GAP_X
    boxes, y, shapes = {}, 10, []
    for row in reversed(rows):
        height = max(24 + LINE * len(rooms[room][1]) for room in row)
        x = (width - len(row) * (BOX_WIDTH + GAP_X) + GAP_X) / 2
        for room in row:
            own = 24 + LINE * len(rooms[room][1])
            boxes[room] = (x, y + (height - own) / 2, own)
            x += BOX_WIDTH + GAP_X
        y += height + GAP_Y
    for room, (used, _) in rooms.items():
        implied = set().union(*(reachable(rooms, other) for other in used)) if used else set()
        x, top, own = boxes[room]
        for other in sorted(used - implied):
            to_x, to_top, _ = boxes[other]
            shapes.append(f'<line x1="{x + BOX_WIDTH / 2:.0f}" y1="{top + own:.0f}" x2="{to_x + BOX_WIDTH / 2:.0f}" '
                          f'y2="{to_top - 3:.0f}" stroke="#8a94a6" marker-end="url(#tip)"/>')
    for room, (x, top, own) in boxes.items():
        shapes.append(f'<rect x="{x:.0f}" y="{top:.0f}" width="{BOX_WIDTH}" height="{own}" rx="5" fill="#eef3fa" '
                      'stroke="#4a6fa5"/>')
        shapes.append(f'<text x="{x + 10:.0f}" y="{top + 17:.0f}" font-weight="bold">{escape(room)}</text>')
        for i, part in enumerate(rooms[room][1]):
            shapes.append(f'<text x="{x + 20:.0f}" y="{top + 17 + LINE * (i + 1):.0f}" fill="#445">{escape(part)}</text>')
    return (f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {y - GAP_Y + 10}" font-family="sans-serif" '
            'font-size="12">\n<defs><marker id="tip" markerWidth="8" markerHeight="8" refX="6" refY="3" orient="auto">'
            '<path d="M0,0 L6,3 L0,6 z" fill="#8a94a6"/></marker></defs>\n'
            f'<rect width="{width}" height="{y - GAP_Y + 10}" fill="#ffffff"/>\n' + "\n".join(shapes) + "\n</svg>\n")


def main():
    picture = draw(read_rooms())
    if "--check" in sys.argv:
        same = PICTURE.is_file() and PICTURE.read_text(encoding="utf-8") == picture
        print("rooms.svg:", "as the sources" if same else "old; run scripts/draw_architecture.py")
        return 0 if same else 1
    PICTURE.write_text(picture, encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
