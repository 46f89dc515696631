"""Nested grids over the plane of joint angles; the joints' limits are their outermost lines."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from cfplan_core.contact.system import ContactSystem
from cfplan_core.geometry.polygon import FloatArray

# A node of the finest grid, by the number of its line in each direction.
Place = tuple[int, ...]


@dataclass(frozen=True, eq=False)
class JointGrid:
    """Where the lines of the grids are. Each level's spacing is half of that of the level before.

    Attributes:
        spacing: Largest distance of neighbouring lines of level 0, rad.
        levels: Number of grids.
        axes: For each joint its angles on the finest lines, ascending, from limit to limit.
    """

    spacing: float
    levels: int
    axes: tuple[FloatArray, ...]

    @staticmethod
    def of(system: ContactSystem, spacing: float, levels: int) -> JointGrid:
        """Lay grids over all joint angles within the limits."""
        parts = 2 ** (levels - 1)
        return JointGrid(
            spacing,
            levels,
            tuple(
                np.linspace(low, high, 1 + parts * max(1, int(np.ceil((high - low) / spacing))))
                for low, high in zip(system.lower, system.upper, strict=True)
            ),
        )

    @property
    def finest(self) -> float:
        """Spacing of the last level, rad."""
        return self.spacing / self.stride(0)

    def stride(self, level: int) -> int:
        """Distance of neighbouring lines of a level in lines of the finest."""
        return int(2 ** (self.levels - 1 - level))

    def joints(self, place: Place) -> FloatArray:
        """Joint angles of a node, shape (n,)."""
        return np.array([axis[k] for axis, k in zip(self.axes, place, strict=True)])

    def neighbour(self, place: Place, joint: int, lines: int) -> Place | None:
        """Return the node some lines up or down a joint's axis, None beyond its limit."""
        line = place[joint] + lines
        if not 0 <= line < len(self.axes[joint]):
            return None
        return (*place[:joint], line, *place[joint + 1 :])

    def corners(self, joints: FloatArray, level: int) -> list[Place]:
        """Nodes of a level around the cell of joint angles, shape (n,); the nearest first."""
        stride = self.stride(level)
        lines = []
        for axis, angle in zip(self.axes, joints, strict=True):
            above = int(np.clip(np.searchsorted(axis[::stride], angle), 1, len(axis) // stride))
            lines.append((stride * (above - 1), stride * above))
        return sorted(
            product(*lines),
            key=lambda place: (float(np.abs(self.joints(place) - joints).max()), place),
        )
