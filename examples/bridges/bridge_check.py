"""The self-test of the bridges: `--check SECONDS` compares the simulator's values with each other and with canyon live.

A bridge passes its poses to a Check while the vehicle moves. The report shows whether clock, units, axes, attitude, origin
and fixes agree, with hints if they do not. Needs only the standard library.
"""
import collections
import itertools
import math
import statistics
import time

# Minimum movement of the vehicle for the check of axes and units.
LEAST_WAY_M = 2.0
# Allowed relative difference of velocities and differences of positions.
NEAR = 0.1
# Possible units of a number instead of metres or m/s.
UNITS = {1.0: "", 0.01: "centimetres", 0.001: "millimetres", 0.3048: "feet", 1 / 3.6: "km/h", 0.514444: "knots",
         100.0: "hundreds of metres"}
# Of a position in the simulator's own coordinates: more means another origin. Map projections differ by less near it.
FAR_M = 1.0
# Of canyon live's vehicle from its pose: more means another origin, not a lever arm.
FARTHEST_M = 50.0

Pose = collections.namedtuple("Pose", "time_s wall_s enu velocity forward up")
Finding = collections.namedtuple("Finding", "subject ok text")  # ok: True, False, or None: not checked


def norm(vector):
    return math.sqrt(sum(each * each for each in vector))


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def signed_axes():
    """The 48 ways to swap and mirror three axes, the unchanged one first."""
    for order in itertools.permutations(range(3)):
        for signs in itertools.product((1, -1), repeat=3):
            yield order, signs


def arranged(vector, order, signs):
    return [sign * vector[index] for index, sign in zip(order, signs)]


def misfit(pairs, order=(0, 1, 2), signs=(1, 1, 1)):
    """Residual of the first vectors after subtracting the second ones, swapped and mirrored, as a fraction of their length. 0: equal."""
    rest = sum(sum((x - y) ** 2 for x, y in zip(a, arranged(b, order, signs))) for a, b in pairs)
    return math.sqrt(rest / sum(dot(a, a) for a, _ in pairs))


def compared(subject, pairs, known, other):
    """Compares vectors that should be equal, `known` and then `other` of each pair, both in ENU: units, then axes."""
    pairs = [(a, b) for a, b in pairs if norm(a) > 0]
    if not pairs:
        return Finding(subject, None, "not checked: nothing moved")
    if misfit(pairs) < NEAR:
        return Finding(subject, True, f"{other} agree with {known} ({100 * misfit(pairs):.1f} % apart)")
    lengths = [norm(a) / norm(b) for a, b in pairs if norm(b) > 0]
    if not lengths:
        return Finding(subject, False, f"{other} are zero while {known} are not")
    scale = statistics.median(lengths)
    unit = min(UNITS, key=lambda each: abs(scale / each - 1))
    if abs(scale / unit - 1) >= NEAR:
        unit = None
    scaled = [(a, [scale * each for each in b]) for a, b in pairs]
    said = []
    if unit != 1.0:
        said.append("have another unit: 1 is %.3g m%s" % (scale, f", as of {UNITS[unit]}" if unit else ""))
    order, signs = min(signed_axes(), key=lambda way: misfit(scaled, *way))
    if misfit(scaled, order, signs) < NEAR and (order, signs) != ((0, 1, 2), (1, 1, 1)):
        names = "east", "north", "up"
        wrong = [f"{names[i]} is what is taken as {'minus ' if sign < 0 else ''}{names[index]}"
                 for i, (index, sign) in enumerate(zip(order, signs)) if (index, sign) != (i, 1)]
        said.append("have other axes: " + ", ".join(wrong))
    elif misfit(scaled) >= NEAR:
        said.append(f"are {100 * misfit(scaled):.0f} % apart, by no swap of axes")
    return Finding(subject, False, f"{other} {' and '.join(said)} (by {known})")


class Check:
    """@param seconds of the simulator's clock"""

    def __init__(self, seconds):
        self.seconds = seconds
        self._poses, self._backwards = [], 0
        self._stated, self._enu_from = [], None  # ENU from the simulator's own coordinates, and of the pose
        self._fixes, self._solved, self._off_m, self._late_s = 0, 0, [], []

    def pose(self, time_s, enu, velocity, forward, up):
        """All in ENU [m, m/s]; velocity, forward and up may be None."""
        if self._poses and time_s < self._poses[-1].time_s:
            self._backwards += 1
            self._poses.clear()
        self._poses.append(Pose(time_s, time.monotonic(), enu, velocity, forward, up))

    def stated(self, enu, own_enu):
        """A position by the simulator's own latitude, longitude and height (`own_enu`), and as sent by the bridge (`enu`)."""
        self._stated.append((own_enu, enu))

    def fix(self, truth_enu, solved):
        """A received fix. @param truth_enu the vehicle's position in canyon live, if known and without a lever arm"""
        self._fixes += 1
        self._solved += solved
        if truth_enu is None or not self._poses:
            return
        near = min(self._poses, key=lambda pose: math.dist(pose.enu, truth_enu))
        self._off_m.append(math.dist(near.enu, truth_enu))
        self._late_s.append(time.monotonic() - near.wall_s)

    @property
    def done(self):
        return len(self._poses) > 1 and self._poses[-1].time_s - self._poses[0].time_s >= self.seconds

    def findings(self):
        return [self._clock(), self._way(), self._velocity(), self._attitude(), self._origin(), self._answers()]

    def _steps(self):
        """Pairs of successive poses between which the vehicle moved."""
        return [(a, b) for a, b in zip(self._poses, self._poses[1:])
                if b.time_s > a.time_s and math.dist(a.enu, b.enu) > 1e-6]

    def _length_m(self):
        return sum(math.dist(a.enu, b.enu) for a, b in self._steps())

    def _clock(self):
        first, last = self._poses[0], self._poses[-1]
        pace = (last.time_s - first.time_s) / max(last.wall_s - first.wall_s, 1e-9)
        rate = (len(self._poses) - 1) / (last.time_s - first.time_s)
        text = f"{rate:.1f} poses a second, at {pace:.2f} times real time"
        if self._backwards:
            return Finding("clock", False, f"{text}; it went back {self._backwards} times, and canyon live restarts then")
        return Finding("clock", True, text)

    def _way(self):
        lengths = [abs(b.enu[i] - a.enu[i]) for a, b in self._steps() for i in range(3)]
        totals = [sum(lengths[i::3]) for i in range(3)]
        text = "the vehicle moved %.1f m east-west, %.1f m north-south, %.1f m up-down" % tuple(totals)
        jumps = [math.dist(a.enu, b.enu) / (b.time_s - a.time_s) for a, b in self._steps()]
        if jumps and max(jumps) > 500:
            return Finding("way", False, f"{text}; it jumped, at {max(jumps):.0f} m/s: are positions in metres?")
        if sum(totals) < LEAST_WAY_M:
            return Finding("way", None, f"{text}: too little to check axes and units; drive it through a turn, and check again")
        return Finding("way", True, text)

    def _velocity(self):
        pairs = []
        for a, b in self._steps():
            if a.velocity is None or b.velocity is None:
                continue
            quotient = [(q - p) / (b.time_s - a.time_s) for p, q in zip(a.enu, b.enu)]
            pairs.append((quotient, [(v + w) / 2 for v, w in zip(a.velocity, b.velocity)]))
        if self._length_m() < LEAST_WAY_M or not pairs:
            return Finding("velocity", None, "not checked: " + ("the bridge sends none" if not pairs and self._steps() else
                                                                "the vehicle was stationary"))
        # Steps with sudden changes of speed are not informative: compares the best nine tenths.
        pairs.sort(key=lambda pair: abs(norm(pair[0]) - norm(pair[1])))
        return compared("velocity", pairs[:max(1, len(pairs) * 9 // 10)], "differences of positions", "velocities")

    def _attitude(self):
        posed = [pose for pose in self._poses if pose.forward is not None]
        if not posed:
            return Finding("attitude", None, "not checked: the bridge sends none")
        for pose in posed:
            if abs(norm(pose.forward) - 1) > 1e-3 or abs(norm(pose.up) - 1) > 1e-3 or abs(dot(pose.forward, pose.up)) > 1e-3:
                return Finding("attitude", False, "forward and up are not unit vectors at a right angle")
        upright = statistics.median(pose.up[2] for pose in posed)
        if upright < 0.2:
            return Finding("attitude", False, "the vehicle's up axis points %s: is z down in its axes?" % (
                "down" if upright < -0.2 else "to the side"))
        pairs = [(a.forward, [q - p for p, q in zip(a.enu, b.enu)]) for a, b in self._steps() if a.forward is not None]
        moved = [(f, m) for f, m in pairs if math.hypot(*m[:2]) > 0.5 * norm(m)]
        if self._length_m() < LEAST_WAY_M or not moved:
            return Finding("attitude", None, "up is up; the direction of the nose was not checked: the vehicle was stationary")
        # The nose relative to the course, over the ground: the median of the angles.
        off = statistics.median(abs(math.degrees(math.atan2(f[0] * m[1] - f[1] * m[0], f[0] * m[0] + f[1] * m[1])))
                                for f, m in moved)
        text = f"up is up; the nose is {off:.0f} deg off the course"
        if off > 45:
            return Finding("attitude", None, f"{text}: right for a drone that flies sideways, wrong for a car")
        return Finding("attitude", True, text)

    def _origin(self):
        if not self._stated:
            return Finding("origin", None, "not checked: the simulator gives no latitude and longitude")
        (own, ours), last = self._stated[0], self._stated[-1]
        way = [([q - p for p, q in zip(self._stated[0][0], a)], [q - p for p, q in zip(self._stated[0][1], b)])
               for a, b in self._stated if math.dist(a, self._stated[0][0]) > LEAST_WAY_M]
        if way:
            axes = compared("origin", way, "the simulator's latitude, longitude and height", "places that are sent")
            if not axes.ok:
                return axes
        east, north, up = (a - b for a, b in zip(own, ours))
        off_m = max(math.dist(*self._stated[0]), math.dist(*last))
        if off_m > FAR_M:
            return Finding("origin", False, f"by the simulator's latitude, longitude and height the vehicle is {east:.1f} m "
                           f"east, {north:.1f} m north and {up:.1f} m above its place in the city: change --origin, --at or "
                           "the simulator's reference")
        return Finding("origin", True, f"the simulator's latitude, longitude and height agree to {off_m:.2f} m")

    def _answers(self):
        if not self._fixes:
            return Finding("answers", False, "no fix received: check that canyon live runs a receiver for this vehicle with these poses")
        text = f"{self._fixes} epochs received, {self._solved} with a fix"
        if self._off_m:
            off_m = statistics.median(self._off_m)
            text += f"; canyon live's vehicle is within {off_m:.2f} m of its poses, {1e3 * statistics.median(self._late_s):.0f} ms later"
            if off_m > FARTHEST_M:
                return Finding("answers", False, text + ": too far for a lever arm; check that the scenario's city.origin is --origin")
        return Finding("answers", bool(self._solved), text + ("" if self._solved else ": check whether the antenna is inside a building"))

    def report(self):
        """The report as text, and whether nothing differs."""
        findings = self.findings()
        words = {True: "ok", False: "DIFFERS", None: "open"}
        lines = [f"{words[each.ok]:8}{each.subject:10}{each.text}" for each in findings]
        wrong = sum(each.ok is False for each in findings)
        unknown = sum(each.ok is None for each in findings)
        lines.append("%s%s" % (f"{wrong} of {len(findings)} differ" if wrong else "nothing differs",
                               f"; {unknown} not checked" if unknown else ""))
        return "\n".join(lines), wrong == 0
