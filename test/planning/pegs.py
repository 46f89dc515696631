"""Objects that two contacts hold: a square on two pegs, what hangs on pegs, a rocker in a V.

On pegs at the height 0 and `WIDTH` apart the lower corner of a square moves on the circle over
the pegs (Thales), twice as fast as the square turns: by φ from upright it is
(w/2)(sin 2φ, −cos 2φ) from the middle between the pegs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from scipy.optimize import fsolve

from cfplan_core.contact.elements import parse_contact
from cfplan_core.contact.formation import Formation
from cfplan_core.contact.gaps import gaps
from cfplan_core.contact.system import ContactSystem, IntArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.model import Finger, Goal, Grasp, Hand, Joint, Link, ManipulatedObject, Problem
from cfplan_core.planning.equations import formation_rows
from cfplan_core.planning.manifold import settle

Polygon = Sequence[tuple[float, float]]

# Half diagonal of the square, distance of the pegs.
HALF, WIDTH = 0.02, 0.016
# A finger from here to a peg.
BASE = (0.05, -0.05)
REACH = math.hypot(BASE[0] - WIDTH / 2, BASE[1])
UPRIGHT = math.atan2(-BASE[1], WIDTH / 2 - BASE[0])
PEG = [(-0.1, -0.1), (-WIDTH / 2, -0.1), (-WIDTH / 2, 0.0), (-0.1, 0.0)]
# The square's lower edges on the fixed peg and on the fingertip.
ON_PEG, ON_TIP = 'object.e2|palm.0.v2', 'object.e3|finger.link.v1'
# What stops the square from turning far: its right and its left edge come to lie on their corners.
RIGHT_LEDGE = [(0.019, 0.005), (0.03, 0.005), (0.03, 0.007), (0.019, 0.007)]
LEFT_LEDGE = [(-0.03, 0.0063), (-0.0185, 0.0063), (-0.0185, 0.0083), (-0.03, 0.0083)]
ON_RIGHT, ON_LEFT = 'object.e3|palm.1.v3', 'object.e2|palm.2.v2'


def finger(
    name: str = 'finger',
    base: tuple[float, float] = BASE,
    limits: tuple[float, float] = (0.3, 3.0),
    reach: float = REACH,
) -> Finger:
    joint = Joint(f'{name}_joint', *limits, velocity_limit=1.0, effort_limit=1.0)
    outline = [(0.0, -0.002), (reach, 0.0), (0.0, 0.002)]
    return Finger(name, base, 0.0, (joint,), (Link('link', reach, outline),))


def square(center_of_mass: tuple[float, float] = (0.0, 0.0)) -> ManipulatedObject:
    outline = [(HALF, 0.0), (0.0, HALF), (-HALF, 0.0), (0.0, -HALF)]
    return ManipulatedObject(outline, 0.1, center_of_mass)


def _problem(
    name: str,
    palm: Sequence[Polygon],
    fingers: tuple[Finger, ...],
    thing: ManipulatedObject,
    start: Grasp,
) -> Problem:
    hand = Hand(tuple(palm), fingers)
    return Problem(name, (0.0, -9.81), hand, thing, 0.0, start, Goal(start.object_pose))


def cradle(palms: Sequence[Polygon] = (RIGHT_LEDGE, LEFT_LEDGE)) -> Problem:
    """A square on a fixed peg and a fingertip, upright, between two ledges."""
    start = Grasp((0.0, HALF - WIDTH / 2, 0.0), (UPRIGHT,))
    return _problem('cradle', (PEG, *palms), (finger(),), square(), start)


def two_fingers(palms: Sequence[Polygon] = (RIGHT_LEDGE, LEFT_LEDGE)) -> Problem:
    """A square on two fingertips, upright, between two ledges."""
    start = Grasp((0.0, HALF - WIDTH / 2, 0.0), (math.pi - UPRIGHT, UPRIGHT))
    fingers = (finger('left', (-BASE[0], BASE[1])), finger('right'))
    return _problem('two_fingers', palms, fingers, square(), start)


def seat(width: float, turn: float = 0.0) -> Problem:
    """The square on two fixed pegs, turned about the circle of its lower corner."""
    left = [(-0.1, -0.1), (-width / 2, -0.1), (-width / 2, 0.0), (-0.1, 0.0)]
    right = [(width / 2, -0.1), (0.1, -0.1), (0.1, 0.0), (width / 2, 0.0)]
    corner = width / 2 * np.array([math.sin(2.0 * turn), -math.cos(2.0 * turn)])
    pose = (corner[0] - HALF * math.sin(turn), corner[1] + HALF * math.cos(turn), turn)
    far = finger('far', (0.3, 0.0))
    return _problem('seat', (left, right), (far,), square(), Grasp(pose, (1.0,)))


def hanger(width: float, depth: float) -> Problem:
    """An object that hangs by its roof, of right angle, on two pegs, the mass `depth` below.

    The roof's corner is width / 2 above the pegs and moves on the circle over them.
    """
    pegs = [[(x - 1e-4, -0.05), (x + 1e-4, -0.05), (x, 0.0)] for x in (-width / 2, width / 2)]
    roof = [(0.0, 0.0), (-0.03, -0.03), (-0.03, 0.01), (0.03, 0.01), (0.03, -0.03)]
    thing = ManipulatedObject(roof, 0.1, (0.0, -depth))
    far = finger('far', (0.3, 0.0))
    return _problem('hanger', pegs, (far,), thing, Grasp((0.0, width / 2, 0.0), (1.0,)))


def rocker(length: float, depth: float) -> Problem:
    """A bar whose ends lie in a V of right angle, its mass `depth` below its middle.

    The middle of the bar moves on the circle of radius length / 2 about the V's corner, turning
    against the bar.
    """
    walls = [[(0.0, 0.0), (0.2, 0.2), (0.2, -0.1)], [(0.0, 0.0), (-0.2, -0.1), (-0.2, 0.2)]]
    bar = [(-length / 2, 0.0), (0.0, -0.001), (length / 2, 0.0), (0.0, 0.001)]
    thing = ManipulatedObject(bar, 0.1, (0.0, -depth))
    far = finger('far', (0.4, -0.3))
    return _problem('rocker', walls, (far,), thing, Grasp((0.0, length / 2, 0.0), (1.0,)))


def swing(seam: float | None = None) -> Problem:
    """A bar, its mass below, in a V between a slope of the palm and a link that turns.

    With a seam the slope consists of two parts that meet so far out.
    """
    parts = [(0.0, 0.2)] if seam is None else [(0.0, seam), (seam, 0.2)]
    palm = [[(-b, b), (-b - 0.05, b - 0.05), (-a - 0.05, a - 0.05), (-a, a)] for a, b in parts]
    joint = Joint('wall_joint', 0.3, 1.2, velocity_limit=1.0, effort_limit=5.0)
    outline = [(0.0, -0.01), (0.2, -0.01), (0.2, 0.0), (0.0, 0.0)]
    wall = Finger('wall', (0.0, 0.0), 0.0, (joint,), (Link('link', 0.2, outline),))
    bar = [(-0.03, 0.0), (0.0, -0.001), (0.03, 0.0), (0.0, 0.001)]
    thing = ManipulatedObject(bar, 0.1, (0.0, -0.05))
    return _problem('swing', palm, (wall,), thing, Grasp((0.0, 0.03, 0.0), (math.pi / 4,)))


def formation(system: ContactSystem, *names: str) -> Formation:
    return Formation(tuple(sorted(system.pair(parse_contact(name)) for name in names)))


def balanced(system: ContactSystem, grasp: Grasp, *names: str) -> tuple[FloatArray, IntArray]:
    """Configuration near a grasp where two contacts balance the object, and their pairs."""
    pairs = formation(system, *names).array
    return settle(system, system.configuration(grasp), formation_rows(pairs)), pairs


def lowest_nearby(
    system: ContactSystem, z: FloatArray, pairs: IntArray, radius: float, seed: int = 0
) -> float:
    """Least energy, less that at z, of poses up to a radius from z where no gap is negative.

    Random poses, and with two contacts poses on which both gaps vanish. In weights times sizes;
    the joints keep still.
    """

    def gap(pose: FloatArray) -> FloatArray:
        moved = np.concatenate([pose, z[3:]])
        return np.asarray(gaps(system, system.place(moved[None]), pairs).gap[0])

    def energy(pose: FloatArray) -> float:
        return float(-(system.load @ pose))

    chance = np.random.default_rng(seed)
    directions = chance.normal(size=(300, 3))
    directions *= radius / np.linalg.norm(directions, axis=1, keepdims=True)
    found = [np.inf]
    for direction in directions[:60] if len(pairs) == 2 else ():
        unit = direction / radius

        def off(pose: FloatArray, unit: FloatArray = unit) -> FloatArray:
            return np.append(gap(pose), unit @ (pose - z[:3]) - radius / 3.0)

        pose, _, state, _ = fsolve(off, z[:3] + direction / 3.0, full_output=True, xtol=1e-14)
        if state == 1 and np.abs(pose - z[:3]).max() < 3.0 * radius:
            found.append(energy(pose) - energy(z[:3]))
    for direction in directions:
        pose = z[:3] + direction * chance.uniform(0.1, 1.0)
        if (gap(pose) >= 0.0).all():
            found.append(energy(pose) - energy(z[:3]))
    return min(found)
