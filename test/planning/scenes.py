"""Small problems whose curves are known in closed form.

All have a palm at height zero and the object's base on it, at angle zero: the object slides, and x
of its frame says where it is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cfplan_core.contact.elements import parse_contact
from cfplan_core.contact.formation import Formation
from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.model import Finger, Goal, Grasp, Hand, Joint, Link, ManipulatedObject, Problem
from cfplan_core.planning.tracing import Steering, Tracer

Polygon = Sequence[tuple[float, float]]

TABLE = [(-0.5, -0.1), (0.5, -0.1), (0.5, 0.0), (-0.5, 0.0)]
FEET = ('object.v0|palm.0.e2', 'object.v1|palm.0.e2')
TIPS = ('object.e3|left.link.v1', 'object.e1|right.link.v1')
# Bases of the fingers at -BASE and BASE; half the width of the object's base.
BASE = 0.06
HALF = 0.02
# Lengths of the fingers with tips, and the lean of the trapezoid's sides.
LEFT, RIGHT = 0.05, 0.045
LEAN = 0.4


def finger(
    name: str,
    base: tuple[float, float],
    outline: Polygon,
    limits: tuple[float, float] = (0.01, 3.13),
) -> Finger:
    """A finger of one joint; its first outline vertex but one is the end of its first edge."""
    joint = Joint(f'{name}_joint', *limits, velocity_limit=1.0, effort_limit=5.0)
    return Finger(name, base, 0.0, (joint,), (Link('link', outline[1][0], outline),))


def tip(length: float) -> Polygon:
    """A thin triangle; vertex 1 is its tip."""
    return [(0.0, -0.002), (length, 0.0), (0.0, 0.002)]


def pushed_angles(x: float) -> tuple[float, float]:
    """Joint angles at which the tips touch the upright sides of the block at x."""
    left = math.acos((x - HALF + BASE) / LEFT)
    right = math.acos((x + HALF - BASE) / RIGHT)
    return left, right


def pushed_block(
    height: float = 0.04,
    limits: tuple[float, float] = (0.01, 3.13),
    palms: Sequence[Polygon] = (),
) -> Problem:
    """A block between two fingertips, to start with at x = 0: force closure everywhere."""
    return _problem(
        'pushed',
        [(-HALF, 0.0), (HALF, 0.0), (HALF, height), (-HALF, height)],
        (
            finger('left', (-BASE, 0.0), tip(LEFT), limits),
            finger('right', (BASE, 0.0), tip(RIGHT), limits),
        ),
        pushed_angles(0.0),
        palms,
    )


# From its top down to 5 mm below the tip of the mast of `masted_block`, at x = 0.
BARRIER = [(0.0, 0.045), (0.001, 0.1), (-0.001, 0.1)]


def masted_block(palms: Sequence[Polygon] = (BARRIER,)) -> Problem:
    """A block with a mast, 0.05 m high, left of a barrier that the mast cannot pass."""
    outline = [(-HALF, 0.0), (HALF, 0.0), (HALF, 0.04), (0.0005, 0.04), (0.0, 0.05)]
    outline += [(-0.0005, 0.04), (-HALF, 0.04)]
    fingers = (finger('left', (-BASE, 0.0), tip(LEFT)), finger('right', (BASE, 0.0), tip(RIGHT)))
    problem = _problem('masted', outline, fingers, pushed_angles(-0.003), palms)
    return replace(problem, start=Grasp((-0.003, 0.0, 0.0), pushed_angles(-0.003)))


def leaning_tower() -> Problem:
    """A high block between two fingertips, gravity pulling it over to the left.

    The couple of the tips, the left one above the right one, keeps it on both feet; the pull is
    twice as strong to the left as down. Where the right tip is higher nothing does: it is held up
    to x = `EQUAL_HEIGHTS`.
    """
    return replace(pushed_block(height=0.08), gravity=(-8.0, -4.0))


# There (x + 0.04)² + height² = LEFT² and (0.04 - x)² + height² = RIGHT².
EQUAL_HEIGHTS = (LEFT**2 - RIGHT**2) / (4.0 * (BASE - HALF))


def squeezed_angles(x: float) -> tuple[float, float]:
    """Joint angles at which the tips touch the leaning sides of the trapezoid at x."""
    cosine = math.cos(LEAN)
    left = math.acos((BASE - HALF + x) * cosine / LEFT) - LEAN
    right = math.acos((BASE - HALF - x) * cosine / RIGHT) - LEAN
    return left, math.pi - right


def squeezed_trapezoid() -> Problem:
    """A trapezoid between two fingertips, at first at x = 0.

    The tips' lines of force meet above x + (a - b) / sin(2 LEAN) for tips at heights a and b:
    there is form closure where that is inside the base, |a - b| < HALF sin(2 LEAN).
    """
    top = HALF - 0.035 * math.tan(LEAN)
    return _problem(
        'squeezed',
        [(-HALF, 0.0), (HALF, 0.0), (top, 0.035), (-top, 0.035)],
        (finger('left', (-BASE, 0.0), tip(LEFT)), finger('right', (BASE, 0.0), tip(RIGHT))),
        squeezed_angles(0.0),
        (),
    )


def leaning_angles(x: float) -> tuple[float, float]:
    """Joint angles at which the long fingers touch the upper corners of the block at x."""
    return math.atan2(0.04, BASE - HALF + x), math.pi - math.atan2(0.04, BASE - HALF - x)


def leaning_fingers(left: float = 0.1, right: float = 0.08) -> Problem:
    """A block below two fingers of given lengths that lean on its corners and would cross above.

    Their inner edges meet above 1.5 x, at 1.5 times the distance of the corners from the bases.
    """
    return _problem(
        'leaning',
        [(-HALF, 0.0), (HALF, 0.0), (HALF, 0.04), (-HALF, 0.04)],
        (
            finger('left', (-BASE, 0.0), [(0.0, 0.0), (left, 0.0), (left, 0.004), (0.0, 0.004)]),
            finger(
                'right', (BASE, 0.0), [(0.0, -0.004), (right, -0.004), (right, 0.0), (0.0, 0.0)]
            ),
        ),
        leaning_angles(0.0),
        (),
    )


def _problem(
    name: str,
    outline: Polygon,
    fingers: tuple[Finger, ...],
    angles: tuple[float, float],
    palms: Sequence[Polygon],
) -> Problem:
    grasp = Grasp((0.0, 0.0, 0.0), angles)
    return Problem(
        name=name,
        gravity=(0.0, -9.81),
        hand=Hand((TABLE, *palms), fingers),
        object=ManipulatedObject(outline, 0.1),
        friction=0.0,
        start=grasp,
        goal=Goal(grasp.object_pose),
    )


def at(system: ContactSystem, x: float, angles: tuple[float, float]) -> FloatArray:
    """Configuration with the object's frame at (x, 0, 0)."""
    return system.configuration(Grasp((x, 0.0, 0.0), angles))


def x_of(system: ContactSystem, z: FloatArray) -> float:
    """Where the object's frame is, m."""
    return float(system.object_poses(z[None])[0, 0])


def formation(system: ContactSystem, *names: str) -> Formation:
    """A formation by the names of its contacts."""
    return Formation(tuple(sorted(system.pair(parse_contact(name)) for name in names)))


def tracer_of(system: ContactSystem) -> Tracer:
    """A tracer with the frictionless model."""
    return Tracer(system, FrictionlessModel(system.load))


def onwards(heading: FloatArray) -> Steering:
    """Steer along a curve, at first to where a heading points, then always ahead."""

    def steer(_: FloatArray, basis: FloatArray) -> FloatArray:
        nonlocal heading
        heading = np.copysign(1.0, basis[0] @ heading) * basis[0]
        return heading

    return steer
