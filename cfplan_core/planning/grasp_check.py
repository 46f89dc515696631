"""Whether the start and the goal of a problem are grasps that a plan may have."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np

from cfplan_core.contact.detection import coincident, touching
from cfplan_core.contact.gaps import gap_gradients, gaps
from cfplan_core.contact.system import ContactSystem, IntArray
from cfplan_core.errors import Finding
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.geometry.separation import penetration_depth
from cfplan_core.mechanics.contact_model import ContactModel, Stability
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.model import Goal, Grasp, Problem
from cfplan_core.planning.equations import formation_rows, is_second_order
from cfplan_core.planning.manifold import independent_rows, settle
from cfplan_core.planning.tracing import classify, stability_margins

# Numbers in files are rounded: nearer than this, in m, is touching (cfplan/problem/1).
TOUCHING = 1e-6
_ROUNDING = 1e-9
# Gaps up to this part of the object's size are named when a grasp is not stable.
_NEAR = 0.05
# Gaps up to this part of it are closed in the grasp that is proposed instead.
_CLOSE = 0.02


@dataclass(frozen=True)
class GraspDescription:
    """What a grasp is.

    Attributes:
        contacts: Names of the elemental contacts that touch.
        stability: ``form_closure``, ``force_closure``, ``second_order`` or ``unstable``.
        dimension: Dimension of the contact formation's piece of configuration space; of second
            order that of its equilibria.
    """

    contacts: tuple[str, ...]
    stability: str
    dimension: int


@dataclass(frozen=True, eq=False)
class ExaminedGrasp:
    """A grasp with its contacts made exact.

    Attributes:
        z: Shape (3 + n,), on the contacts.
        pairs: Touching contacts, shape (k,).
        stability: Of the formation.
        dimension: Of the formation's piece.
        findings: What is wrong with it.
    """

    z: FloatArray
    pairs: IntArray
    stability: Stability
    dimension: int
    findings: tuple[Finding, ...]


@dataclass(frozen=True, eq=False)
class ExaminedProblem:
    """Start and goal of a problem, and all that is wrong with them.

    Attributes:
        start: The start grasp.
        goal: The goal grasp, None if the goal gives less than a whole grasp or, with a wide
            tolerance, configurations around one that is none.
        findings: Of both, and of the problem itself.
    """

    start: ExaminedGrasp
    goal: ExaminedGrasp | None
    findings: tuple[Finding, ...]


def describe_grasp(problem: Problem, grasp: Grasp) -> GraspDescription:
    """Name a grasp's contacts, stability class and dimension."""
    system = ContactSystem(problem)
    examined = examine_grasp(system, FrictionlessModel(system.load), grasp, '', '')
    return GraspDescription(
        system.contact_names([int(pair) for pair in examined.pairs]),
        examined.stability.value,
        examined.dimension,
    )


def check_problem(problem: Problem, file: str = '<problem>') -> tuple[Finding, ...]:
    """Find what keeps a well-formed problem from being planned.

    Args:
        problem: As loaded.
        file: Named in the findings.

    Returns:
        Findings on start and goal: links or object that overlap, contacts that do not touch, an
        unstable grasp, friction that no contact model takes.
    """
    system = ContactSystem(problem)
    return examine_problem(system, FrictionlessModel(system.load), file).findings


def examine_problem(
    system: ContactSystem, model: ContactModel, file: str = '<problem>'
) -> ExaminedProblem:
    """Examine start and goal; see `check_problem`."""
    problem = system.problem
    findings = []
    if problem.friction > 0.0:
        findings.append(
            Finding(
                file, 'contact.friction', f'{problem.friction:g}', '0.0: contacts without friction'
            )
        )
    start = examine_grasp(system, model, problem.start, 'start', file)
    findings += start.findings
    goal = None
    whole = problem.goal.grasp(problem.hand)
    if whole is not None:
        goal = examine_grasp(system, model, whole, 'goal', file)
        wrong = [*goal.findings, *_other_contacts(system, goal, problem.goal, file)]
        if not problem.goal.tolerance.wide:
            findings += wrong
        elif wrong:
            # Not this grasp is wanted, but one that is near.
            goal = None
    if goal is None:
        findings += _goal_joint_limits(problem, file)
    return ExaminedProblem(start, goal, tuple(findings))


def examine_grasp(
    system: ContactSystem, model: ContactModel, grasp: Grasp, field: str, file: str
) -> ExaminedGrasp:
    """Detect a grasp's contacts, make them exact and judge the grasp.

    Args:
        system: Compiled problem.
        model: Judges stability.
        grasp: What to examine.
        field: Name of the grasp in findings, ``start`` or ``goal``.
        file: Named in findings.
    """
    z = system.configuration(grasp)
    if not np.isfinite(z).all():
        found = Finding(file, field, 'a number that is not finite', 'finite m and rad')
        nothing = np.empty(0, dtype=np.intp)
        return ExaminedGrasp(z, nothing, Stability.UNSTABLE, system.dof, (found,))
    findings = _joint_limits(system.problem, grasp, field, file)
    findings += _overlaps(system.problem, grasp, field, file)
    pairs = touching(system, z, TOUCHING / system.size)
    dimension, stability = system.dof, Stability.UNSTABLE
    if len(pairs):
        z = _settled(system, z, pairs)
        gradients = gap_gradients(system, system.place(z[None]), pairs)
        margins = stability_margins(system, model, z[None], gradients, pairs)
        stability = classify(margins)
        dimension -= len(independent_rows(gradients[0])) + (stability is Stability.SECOND_ORDER)
    together = coincident(system, z, pairs, TOUCHING / system.size)
    names = system.contact_names([int(pair) for pair in pairs])
    if not len(pairs):
        findings.append(
            Finding(
                file,
                field,
                f'no contact{_near_misses(system, z, pairs)}',
                f'contacts within {TOUCHING:g} m that hold the object',
            )
        )
    elif together.any():
        i, j = (int(k) for k in np.argwhere(together)[0])
        findings.append(
            Finding(
                file,
                field,
                f'a vertex on a vertex ({names[i]} and {names[j]} at one place)',
                'vertices on the inside of edges: a vertex cannot be held on a vertex',
            )
        )
    elif is_second_order(pairs) and not model.second_order and not findings:
        findings.append(
            Finding(
                file,
                field,
                f'only the contacts {" and ".join(names)}, and stability of second order does not '
                'count',
                'at least three contacts',
            )
        )
    elif stability is Stability.UNSTABLE and not findings:
        margin = float(margins.stable[0])
        findings.append(
            Finding(
                file,
                field,
                f'an unstable grasp, contacts {", ".join(names)} '
                f'(stability margin {margin:.3g}){_near_misses(system, z, pairs)}',
                'contacts whose forces, all positive, balance the weight (margin above zero)',
            )
        )
    elif stability is not Stability.UNSTABLE:
        findings += _efforts(system, model, z, gradients, field, file)
    return ExaminedGrasp(z, pairs, stability, dimension, tuple(findings))


def _settled(system: ContactSystem, z: FloatArray, pairs: IntArray) -> FloatArray:
    """Move a grasp the least way onto its contacts; two of them into balance if that is near."""
    touching_exactly = settle(system, z, pairs)
    if not is_second_order(pairs):
        return touching_exactly
    balanced = settle(system, z, formation_rows(pairs))
    near = np.abs(balanced - z).max() <= TOUCHING / system.size
    return balanced if near else touching_exactly


def _efforts(
    system: ContactSystem,
    model: ContactModel,
    z: FloatArray,
    gradients: FloatArray,
    field: str,
    file: str,
) -> list[Finding]:
    """Find out whether the joints are too weak for a stable grasp."""
    unit = system.force_unit * system.size
    effort = np.array([joint.effort_limit for joint in system.problem.hand.joints])
    weight = system.link_weight_torques(z[None])
    if model.holds_within(gradients, -effort / unit - weight, effort / unit - weight).all():
        return []
    lower, upper = ((limit + weight)[0] * unit for limit in model.torque_limits(gradients))
    needed = ', '.join(
        f'{joint.name} from {low:.3g} to {high:.3g} N·m'
        for joint, low, high in zip(system.problem.hand.joints, lower, upper, strict=True)
    )
    return [
        Finding(
            file,
            field,
            f'a grasp that takes torques of {needed}',
            f'torques within the effort limits {", ".join(f"{e:g}" for e in effort)} N·m',
        )
    ]


def _near_misses(system: ContactSystem, z: FloatArray, pairs: IntArray) -> str:
    """Name the contacts that nearly touch."""
    everything = np.arange(system.contact_count)
    gap, offset = (values[0] for values in gaps(system, system.place(z[None]), everything))
    near = (
        (gap > 0.0) & (gap < _NEAR) & (offset >= 0.0) & (offset <= system.pair_length[everything])
    )
    near[pairs] = False
    missed = sorted(np.flatnonzero(near), key=lambda pair: gap[pair])[:4]
    if not missed:
        return ''
    named = (f'{system.contact(int(p))} is {gap[p] * system.size:.3g} m apart' for p in missed)
    return '; ' + ', '.join(named) + _remedy(system, z)


def _remedy(system: ContactSystem, z: FloatArray) -> str:
    """Say which grasp near by touches with all contacts that nearly do, if there is one."""
    pairs = touching(system, z, _CLOSE)
    settled = settle(system, z, pairs)
    exact = TOUCHING / system.size
    meant = set(pairs.tolist()) <= set(touching(system, settled, exact).tolist())
    if not meant or coincident(system, settled, pairs, exact).any():
        return ''
    pose = ', '.join(f'{value:.9f}' for value in _rounded(system.object_poses(settled[None])[0]))
    joints = ', '.join(f'{value:.9f}' for value in _rounded(settled[3:]))
    return f' (all {len(pairs)} near by touch at object_pose [{pose}], joints [{joints}])'


def _rounded(values: FloatArray) -> FloatArray:
    """Nine decimals, and no minus before a zero."""
    return np.asarray(np.round(values, 9) + 0.0)


def _joint_limits(problem: Problem, grasp: Grasp, field: str, file: str) -> list[Finding]:
    """Find joints outside their limits by more than rounding."""
    return [
        Finding(
            file,
            f'{field}.joints.{joint.name}',
            f'{angle:.9g} rad',
            f'an angle from {joint.lower:.9g} to {joint.upper:.9g} rad',
        )
        for joint, angle in zip(problem.hand.joints, grasp.joints, strict=True)
        if not joint.lower - _ROUNDING <= angle <= joint.upper + _ROUNDING
    ]


def _overlaps(problem: Problem, grasp: Grasp, field: str, file: str) -> list[Finding]:
    """Find bodies that reach into each other."""
    bodies = problem.hand.world_vertices(grasp.joints)
    body = problem.object.world_vertices(grasp.object_pose)
    findings = []
    for name, vertices in bodies.items():
        depth = penetration_depth(body, vertices)
        if depth > TOUCHING:
            findings.append(
                Finding(
                    file,
                    f'{field}.object_pose',
                    f'the object {depth:.3g} m deep in {name}',
                    f'at most {TOUCHING:g} m',
                )
            )
    for first, second in separate_bodies(problem):
        depth = penetration_depth(bodies[first], bodies[second])
        if depth > TOUCHING:
            findings.append(
                Finding(
                    file,
                    f'{field}.joints',
                    f'{first} and {second} overlapping by {depth:.3g} m',
                    f'at most {TOUCHING:g} m',
                )
            )
    return findings


def separate_bodies(problem: Problem) -> list[tuple[str, str]]:
    """Pairs of hand bodies that may not overlap: not a first link and the palm, nor neighbours."""
    palm = [f'palm.{k}' for k in range(len(problem.hand.palm))]
    chains = [
        [f'{finger.name}.{link.name}' for link in finger.links] for finger in problem.hand.fingers
    ]
    pairs = [(body, link) for chain in chains for link in chain[1:] for body in palm]
    for chain in chains:
        pairs += [(a, b) for i, a in enumerate(chain) for b in chain[i + 2 :]]
    for one, other in combinations(chains, 2):
        pairs += [(a, b) for a in one for b in other]
    return pairs


def _goal_joint_limits(problem: Problem, file: str) -> list[Finding]:
    """Find joints that the tolerance does not bring within their limits."""
    goal = problem.goal
    slack = max(_ROUNDING, goal.tolerance.joints)
    return [
        Finding(
            file,
            f'goal.joints.{joint.name}',
            f'{goal.joints[joint.name]:.9g} rad within {slack:g}',
            f'an angle from {joint.lower:.9g} to {joint.upper:.9g} rad',
        )
        for joint in problem.hand.joints
        if goal.joints is not None
        and joint.name in goal.joints
        and not joint.lower - slack <= goal.joints[joint.name] <= joint.upper + slack
    ]


def _other_contacts(
    system: ContactSystem, examined: ExaminedGrasp, goal: Goal, file: str
) -> list[Finding]:
    """Contacts that the goal names and that do not touch in it, or the other way round."""
    names = system.contact_names([int(pair) for pair in examined.pairs])
    wanted = goal.contacts or ()
    found = [
        Finding(
            file,
            'goal.contacts',
            f'{name}, which does not touch in the goal grasp',
            f'a contact of the goal grasp: {", ".join(names) or "none"}',
        )
        for name in wanted
        if name not in names
    ]
    others = [name for name in names if name not in wanted]
    if goal.exact_contacts and others:
        touch = f'{", ".join(others)} touching as well in the goal grasp'
        found.append(Finding(file, 'goal.exact_contacts', touch, 'no contact but those named'))
    return found
