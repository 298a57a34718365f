"""Camera paths with a twist or a jump in them: what a wrong path looks like to the verdict of a run."""
import math


def read_rows(path):
    """The rows of a TUM file, as tuples of numbers."""
    lines = path.read_text().splitlines()
    return [tuple(map(float, line.split())) for line in lines if line and line[0] != "#"]


def rotation_product(a, b):
    (ax, ay, az, aw), (bx, by, bz, bw) = a, b
    return (aw * bx + ax * bw + ay * bz - az * by, aw * by - ax * bz + ay * bw + az * bx,
            aw * bz + ax * by - ay * bx + az * bw, aw * bw - ax * bx - ay * by - az * bz)


def rotated(rotation, point):
    x, y, z, w = rotation
    inverse = (-x, -y, -z, w)
    return rotation_product(rotation_product(rotation, (*point, 0)), inverse)[:3]


def bent(rows, share, turn_deg=0, shift_m=0, axis=(0, 0, 1)):
    """Text of a TUM file whose rows from `share` on are turned about an axis through the camera's place there, and shifted
    along it. `rows` are tuples of numbers."""
    first = int(share * len(rows))
    pivot = rows[first][1:4]
    half = math.radians(turn_deg) / 2
    turn = (*(math.sin(half) * c for c in axis), math.cos(half))
    result = []
    for i, row in enumerate(rows):
        if i >= first:
            moved = rotated(turn, [p - q for p, q in zip(row[1:4], pivot)])
            place = [p + q + shift_m * c for p, q, c in zip(moved, pivot, axis)]
            row = (row[0], *place, *rotation_product(turn, row[4:8]))
        result.append(" ".join(f"{value:.9f}" for value in row))
    return "\n".join(result) + "\n"
