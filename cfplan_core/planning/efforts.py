"""Whether the joints are strong enough."""

from __future__ import annotations

import numpy as np

from cfplan_core.contact.formation import Formation
from cfplan_core.contact.gaps import gap_gradients
from cfplan_core.contact.system import BoolArray, ContactSystem
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import ContactModel


def within_efforts(
    system: ContactSystem, model: ContactModel, formation: Formation, z: FloatArray
) -> BoolArray:
    """Tell where torques within the joints' effort limits hold the object and the links.

    Args:
        system: Compiled problem. Joints that it holds still have limits as well.
        model: Judges the torques.
        formation: The contacts.
        z: Shape (s, 3 + n).

    Returns:
        Shape (s,).
    """
    whole, z = system.whole, system.expanded(z)
    effort = np.array([joint.effort_limit for joint in whole.problem.hand.joints])
    effort = effort / (whole.force_unit * whole.size)
    weight = whole.link_weight_torques(z)
    gradients = gap_gradients(whole, whole.place(z), formation.array)
    return model.holds_within(gradients, -effort - weight, effort - weight)
