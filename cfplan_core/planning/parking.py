"""Where free fingers are out of the way: postures far from where the object may pass."""

from __future__ import annotations

import numpy as np

from cfplan_core.contact.system import BoolArray, ContactSystem, IntArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.clearance import Clearance

_DRAWN = 300
_POSES = 5
# Nothing is gained by staying farther away than this, in object sizes.
_FAR = 0.5
# Postures of one finger differ by at least this much, in rad.
_DIFFERENT = 0.7


def parked_postures(
    system: ContactSystem,
    joints: IntArray,
    begin: FloatArray,
    end: FloatArray,
    count: int,
    rng: np.random.Generator,
) -> FloatArray:
    """Draw postures of a finger that are far from the object and from the palm.

    Args:
        system: Compiled problem.
        joints: Indices of the finger's joints.
        begin: Configuration that the object begins in, shape (3 + n,).
        end: Configuration that it ends in, shape (3 + n,).
        count: How many postures.
        rng: To draw from.

    Returns:
        Angles of the finger's joints, shape (c, j), c ≤ count, those farthest away first.
    """
    clearance = Clearance(system, joints)
    moved: BoolArray = np.asarray(system.moves[:, joints].any(axis=1))
    last = 1 + len(system.problem.hand.palm)
    # Other fingers stand where they stand: the object and the palm alone count.
    fixed = ~moved & (np.arange(len(moved)) < last)
    counts = (fixed[clearance.bodies] | moved[clearance.bodies]).all(axis=1)
    angles = rng.uniform(system.lower[joints], system.upper[joints], (_DRAWN, len(joints)))
    places = np.linspace(0.0, 1.0, _POSES)
    far = np.full(_DRAWN, _FAR)
    for place in places:
        z = np.tile(begin + place * (end - begin), (_DRAWN, 1))
        z[:, 3 + joints] = angles
        far = np.minimum(far, clearance.distances(z)[:, counts].min(axis=1))
    chosen: list[int] = []
    for index in np.argsort(-far, kind='stable'):
        if len(chosen) == count or far[index] <= 0.0:
            break
        apart = np.abs(angles[chosen] - angles[index]).max(axis=1)
        if (apart > _DIFFERENT).all():
            chosen.append(int(index))
    return np.asarray(angles[chosen])
