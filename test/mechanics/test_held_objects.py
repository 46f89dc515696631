"""Grasps whose forces are known in closed form, from the geometry to the torques."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest
from numpy.typing import NDArray

from cfplan_core.contact.detection import touching
from cfplan_core.contact.gaps import gap_gradients
from cfplan_core.contact.system import ContactSystem
from cfplan_core.errors import JammedError
from cfplan_core.mechanics.contact_model import Margins
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.model import Finger, Goal, Grasp, Hand, Joint, Link, ManipulatedObject, Problem

FloatArray = NDArray[np.float64]
Polygon = Sequence[tuple[float, float]]

TABLE = [(-0.5, -0.1), (0.5, -0.1), (0.5, 0.0), (-0.5, 0.0)]
BLOCK = [(-0.02, 0.0), (0.02, 0.0), (0.02, 0.04), (-0.02, 0.04)]
WEIGHT = 2.0
"""Of every object here, N: 0.2 kg at g = 10 m/s²."""


class Held:
    """A grasp with its contacts and what the model says of it."""

    def __init__(
        self,
        outline: Polygon | FloatArray,
        palms: Sequence[Polygon],
        fingers: Sequence[Finger] = (),
        joints: Sequence[float] = (),
        center_of_mass: tuple[float, float] | None = None,
    ) -> None:
        body = ManipulatedObject(outline, WEIGHT / 10.0, center_of_mass)  # type: ignore[arg-type]
        grasp = Grasp((0.0, 0.0, 0.0), joints)
        hand = Hand(tuple(palms), tuple(fingers))
        problem = Problem('held', (0.0, -10.0), hand, body, 0.0, grasp, Goal(grasp.object_pose))
        self.system = ContactSystem(problem)
        z = self.system.configuration(grasp)
        pairs = touching(self.system, z, 1e-9)
        self.contacts = self.system.contact_names(pairs.tolist())
        self.gradients = gap_gradients(self.system, self.system.place(z[None]), pairs)
        self.model = FrictionlessModel(self.system.load)

    @property
    def margins(self) -> Margins:
        return self.model.margins(self.gradients)

    def torque_limits(self) -> tuple[FloatArray, FloatArray]:
        """In N·m."""
        lower, upper = self.model.torque_limits(self.gradients)
        unit = self.system.force_unit * self.system.size
        return lower[0] * unit, upper[0] * unit

    def force_balance(self, forces: dict[str, float]) -> FloatArray:
        """Wrench of contact forces in N, by contact, together with the weight: N, N, N·m."""
        c = np.array([forces[name] for name in self.contacts])
        wrench = self.gradients[0, :, :3].T @ c + WEIGHT * self.system.load
        return np.asarray(wrench * [1.0, 1.0, self.system.size])


def hinge(name: str, base: tuple[float, float], base_angle: float, *outline: float) -> Finger:
    """A finger of one joint; the outline's coordinates one after the other."""
    vertices = np.reshape(outline, (-1, 2))
    joint = Joint(f'{name}_joint', -4.0, 4.0, 1.0, 5.0)
    link = Link('link', float(vertices.max()), vertices)
    return Finger(name, base, base_angle, (joint,), (link,))


def noses(left: float, right: float) -> list[Finger]:
    """Upright fingers on either side of the block whose noses touch it at these heights, m."""
    return [
        hinge('left', (-0.03, 0.0), math.pi / 2, 0.0, 0.0, left, -0.01, 2.0 * left, 0.0),
        hinge('right', (0.03, 0.0), math.pi / 2, 0.0, 0.0, 2.0 * right, 0.0, right, 0.01),
    ]


def plate(point: FloatArray, normal: FloatArray, half_length: float) -> list[tuple[float, float]]:
    """A palm body whose edge 0 faces along a unit normal."""
    along = half_length * np.array([-normal[1], normal[0]])
    corners = [point - along, point + along]
    corners += [corner - 0.01 * normal for corner in corners[::-1]]
    return [(float(x), float(y)) for x, y in corners]


def test_block_between_two_upright_fingers_needs_force_times_lever() -> None:
    """Tips at heights 0.03 and 0.01 m press a block, 0.04 m wide and 2 N heavy, on a table.

    Both press with s. Their couple s (0.03 - 0.01) shifts the table's support from the left to
    the right lower corner, which carries all when s · 0.02 m = 2 N · 0.02 m: s is 0 to 2 N. The
    torques are s times the levers, clockwise on the left: 0 to -0.06 and 0 to 0.02 N·m.
    """
    held = Held(BLOCK, [TABLE], noses(0.03, 0.01), (0.0, 0.0))
    assert held.contacts == (
        'object.v0|palm.0.e2',
        'object.v1|palm.0.e2',
        'object.e3|left.link.v1',
        'object.e1|right.link.v2',
    )
    np.testing.assert_allclose(held.torque_limits(), [[-0.06, 0.0], [0.0, 0.02]], atol=1e-12)


def test_block_between_two_upright_fingers_is_in_force_closure() -> None:
    margins = Held(BLOCK, [TABLE], noses(0.03, 0.01), (0.0, 0.0)).margins
    assert margins.stable[0] > 0.1
    assert margins.form_closure[0] < 0.0


def test_fingers_at_one_height_may_press_without_bound() -> None:
    """They cancel, whatever the table does: 0 to minus and plus infinity."""
    held = Held(BLOCK, [TABLE], noses(0.02, 0.02), (0.0, 0.0))
    np.testing.assert_array_equal(held.torque_limits(), [[-math.inf, 0.0], [0.0, math.inf]])


def test_block_goes_with_two_fingers_that_go_the_same_way() -> None:
    """Tips at heights 0.03 and 0.01 m, both at 0.06 m/s to the right: -2 and -6 rad/s."""
    held = Held(BLOCK, [TABLE], noses(0.03, 0.01), (0.0, 0.0))
    motion = held.model.motion(held.gradients[0], np.array([-2.0, -6.0]))
    velocity = motion.object_velocity * [held.system.size, held.system.size, 1.0]
    np.testing.assert_allclose(velocity, [0.06, 0.0, 0.0], atol=1e-12)
    np.testing.assert_array_equal(motion.gap_rates, 0.0)
    assert motion.unique


def test_block_between_two_fingers_that_close_tips() -> None:
    """The left tip stands still at 0.03 m, the right one at 0.01 m comes 0.02 m/s to the left.

    The block turns clockwise about its lower right corner, which stays on the table: with ω
    upward at the tips' heights, u - 0.03 ω = 0 and u - 0.01 ω = -0.02 m/s, so that ω = -1 rad/s,
    u = -0.03 m/s at the table; the left corner rises at 0.04 m/s, the middle at 0.02 m/s.
    """
    held = Held(BLOCK, [TABLE], noses(0.03, 0.01), (0.0, 0.0))
    motion = held.model.motion(held.gradients[0], np.array([0.0, 2.0]))
    velocity = motion.object_velocity * [held.system.size, held.system.size, 1.0]
    # The centre of mass is 0.02 m above the table: its speed is -0.03 + 0.02 · 1 m/s.
    np.testing.assert_allclose(velocity, [-0.01, 0.02, -1.0], atol=1e-12)
    rates = motion.gap_rates * held.system.size
    np.testing.assert_allclose(rates, [0.04, 0.0, 0.0, 0.0], atol=1e-12)
    assert motion.unique


def test_block_against_a_wall_jams_a_finger_that_pushes_it() -> None:
    """Wall on the left, table below, a fingertip that comes from the right."""
    wall = [(-0.05, 0.0), (-0.02, 0.0), (-0.02, 0.035), (-0.05, 0.035)]
    held = Held(BLOCK, [TABLE, wall], noses(0.03, 0.01)[1:], (0.0,))
    with pytest.raises(JammedError, match='the grasp jams'):
        held.model.motion(held.gradients[0], np.array([0.1]))


def test_block_against_a_wall_lets_a_finger_go() -> None:
    """As it was, but the tip leaves at 0.001 m/s: the block may follow it, or stay."""
    wall = [(-0.05, 0.0), (-0.02, 0.0), (-0.02, 0.035), (-0.05, 0.035)]
    held = Held(BLOCK, [TABLE, wall], noses(0.03, 0.01)[1:], (0.0,))
    motion = held.model.motion(held.gradients[0], np.array([-0.1]))
    assert 0.0 <= motion.object_velocity[0] * held.system.size <= 0.001 + 1e-12
    assert not motion.unique


def test_wedge_on_a_wall_needs_its_weight_times_the_lever() -> None:
    """A tip holds a 2 N wedge, left side on a wall, by its lower face that climbs at 3-4-5.

    The tip's force N is normal to the face, (-0.6, 0.8) N: 0.8 N carries the weight, so that
    N = 2.5 N and the wall takes 1.5 N. The lines of force and weight meet at height 0.0478 m, on
    the wall. The tip lies 0.05 m left of its joint and carries 2 N there: -0.1 N·m.
    """
    wedge = [(0.0, 0.0), (0.08, 0.06), (0.0, 0.1)]
    wall = [(-0.05, -0.2), (0.0, -0.2), (0.0, 0.2), (-0.05, 0.2)]
    tip = hinge('tip', (0.09, 0.03), math.pi, 0.0, -0.002, 0.05, 0.0, 0.0, 0.002)
    held = Held(wedge, [wall], [tip], (0.0,))
    assert set(held.contacts) == {
        'object.v0|palm.0.e1',
        'object.v2|palm.0.e1',
        'object.e0|tip.link.v1',
    }
    np.testing.assert_allclose(held.torque_limits(), [[-0.1], [-0.1]])
    assert held.margins.stable[0] > 0.0
    # The resultant at (0.04 - 0.6 k, 0.03 + 0.8 k), k = 1/45 m: on the wall between 0 and 0.1 m.
    upper = 1.5 * (0.03 + 0.8 / 45.0) / 0.1
    forces = {
        'object.v0|palm.0.e1': 1.5 - upper,
        'object.v2|palm.0.e1': upper,
        'object.e0|tip.link.v1': 2.5,
    }
    np.testing.assert_allclose(held.force_balance(forces), 0.0, atol=1e-12)


RADIUS = 0.03
APOTHEM = RADIUS * math.cos(math.pi / 24)
SIDE = 2.0 * RADIUS * math.sin(math.pi / 24)


def ball() -> FloatArray:
    """A regular 24-gon with an edge across every multiple of 15°."""
    angles = (np.arange(24) + 0.5) * math.pi / 12
    return RADIUS * np.column_stack([np.cos(angles), np.sin(angles)])


@pytest.mark.parametrize('degrees', [30, 45, 60])
def test_ball_in_a_groove_is_carried_by_half_its_weight_over_the_cosine(degrees: int) -> None:
    """Both flanks slope by α: 2 N cos α = 2 N weight, shared by the two ends of a flush edge."""
    alpha = math.radians(degrees)
    normals = [np.array([s * math.sin(alpha), math.cos(alpha)]) for s in (1.0, -1.0)]
    held = Held(ball(), [plate(-APOTHEM * n, n, 0.02) for n in normals])
    assert len(held.contacts) == 4
    flank = WEIGHT / (2.0 * math.cos(alpha))
    balance = held.force_balance(dict.fromkeys(held.contacts, flank / 2.0))
    np.testing.assert_allclose(balance, 0.0, atol=1e-12)
    assert held.margins.stable[0] > 0.0
    assert held.margins.form_closure[0] < 0.0


@pytest.mark.parametrize('degrees', [30, 45, 60])
def test_finger_as_flank_of_a_groove_needs_the_flank_force_times_lever(degrees: int) -> None:
    """The right flank is a link; the ball's edge lies flush on it, its middle 0.04 m out.

    The flank carries N = 1 N / cos α. It may act anywhere on the edge, as the other flank may
    lean against it the other way round: levers 0.04 m minus and plus half a side.
    """
    alpha = math.radians(degrees)
    left, right = (np.array([s * math.sin(alpha), math.cos(alpha)]) for s in (1.0, -1.0))
    up_the_slope = np.array([math.cos(alpha), math.sin(alpha)])
    base = -APOTHEM * right - 0.04 * up_the_slope
    bar = (0.0, -0.01, 0.08, -0.01, 0.08, 0.0, 0.0, 0.0)
    flank = hinge('flank', (float(base[0]), float(base[1])), alpha, *bar)
    held = Held(ball(), [plate(-APOTHEM * left, left, 0.005)], [flank], (0.0,))
    assert len(held.contacts) == 4
    force = WEIGHT / (2.0 * math.cos(alpha))
    lower, upper = held.torque_limits()
    np.testing.assert_allclose(lower, [force * (0.04 - SIDE / 2.0)])
    np.testing.assert_allclose(upper, [force * (0.04 + SIDE / 2.0)])


def test_object_on_the_palm_alone_is_neutral() -> None:
    """It may slide without cost: forces balance, but do not span."""
    held = Held(BLOCK, [TABLE])
    balance = held.force_balance({'object.v0|palm.0.e2': 1.0, 'object.v1|palm.0.e2': 1.0})
    np.testing.assert_allclose(balance, 0.0, atol=1e-12)
    assert not held.margins.stable[0] > 0.0


def test_redundant_supports_are_as_neutral() -> None:
    """Four feet on one table."""
    feet = [
        (-0.02, 0.0),
        (-0.015, 0.0),
        (0.0, 0.01),
        (0.015, 0.0),
        (0.02, 0.0),
        (0.02, 0.03),
        (-0.02, 0.03),
    ]
    held = Held(feet, [TABLE])
    assert len(held.contacts) == 4
    assert abs(held.margins.stable[0]) < 1e-12


def test_block_that_overhangs_its_support_falls() -> None:
    """The centre of mass is 0.03 m to the right of the right foot, though a finger is there."""
    held = Held(BLOCK, [TABLE], noses(0.03, 0.01)[1:], (0.0,), center_of_mass=(0.05, 0.02))
    assert held.margins.stable[0] < 0.0
    assert np.isnan(held.torque_limits()).all()


def test_trapezoid_under_two_inward_tips_is_in_form_closure() -> None:
    """Sides lean inward at 45°: both tips press the foot onto the table, against each other.

    At heights h, h their lines meet the middle line; any squeeze is taken by the table and none
    is needed: torques 0 to minus and plus infinity.
    """
    trapezoid = [(-0.03, 0.0), (0.03, 0.0), (0.01, 0.02), (-0.01, 0.02)]
    tips = [
        hinge('left', (-0.04, 0.0), math.pi / 2, 0.0, 0.0, 0.01, -0.02, 0.02, 0.0),
        hinge('right', (0.04, 0.0), math.pi / 2, 0.0, 0.0, 0.02, 0.0, 0.01, 0.02),
    ]
    held = Held(trapezoid, [TABLE], tips, (0.0, 0.0))
    assert held.margins.form_closure[0] > 0.0
    np.testing.assert_array_equal(held.torque_limits(), [[-math.inf, 0.0], [0.0, math.inf]])
