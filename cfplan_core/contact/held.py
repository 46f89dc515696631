"""A contact system some of whose joints are held still: the same geometry, fewer coordinates."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from cfplan_core.contact.system import ContactSystem, Placement
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.model import Grasp


class HeldSystem(ContactSystem):
    """A system in which z has the joints that move alone.

    Contact formations have as many dimensions less as joints are held, so that what is a region
    of the whole system may be a curve here, and a curve a point.
    """

    def __init__(self, whole: ContactSystem, held: Collection[str], z: FloatArray) -> None:
        """Hold some joints.

        Args:
            whole: With all joints.
            held: Their names.
            z: Configuration of the whole system, shape (3 + n,): where they are held.
        """
        super().__init__(whole.problem)
        self._whole = whole
        free = [k for k, name in enumerate(whole.joint_names) if name not in held]
        self._columns = np.array([0, 1, 2, *(3 + k for k in free)], dtype=np.intp)
        self._template = z.copy()
        self.joint_names = tuple(whole.joint_names[k] for k in free)
        self.joint_count = len(free)
        self.dof = 3 + self.joint_count
        self.lower, self.upper = whole.lower[free], whole.upper[free]
        self.moves = whole.moves[:, free]
        self.pair_moves = whole.pair_moves[:, free]

    @property
    def whole(self) -> ContactSystem:
        """The system with all joints."""
        return self._whole

    def reduced(self, z: FloatArray) -> FloatArray:
        """Leave out the held joints of a configuration of the whole system."""
        return np.asarray(z[..., self._columns])

    def expanded(self, z: FloatArray) -> FloatArray:
        """Put the held joints into configurations of shape (s, 3 + n)."""
        whole = np.tile(self._template, (len(z), 1))
        whole[:, self._columns] = z
        return whole

    def configuration(self, grasp: Grasp) -> FloatArray:
        """Turn a grasp into z; the held joints' angles are not looked at."""
        return self.reduced(self._whole.configuration(grasp))

    def place(self, z: FloatArray) -> Placement:
        """World positions of all features, and of the axes of the joints that move."""
        placed = self._whole.place(self.expanded(z))
        return placed._replace(axes=placed.axes[:, self._columns[3:] - 3])

    def link_weight_torques(self, z: FloatArray) -> FloatArray:
        """Torques that hold the links' weight at the joints that move."""
        torques = self._whole.link_weight_torques(self.expanded(z))
        return np.asarray(torques[:, self._columns[3:] - 3])
