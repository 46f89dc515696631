"""What a caller asks of every configuration of a plan, compiled for one problem.

Some of it bounds how far a motion inside a contact formation may go (`Bound`), some refuses
configurations where contacts meet (`Constraints.refusal`). The roadmap asks at both places, so
that no search over it can pass by.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np

from cfplan_core.contact.elements import parse_contact
from cfplan_core.contact.gaps import gap_gradients
from cfplan_core.contact.system import BoolArray, ContactSystem, IntArray
from cfplan_core.errors import CfplanError, Finding
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.mechanics.contact_model import ContactModel
from cfplan_core.model import Goal
from cfplan_core.options import PlanOptions
from cfplan_core.planning.bounds import NEEDED_FORCE, OUTSIDE, Bound, NeededForceBound, RegionBound
from cfplan_core.planning.grasp_check import ExaminedProblem

_FILE = '<problem>'
# Angles that differ by less, in rad, are the same but for rounding.
_HELD = 1e-6
FORBIDDEN = 'a forbidden contact formation would touch'
CROWDED = 'more contacts than allowed would touch'
REASONS = (NEEDED_FORCE, OUTSIDE, FORBIDDEN, CROWDED)


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

    @property
    def none(self) -> bool:
        """True if nothing is constrained."""
        return self.max_contacts is None and not (self.bounds or self.forbidden or self.required)

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


def formation_pairs(system: ContactSystem, field: str, names: Sequence[str]) -> frozenset[int]:
    """Pairs of a contact formation given by the names of its contacts.

    Raises:
        CfplanError: A name is malformed or is of no possible contact.
    """
    try:
        return frozenset(system.pair(parse_contact(name)) for name in names)
    except CfplanError as error:
        raise CfplanError(f'{field}: {error}') from None


def compile_constraints(
    system: ContactSystem, model: ContactModel, options: PlanOptions
) -> Constraints:
    """Compile what options ask of every configuration.

    Raises:
        CfplanError: An option names a contact or a joint that the problem does not have.
    """
    for name in options.held_joints:
        if name not in system.joint_names:
            known = ', '.join(system.joint_names)
            raise CfplanError(f'held_joints: got {name!r}, expected names of {known}')
    bounds: list[Bound] = []
    if options.max_needed_force is not None:
        bounds.append(NeededForceBound(model, options.max_needed_force))
    if options.stay_within is not None:
        bounds.append(RegionBound(system, np.array(options.stay_within, dtype=float)))
    return Constraints(
        tuple(bounds),
        options.max_contacts,
        tuple(formation_pairs(system, 'forbidden', names) for names in options.forbidden),
        tuple(formation_pairs(system, 'required', names) for names in options.required),
    )


def contradictions(
    constraints: Constraints,
    system: ContactSystem,
    examined: ExaminedProblem,
    goal: Goal,
    held: Collection[str],
) -> tuple[Finding, ...]:
    """Find out how start and goal contradict what is asked.

    Args:
        constraints: Compiled.
        system: With all joints.
        examined: Start and goal.
        goal: As the problem gives it.
        held: Names of joints that do not move.
    """
    findings = []
    for field, grasp in (('start', examined.start), ('goal', examined.goal)):
        if grasp is not None:
            findings += constraints.findings(system, grasp.z, grasp.pairs, field, _FILE)
    # A grasp is meant as it is, anything else within its tolerance.
    slack = _HELD if examined.goal is not None else max(_HELD, goal.tolerance.joints)
    for name in held:
        angle = float(examined.start.z[3 + system.joint_names.index(name)])
        wanted = (goal.joints or {}).get(name, angle)
        if abs(wanted - angle) > slack:
            value = f'{wanted:.9g} rad of a joint that is held'
            findings.append(
                Finding(_FILE, f'goal.joints.{name}', value, f'{angle:.9g} rad, as at the start')
            )
    moving = set(goal.joints or ()) - set(held)
    free = goal.object_position is None and goal.object_angle is None and not goal.contacts
    if held and free and not moving:
        value = 'only angles of joints that are held'
        expected = 'an object position or angle, contacts, or a joint that moves'
        findings.append(Finding(_FILE, 'goal', value, expected))
    if examined.goal is None:
        findings += _contradicted_contacts(constraints, system, goal.contacts or ())
    return tuple(findings)


def _contradicted_contacts(
    constraints: Constraints, system: ContactSystem, names: Sequence[str]
) -> list[Finding]:
    """Find out how the contacts of a goal in part contradict what is asked."""
    try:
        pairs = sorted(formation_pairs(system, 'goal.contacts', names))
    except CfplanError:
        return []
    found = []
    # A vertex on a vertex counts as two, however many elements of theirs meet.
    least = len(set(system.pair_vertex[pairs].tolist()))
    if constraints.max_contacts is not None and least > constraints.max_contacts:
        expected = f'at most {constraints.max_contacts} contacts'
        found.append(Finding(_FILE, 'goal.contacts', f'{least} contacts', expected))
    for formation in constraints.forbidden:
        if formation <= set(pairs):
            forbidden = ', '.join(system.contact_names(sorted(formation)))
            expected = f'not {forbidden}, which is forbidden'
            found.append(Finding(_FILE, 'goal.contacts', ', '.join(names), expected))
    return found
