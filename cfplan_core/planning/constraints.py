"""What a caller asks of every configuration of a plan, compiled for one problem.

Some of it bounds how far a motion inside a contact formation may go (`Bound`), some refuses
configurations where contacts meet (`Constraints.refusal`). The roadmap asks at both places, so
that no search over it can pass by.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cfplan_core.contact.elements import parse_contact
from cfplan_core.contact.gaps import gap_gradients
from cfplan_core.contact.system import BoolArray, ContactSystem, IntArray
from cfplan_core.errors import Finding
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.bounds import Bound

FORBIDDEN = 'a forbidden contact formation would touch'
CROWDED = 'more contacts than allowed would touch'


@dataclass(frozen=True, eq=False)
class Constraints:
    """Constraints on the way; none by default.

    Attributes:
        bounds: What every configuration must keep.
        max_contacts: Largest number of contacts in any configuration, None for no limit.
        forbidden: Sets of pairs that may not touch all at once.
        required: Sets of pairs of which some configuration of the plan has all.
    """

    bounds: tuple[Bound, ...] = ()
    max_contacts: int | None = None
    forbidden: tuple[frozenset[int], ...] = ()
    required: tuple[frozenset[int], ...] = ()

    def refusal(self, pairs: IntArray, together: BoolArray) -> str | None:
        """Say why a configuration may not be passed through, not even in an instant.

        Args:
            pairs: What touches, shape (k,).
            together: Shape (k, k), true for contacts of the same bodies at one place.
        """
        if self.max_contacts is not None and contact_number(together) > self.max_contacts:
            return CROWDED
        if self.forbidden:
            present = set(pairs.tolist())
            if any(formation <= present for formation in self.forbidden):
                return FORBIDDEN
        return None

    def findings(
        self, system: ContactSystem, z: FloatArray, pairs: IntArray, field: str, file: str
    ) -> list[Finding]:
        """Find out how a grasp contradicts the constraints.

        Args:
            system: Compiled problem.
            z: The grasp, shape (3 + n,), on its contacts.
            pairs: What touches, shape (k,).
            field: Name of the grasp, ``start`` or ``goal``.
            file: Named in findings.
        """
        found = []
        names = ', '.join(system.contact_names(pairs.tolist()))
        if self.max_contacts is not None and len(pairs) > self.max_contacts:
            value = f'{len(pairs)} contacts ({names})'
            found.append(Finding(file, field, value, f'at most {self.max_contacts} contacts'))
        for formation in self.forbidden:
            if formation <= set(pairs.tolist()):
                forbidden = ', '.join(system.contact_names(sorted(formation)))
                value = f'the contacts {names}'
                found.append(Finding(file, field, value, f'not {forbidden}, which is forbidden'))
        gradients = gap_gradients(system, system.place(z[None]), pairs)
        for bound in self.bounds:
            if not bound.margins(z[None], gradients)[0] > 0.0:
                value, expected = bound.finding(z[None], gradients)
                found.append(Finding(file, field, value, expected))
        return found


UNCONSTRAINED = Constraints()


def contact_number(together: BoolArray) -> int:
    """Count contacts; a vertex on a vertex, however many elements meet there, counts as two.

    Args:
        together: Shape (k, k), true for contacts of the same bodies at one place.
    """
    crowded = together.any(axis=1)
    places = np.unique(together[crowded] | np.eye(len(together), dtype=bool)[crowded], axis=0)
    return int((~crowded).sum()) + 2 * len(places)


def formation_pairs(system: ContactSystem, names: Sequence[str]) -> frozenset[int]:
    """Pairs of a contact formation given by the names of its contacts.

    Raises:
        CfplanError: A name is malformed or is of no possible contact.
    """
    return frozenset(system.pair(parse_contact(name)) for name in names)
