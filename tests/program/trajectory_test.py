"""hm evaluate trajectory against an independent computation: Horn's quaternion method, quaternion algebra, search."""
import itertools
import math
import random

import support


def multiply(a, b):
    """Product of quaternions (w, x, y, z)."""
    return (a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3], a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
            a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1], a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0])


def conjugate(q):
    return (q[0], -q[1], -q[2], -q[3])


def rotate(q, p):
    return multiply(multiply(q, (0, *p)), conjugate(q))[1:]


def turn(x, y, z):
    """The quaternion of a rotation vector."""
    angle = math.sqrt(x * x + y * y + z * z)
    s = math.sin(angle / 2) / angle if angle > 0 else 0.5
    return (math.cos(angle / 2), s * x, s * y, s * z)


def angle_of(q):
    return 2 * math.atan2(math.sqrt(q[1] ** 2 + q[2] ** 2 + q[3] ** 2), abs(q[0]))


def minus(a, b):
    return tuple(u - v for u, v in zip(a, b))


def length(a):
    return math.sqrt(sum(u * u for u in a))


def rms(values):
    return math.sqrt(sum(v * v for v in values) / len(values))


def mean(points):
    return tuple(sum(p[k] for p in points) / len(points) for k in range(3))


def largest_eigenvector(matrix):
    """Of a symmetric 4 x 4 matrix, by many powers of it, shifted to be positive."""
    shift = sum(abs(v) for row in matrix for v in row)
    m = [[matrix[i][j] + (shift if i == j else 0) for j in range(4)] for i in range(4)]
    for _ in range(40):  # squaring: the power doubles every time
        m = [[sum(m[i][k] * m[k][j] for k in range(4)) for j in range(4)] for i in range(4)]
        scale = max(abs(v) for row in m for v in row)
        m = [[v / scale for v in row] for row in m]
    column = max(range(4), key=lambda j: sum(m[i][j] ** 2 for i in range(4)))
    vector = [m[i][column] for i in range(4)]
    return tuple(v / length(vector) for v in vector)


def fit(truth, estimate, kind):
    """(scale, quaternion, translation) from estimate to truth. Horn 1987; yaw by ternary search."""
    if kind == "none":
        return 1, (1, 0, 0, 0), (0, 0, 0)
    a, b = mean(estimate), mean(truth)
    from_ = [minus(p, a) for p in estimate]
    to = [minus(p, b) for p in truth]
    s = [[sum(p[i] * q[j] for p, q in zip(from_, to)) for j in range(3)] for i in range(3)]
    if kind == "yaw":
        def gain(angle):
            return sum(math.cos(angle) * (p[0] * q[0] + p[1] * q[1]) + math.sin(angle) * (p[0] * q[1] - p[1] * q[0])
                       for p, q in zip(from_, to))
        best = max((k * math.pi / 180 for k in range(360)), key=gain)
        low, high = best - 0.05, best + 0.05
        while high - low > 1e-12:
            left, right = low + (high - low) / 3, high - (high - low) / 3
            low, high = (left, high) if gain(left) < gain(right) else (low, right)
        q = turn(0, 0, low)
    else:
        n = [[s[0][0] + s[1][1] + s[2][2], s[1][2] - s[2][1], s[2][0] - s[0][2], s[0][1] - s[1][0]],
             [s[1][2] - s[2][1], s[0][0] - s[1][1] - s[2][2], s[0][1] + s[1][0], s[2][0] + s[0][2]],
             [s[2][0] - s[0][2], s[0][1] + s[1][0], s[1][1] - s[0][0] - s[2][2], s[1][2] + s[2][1]],
             [s[0][1] - s[1][0], s[2][0] + s[0][2], s[1][2] + s[2][1], s[2][2] - s[0][0] - s[1][1]]]
        q = largest_eigenvector(n)
    scale = 1
    if kind == "sim3":
        scale = sum(sum(u * v for u, v in zip(rotate(q, p), t)) for p, t in zip(from_, to)) / sum(
            length(p) ** 2 for p in from_)
    turned = rotate(q, a)
    return scale, q, tuple(b[k] - scale * turned[k] for k in range(3))


def own_rotation(pairs, kind):
    """Of the orientations alone: the average of the turns from estimate to truth (Markley et al. 2007)."""
    turns = [multiply(true[2], conjugate(pose[2])) for true, pose in pairs]
    if kind == "none":
        return 1, 0, 0, 0
    if kind == "yaw":  # of all turns about z the nearest: |q0 w + q3 z|^2 is largest
        sums = [sum(q[i] * q[j] for q in turns) for i, j in ((0, 0), (0, 3), (3, 3))]
        half = 0.5 * math.atan2(2 * sums[1], sums[0] - sums[2])
        return math.cos(half), 0, 0, math.sin(half)
    return largest_eigenvector([[sum(q[i] * q[j] for q in turns) for j in range(4)] for i in range(4)])


def slerp(a, b, share):
    """The quaternion this share of the way from a to b, the short way round."""
    step = multiply(conjugate(a), b)
    if step[0] < 0:
        step = tuple(-v for v in step)
    sine = length(step[1:])
    angle = 2 * math.atan2(sine, step[0])
    return multiply(a, turn(*(share * angle / sine * v for v in step[1:]))) if sine > 0 else a


def interpolated(truth, estimate, max_gap):
    """Each estimated pose with the truth at its stamp, linear between two neighbours."""
    pairs = []
    for pose in estimate:
        before = [t for t in truth if t[0] <= pose[0]]
        after = [t for t in truth if t[0] >= pose[0]]
        if not before or not after or after[0][0] - before[-1][0] > max_gap:
            continue
        a, b = before[-1], after[0]
        share = (pose[0] - a[0]) / (b[0] - a[0]) if b[0] > a[0] else 0
        there = tuple(u + share * (v - u) for u, v in zip(a[1], b[1]))
        pairs.append(((pose[0], there, slerp(a[2], b[2], share)), pose))
    return pairs


def nearest(truth, estimate, window):
    """Nearest first, each pose once."""
    candidates = sorted((abs(t[0] - e[0]), i, j) for i, t in enumerate(truth) for j, e in enumerate(estimate)
                        if abs(t[0] - e[0]) <= window)
    used_truth, used_estimate, pairs = set(), set(), []
    for _, i, j in candidates:
        if i not in used_truth and j not in used_estimate:
            used_truth.add(i)
            used_estimate.add(j)
            pairs.append((truth[i], estimate[j]))
    return sorted(pairs, key=lambda pair: pair[0][0])


def motion(first, second):
    """(quaternion, translation) of the second pose in the first."""
    inverse = conjugate(first[2])
    return multiply(inverse, second[2]), rotate(inverse, minus(second[1], first[1]))


def relative(pairs, at, delta):
    """Errors of translation and rotation of all spans that are at least delta long."""
    steps = sorted(b - a for a, b in zip(at, at[1:]))
    middle = (steps[(len(steps) - 1) // 2] + steps[len(steps) // 2]) / 2
    translations, rotations = [], []
    for i in range(len(pairs)):
        ends = [j for j in range(i + 1, len(pairs)) if at[j] - at[i] >= delta * (1 - 1e-9)]
        if not ends or at[ends[0]] - at[i] > max(1.5 * delta, delta + 1.5 * middle):
            continue
        true_q, true_t = motion(pairs[i][0], pairs[ends[0]][0])
        q, t = motion(pairs[i][1], pairs[ends[0]][1])
        translations.append(length(minus(t, true_t)))
        rotations.append(angle_of(multiply(conjugate(true_q), q)))
    return rms(translations), rms(rotations)


def evaluate(pairs, kind):
    scale, q, t = fit([p[0][1] for p in pairs], [p[1][1] for p in pairs], kind)
    moved = []
    for true, pose in pairs:
        turned = rotate(q, pose[1])
        moved.append((true, (pose[0], tuple(scale * turned[k] + t[k] for k in range(3)), multiply(q, pose[2]))))
    errors = [length(minus(true[1], pose[1])) for true, pose in moved]
    travelled, seconds = [0.0], [true[0] - moved[0][0][0] for true, _ in moved]
    for (first, _), (second, _) in zip(moved, moved[1:]):
        travelled.append(travelled[-1] + length(minus(second[1], first[1])))
    numbers = {"pairs": len(pairs), "ate_rmse_m": rms(errors), "ate_max_m": max(errors), "alignment_scale_ratio": scale,
               "truth_path_m": path_length([true[1] for true, _ in moved]),
               "rotation_rmse_rad": rms([angle_of(multiply(conjugate(true[2]), pose[2])) for true, pose in moved])}
    own = own_rotation(pairs, kind)
    numbers["rotation_own_rmse_rad"] = rms([angle_of(multiply(conjugate(true[2]), multiply(own, pose[2])))
                                            for true, pose in pairs])
    numbers["ate_given_rmse_m"] = rms([length(minus(true[1], pose[1])) for true, pose in pairs])
    for name, at in (("frame", range(len(moved))), ("second", seconds), ("metre", travelled)):
        numbers[f"rpe_{name}_m"], numbers[f"rpe_{name}_rad"] = relative(moved, list(at), 1)
    return numbers


def path_length(positions, least_step_m=0.02):
    """In steps of at least 2 cm, so that the noise of many poses does not add to it."""
    total, last = 0.0, positions[0]
    for position in positions:
        step = length(minus(position, last))
        if step >= least_step_m:
            total, last = total + step, position
    return total + length(minus(positions[-1], last))


def write(path, poses):
    path.write_text("".join(f"{t:.9f} {p[0]!r} {p[1]!r} {p[2]!r} {q[1]!r} {q[2]!r} {q[3]!r} {q[0]!r}\n"
                            for t, p, q in poses))


class Trajectories(support.ProgramTest):
    def test_agrees_with_an_independent_computation(self):
        draw = random.Random(7)
        truth, estimate = [], []
        drift, heading = [0.0, 0.0, 0.0], 0.0
        for i in range(160):
            t = 1000 + 0.1 * i
            p = (2 * math.sin(0.5 * t), 1.5 * math.cos(0.31 * t), 0.4 * math.sin(0.9 * t) + 0.05 * i)
            q = turn(0.3 * math.sin(t), 0.2 * math.cos(0.7 * t), 0.25 * t)
            truth.append((t, p, q))
            drift = [d + draw.gauss(0, 0.004) for d in drift]
            heading += draw.gauss(0, 0.004)
            if i % 23 == 5 or 70 <= i < 80:
                continue  # poses that the estimate does not have
            wrong = multiply(turn(0.01, -0.02, heading), q)
            estimate.append((t + draw.uniform(-0.02, 0.02), tuple(1.03 * p[k] + drift[k] for k in range(3)), wrong))
        moved = turn(0.4, -0.3, 2.0)
        estimate = [(t, tuple(v + 3 for v in rotate(moved, p)), multiply(moved, q)) for t, p, q in estimate]
        write(self.folder / "truth.tum", truth)
        write(self.folder / "estimate.tum", estimate)
        for association, kind in itertools.product(("nearest", "interpolate"), ("se3", "sim3", "yaw", "none")):
            with self.subTest(association=association, kind=kind):
                ours = self.run_json("evaluate", "trajectory", "estimate.tum", "truth.tum", "--alignment", kind,
                                     "--set", f"trajectory_error.association={association}")
                pairs = nearest(truth, estimate, 0.02) if association == "nearest" else interpolated(truth, estimate, 0.15)
                numbers = evaluate(pairs, kind)
                if ours["rotation_undetermined"]:
                    # Without the scale, positions are off by decimetres, and could turn the fit by degrees.
                    self.assertIn(kind, ("se3", "yaw"))
                    self.assertIsNone(ours["rotation_rmse_rad"])
                    self.assertGreater(ours["alignment_uncertainty_rad"], 0.05)
                    self.assertGreater(numbers.pop("rotation_rmse_rad"), numbers["rotation_own_rmse_rad"])
                for key, value in numbers.items():
                    # Stamps have nanoseconds, rotations come through acos of a trace near 1.
                    self.assertAlmostEqual(ours[key], value, delta=2e-7 + 2e-7 * abs(value), msg=key)
        text = self.run_hm("evaluate", "trajectory", "estimate.tum", "truth.tum").stdout
        for word in ("ATE", "over a frame", "over a second", "over a metre"):
            self.assertIn(word, text)
        self.run_hm("evaluate", "trajectory", "estimate.tum", "truth.tum", "--alignment", "affine", expect=2)

    def test_real_trajectory_against_itself_moved(self):
        data = support.real_data()
        if not data:
            self.skipTest("no real recordings in $HM_DATA or ../shared/data")
        poses = []
        for line in (data / "rgbd/tum_fr1_xyz/groundtruth.txt").read_text().splitlines():
            if not line.startswith("#"):
                v = [float(word) for word in line.split()]
                norm = math.sqrt(sum(u * u for u in v[4:8]))
                poses.append((v[0], tuple(v[1:4]), tuple(u / norm for u in (v[7], v[4], v[5], v[6]))))
        poses = poses[:400]
        draw = random.Random(3)
        noisy = [(t, tuple(u + draw.gauss(0, 0.01) for u in p), multiply(q, turn(0, draw.gauss(0, 0.01), 0)))
                 for t, p, q in poses]
        write(self.folder / "noisy.tum", noisy)
        write(self.folder / "truth.tum", poses)
        ours = self.run_json("evaluate", "trajectory", "noisy.tum", "truth.tum", "--report", "page.html")
        self.assertIsNone(ours["rotation_rmse_rad"])  # 4 s within centimetres, positions with 1 cm of noise
        numbers = evaluate(interpolated(poses, noisy, 0.15), "se3")
        del numbers["rotation_rmse_rad"]
        for key, value in numbers.items():
            self.assertAlmostEqual(ours[key], value, delta=1e-6 + 1e-6 * abs(value), msg=key)
        page = (self.folder / "page.html").read_text()
        self.assertIn("From above", page)
        self.assertIn("From the side", page)


if __name__ == "__main__":
    support.main()
