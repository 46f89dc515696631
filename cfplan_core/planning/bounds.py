"""What a motion must keep besides its stability: functions of the configuration above zero.

A bound ends curves and rays where it is reached, just as lost stability does, and the place is
located the same way.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from cfplan_core.contact.system import ContactSystem, as_complex
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import ContactModel

OUTSIDE = 'the object would leave its region'
NEEDED_FORCE = 'contacts would need more than the largest force'

# An object that touches a side of its region, as on the palm, is inside; in object sizes.
_BORDER = 1e-6


class Bound(Protocol):
    """A limit on configurations."""

    @property
    def reason(self) -> str:
        """Says, for reports, what would happen beyond."""

    def margins(self, z: FloatArray, gradients: FloatArray) -> FloatArray:
        """How far configurations are from the bound.

        Args:
            z: Shape (s, 3 + n).
            gradients: Shape (s, k, 3 + n), of the gaps of the contacts that are kept there.

        Returns:
            Shape (s,), positive inside, continuous.
        """

    def finding(self, z: FloatArray, gradients: FloatArray) -> tuple[str, str]:
        """Say what a grasp beyond the bound has, and what was expected.

        Args:
            z: Shape (1, 3 + n).
            gradients: Shape (1, k, 3 + n).
        """


class RegionBound:
    """The object stays inside a convex polygon."""

    def __init__(self, system: ContactSystem, polygon: FloatArray) -> None:
        """Bound where the object is.

        Args:
            system: Compiled problem.
            polygon: Shape (k, 2), m, convex, counter-clockwise.
        """
        body = system.problem.object
        self._outline = as_complex(body.vertices - body.center_of_mass) / system.size
        corners = as_complex(polygon) / system.size
        edges = np.roll(corners, -1) - corners
        # i times an edge points inside.
        self._inward = (1j * edges / np.abs(edges)).conj()
        self._corners = corners
        self._size = system.size
        self.reason = OUTSIDE

    def margins(self, z: FloatArray, gradients: FloatArray) -> FloatArray:
        """Distance of the object from the nearest side, a hair more, in object sizes; (s,)."""
        center = z[:, 0] + 1j * z[:, 1]
        points = center[:, None] + np.exp(1j * z[:, 2:3]) * self._outline
        inside = (self._inward * (points[..., None] - self._corners)).real
        return np.asarray(inside.min(axis=(1, 2)) + _BORDER)

    def finding(self, z: FloatArray, gradients: FloatArray) -> tuple[str, str]:
        """Say how far a grasp's object is outside."""
        out = (_BORDER - float(self.margins(z, gradients)[0])) * self._size
        return f'an object {out:.3g} m outside the region', 'an object inside it'


class NeededForceBound:
    """No contact needs to press harder than so many weights of the object."""

    def __init__(self, model: ContactModel, largest: float) -> None:
        """Bound the needed force.

        Args:
            model: Knows the needed force.
            largest: Above zero, in weights.
        """
        self._model = model
        self._largest = largest
        self.reason = NEEDED_FORCE

    def margins(self, z: FloatArray, gradients: FloatArray) -> FloatArray:
        """What part of the largest force is left; shape (s,)."""
        needed = self._model.needed_forces(gradients) / self._largest
        return np.asarray(np.maximum(1.0 - needed, -1.0))

    def finding(self, z: FloatArray, gradients: FloatArray) -> tuple[str, str]:
        """Compare a grasp's needed force with the largest allowed."""
        needed = float(self._model.needed_forces(gradients)[0])
        return f'a needed force of {needed:.4g} weights', f'less than {self._largest:g}'
