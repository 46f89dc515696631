"""Where contact forces vanish: from three and more contacts onto two of them, and back.

Two of the contacts that touch balance the object where h = det[w_1 w_2 f] = 0: the others carry
nothing. If the two hold the object there to second order, it does not fall when the forces of the
others vanish but settles onto the two, and comes back when one of the gaps closes. Both
formations meet there, and each leads on to its own side: with n_k = w_k·(w_1 × w_2) the other
contacts carry Σ n_k c_k = −h, so that those that are kept need −h n_k > 0 along the motion, and
those that are left g_k > 0.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from cfplan_core.contact.curvature import wrench_rates
from cfplan_core.contact.formation import Formation
from cfplan_core.contact.system import IntArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import Stability
from cfplan_core.mechanics.second_order import imbalance, pair_forces
from cfplan_core.planning.equations import EQUILIBRIUM, equations
from cfplan_core.planning.manifold import formation_equations, tangent_basis
from cfplan_core.planning.pieces import SAME, Piece, Region
from cfplan_core.planning.tracing import STABILITY_MARGIN
from cfplan_core.planning.transitions import Departure, Surroundings

if TYPE_CHECKING:
    from cfplan_core.planning.roadmap import Roadmap

# Forces of others than two contacts, in weights, that count as none where stability ends.
_HARDLY = 1e-4
# How far, in radians and object sizes, they may vanish behind that.
BEHIND = 1e-3
_BALANCED = 1e-8
# Rates of gaps and forces along a motion below this are none.
_RATE = 1e-7
# Distance of places on one border, in radians and object sizes.
_APART = 0.1
_ITERATIONS = 12


class Settling:
    """Transitions between stability of first and of second order in a roadmap."""

    def __init__(self, roadmap: Roadmap) -> None:
        """Start empty."""
        self._roadmap = roadmap
        self._beside: dict[int, list[tuple[FloatArray, Piece]]] = {}
        self._back: dict[int, list[tuple[FloatArray, Piece]]] = {}

    def beside(self, piece: Piece) -> list[tuple[FloatArray, Piece]]:
        """Pieces that a piece meets where contact forces vanish, with where."""
        if not self._roadmap.model.second_order:
            return []
        if piece.index not in self._beside:
            self._beside[piece.index] = []
            for z in self._places(piece):
                for found in self._behind(piece, z):
                    self._beside[piece.index].append((z, found))
                    self._back.setdefault(found.index, []).append((z, piece))
        return [*self._beside[piece.index], *self._back.get(piece.index, ())]

    def drop(self, region: Region, z: FloatArray) -> None:
        """Forget that a region is entered or left at a configuration, shape (3 + n,)."""
        for table in (self._beside, self._back):
            for index, found in table.items():
                table[index] = [
                    (at, piece)
                    for at, piece in found
                    if np.abs(at - z).max() > SAME
                    or (piece is not region and index != region.index)
                ]

    def _places(self, piece: Piece) -> Iterator[FloatArray]:
        """Configurations at the end of a piece where two contacts may balance the object."""
        if isinstance(piece, Region):
            yield from self._on_border(piece)
        if piece.dimension != 1:
            return
        for end, place in zip(piece.ends, (0, -1), strict=True):
            if end is not None:
                yield end.z
            elif piece.stability is not Stability.SECOND_ORDER:
                located = self.locate(piece.formation, piece.points[place])
                if located is not None:
                    # The curve ends there, not by a hair before.
                    points = piece.points.copy()
                    points[place] = located
                    piece.points = points
                    yield located

    def _on_border(self, region: Region) -> Iterator[FloatArray]:
        """Configurations, linked to a region, on its border, some way apart."""
        regions = self._roadmap.regions
        # Looking at what is beyond links the borders.
        regions.beyond(region)
        if region.stability is Stability.SECOND_ORDER:
            places = [z for z, _ in region.links]
        else:
            places = []
            for points in regions.losses(region):
                located = self.locate(region.formation, points[-1])
                if located is not None:
                    region.links.append((located, np.concatenate([points, located[None]])))
                    places.append(located)
        kept: list[FloatArray] = []
        for z in places:
            if all(np.abs(z - other).max() > _APART for other in kept):
                kept.append(z)
                yield z

    def locate(self, formation: Formation, z: FloatArray) -> FloatArray | None:
        """Find where, near the end of its stability, a formation is balanced by two contacts.

        Args:
            formation: Three and more contacts.
            z: Shape (3 + n,), where it just holds the object.

        Returns:
            Shape (3 + n,), or None if stability is lost otherwise.
        """
        tracer = self._roadmap.tracer
        wrenches = tracer.gradients(z[None], formation.array)[0, :, :3]
        for pair in combinations(range(len(formation)), 2):
            forces, rest = pair_forces(wrenches[None, pair], tracer.system.load)
            if rest[0] < _HARDLY * (1.0 + forces.max()) and forces.min() > STABILITY_MARGIN:
                found = self._vanishing(formation, formation.array[list(pair)], z)
                if found is not None and np.abs(found - z).max() < BEHIND:
                    return found
        return None

    def _vanishing(self, formation: Formation, pair: IntArray, z: FloatArray) -> FloatArray | None:
        """Gauss-Newton steps of least norm to where two contacts of a formation balance."""
        system = self._roadmap.system
        balance = np.append(pair, EQUILIBRIUM)
        for _ in range(_ITERATIONS):
            placed = system.place(z[None])
            gaps, slopes = equations(system, placed, formation.array)
            value, slope = equations(system, placed, balance)
            step = np.linalg.lstsq(
                np.concatenate([slopes[0], slope[0, -1:]]),
                np.append(gaps[0], value[0, -1]),
                rcond=1e-9,
            )[0]
            z = z - step
            if np.abs(step).max() < 1e-13:
                return z
        return z if np.abs(step).max() < 1e-10 else None

    def ways(self, z: FloatArray) -> list[Departure]:
        """Formations that lead out of a configuration where two contacts balance the object."""
        around = self._roadmap.junction(z).around
        if around is None or len(around.pairs) < 3:
            return []
        found: list[Departure] = []
        for pair in combinations(range(len(around.pairs)), 2):
            found += self._ways_of(around, pair)
        return found

    def _ways_of(self, around: Surroundings, pair: tuple[int, int]) -> list[Departure]:
        """Ways out of where two of the touching contacts balance the object."""
        system, model = self._roadmap.system, self._roadmap.model
        chosen = list(pair)
        gradients = around.gradients[None, chosen]
        forces, rest = pair_forces(gradients[..., :3], system.load)
        if not rest[0] <= _BALANCED * (1.0 + np.abs(forces).max()):
            return []
        placed = system.place(around.z[None])
        rates = wrench_rates(system, placed, around.pairs[chosen])
        if not model.second_order_margins(gradients, rates).stable[0] > STABILITY_MARGIN:
            return []
        slope = imbalance(gradients[..., :3], rates, system.load)[1][0]
        first, second = gradients[0, :, :3]
        heights = around.gradients[:, :3] @ np.cross(first, second)
        others = [k for k in range(len(around.pairs)) if k not in pair]
        found = []
        for count in range(len(others) + 1):
            for more in combinations(others, count):
                sign = np.sign(heights[list(more)])
                if count and (
                    np.abs(sign.sum()) < count or np.abs(heights[list(more)]).min() < _RATE
                ):
                    continue
                pressing = [-sign[0] * slope] if count else []
                way = self._way(around, sorted([*pair, *more]), pressing)
                if way is not None:
                    found.append(way)
        return found

    def _way(
        self, around: Surroundings, kept: list[int], rising: list[FloatArray]
    ) -> Departure | None:
        """Way into a formation along which gaps open and given slopes rise, if there is one."""
        if around.together[np.ix_(kept, kept)].any():
            return None
        formation = Formation(tuple(int(pair) for pair in around.pairs[kept]))
        _, gradients = formation_equations(self._roadmap.system, formation.array, around.z)
        basis = tangent_basis(gradients)
        if not len(basis):
            return None
        # Where a vertex lies on a vertex the contact that is kept decides how others part.
        beside = np.asarray(around.together[:, kept].any(axis=1))
        left = [k for k in range(len(around.pairs)) if k not in kept and not beside[k]]
        rates = np.abs(around.gradients @ basis.T).max(axis=1)
        opening = [k for k in left if rates[k] >= _RATE]
        # What stays in touch must leave the end of its edge, what is kept must not.
        passing = [k for k in left if rates[k] < _RATE]
        sliding = [k for k in kept if around.at_end[k]]
        rising = [*rising, *around.gradients[opening], *around.inward[sliding]]
        wanted = np.array([*rising, *-around.inward[passing]]) @ basis.T
        if not len(wanted):
            return None
        along = np.linalg.lstsq(wanted, np.ones(len(wanted)), rcond=None)[0]
        if not (wanted @ along > _RATE).all():
            return None
        heading = along @ basis
        return Departure(
            formation,
            heading / np.linalg.norm(heading),
            frozenset(int(pair) for pair in around.pairs[opening]),
        )

    def _behind(self, piece: Piece, z: FloatArray) -> Iterator[Piece]:
        """Pieces that ways out of the end of another lead to."""
        roadmap = self._roadmap
        for way in self.ways(z):
            if way.formation == piece.formation:
                continue
            roadmap.attempts += 1
            rows, _ = formation_equations(roadmap.system, way.formation.array, z)
            if roadmap.system.dof - len(rows) > 1:
                found: Piece | None = roadmap.regions.enter(z, way)
            else:
                found = roadmap.curve_along(z, way)
            if found is not None:
                yield found
