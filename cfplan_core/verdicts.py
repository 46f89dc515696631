"""What an answer says of the search behind it: what was explored, and what that proves."""

from __future__ import annotations

from cfplan_core.options import MOST_JOINTS, PlanOptions, Preference
from cfplan_core.planning.best_on_mesh import PRECISION, Best
from cfplan_core.planning.constraints import REASONS
from cfplan_core.planning.roadmap import Roadmap
from cfplan_core.planning.sampled_search import SampledSearch

TOO_WEAK = 'a joint would exceed its effort limit'


def best_of_all(
    options: PlanOptions, roadmap: Roadmap, stopped: str, margin: float, best: Best | None
) -> str:
    """Say whether a plan is the best of all that can be reached, and at what resolution.

    Args:
        options: With the preference.
        roadmap: What was explored.
        stopped: Why the search ended early; empty if it did not.
        margin: Of the plan.
        best: What the search chose, if it came to an end.
    """
    if stopped:
        return f'{_wanted(options)}: the best found so far; {stopped}'
    outcome = 'none better exists'
    if best is not None and best.bound is not None:
        if best.bound > (1.0 + 2.0 * PRECISION) * margin:
            outcome = 'the best found'
        outcome += f'; its margin is {margin:.3f}, the largest that can be had {best.bound:.3f}'
    elif options.prefer is Preference.SHORTEST:
        # The grid's steps and diagonals are up to 8 % longer than the straight way.
        outcome = 'none exists that is shorter by more than 8 %'
    if options.alternatives > 1:
        outcome += '; others were looked for along rays'
    return f'{_wanted(options)}: {outcome}; {roadmap.regions.coverage()}'


def best_explored(options: PlanOptions, roadmap: Roadmap, stopped: str, found: int) -> str:
    """Say whether plans are the best of the pieces explored; `found` different ones are known."""
    if stopped:
        return f'{_wanted(options)}: the best found so far; {stopped}'
    few = f'no more than {found} different plans, ' if found < options.alternatives else ''
    pieces = roadmap.pieces
    regions = sum(piece.dimension > 1 for piece in pieces)
    rays = f', {regions} of them regions of dimension 2 and more seen along rays'
    return (
        f'{_wanted(options)}: {few}none better exists in the {len(pieces)} pieces of contact '
        f'formations explored{rays if regions else ""}'
    )


def best_sampled(options: PlanOptions, search: SampledSearch, stopped: str, found: int) -> str:
    """Say that plans are the best of a sample of `found` different ones."""
    return (
        f'{_wanted(options)}: the best of {found} different plans, by {search.attempts} searches '
        f'that sample: a better one may exist{f"; {stopped}" if stopped else ""}'
    )


def constrained(options: PlanOptions) -> str:
    """Name the constraints that a search was under, as the command line does; empty if none."""
    named = []
    if options.max_needed_force is not None:
        named.append(f'max-needed-force {options.max_needed_force:g}')
    if options.max_contacts is not None:
        named.append(f'max-contacts {options.max_contacts}')
    named += [f'forbid {",".join(names)}' for names in options.forbidden]
    named += [f'require {",".join(names)}' for names in options.required]
    named += [f'hold {name}' for name in options.held_joints]
    if options.stay_within is not None:
        corners = ' '.join(f'{x:g},{y:g}' for x, y in options.stay_within)
        named.append(f"stay-within '{corners}'")
    if not options.second_order:
        named.append('no-second-order')
    return f' under {", ".join(named)}' if named else ''


def explored(roadmap: Roadmap) -> str:
    """Say what was searched, and why it did not lead on."""
    failures = '; '.join(f'{n} × {why}' for why, n in roadmap.failures.most_common(5))
    formations, attempts = roadmap.formations(), roadmap.attempts
    return (
        f'explored {formations} contact formation{"s" if formations != 1 else ""} by '
        f'{attempts} transition{"s" if attempts != 1 else ""}; '
        f'most frequent failures: {failures or "none"}'
    )


def sampled(options: PlanOptions, search: SampledSearch) -> str:
    """Say what an answer without a plan means if the search was by sampling."""
    return (
        f'. With more than {MOST_JOINTS} joints the search samples: it pushed along '
        f'{search.drives} drives, seed {options.seed}, which does not show that there is no plan'
    )


def doubt(roadmap: Roadmap) -> str:
    """Say how far an answer of no path is short of a proof."""
    blocked = roadmap.failures[TOO_WEAK]
    text = f'. Left out, as {TOO_WEAK}: {blocked} pieces' if blocked else ''
    for why in REASONS:
        count = sum(n for reason, n in roadmap.failures.items() if reason.endswith(why))
        if count:
            text += f'. Not followed, as {why}: {count} ways'
    coverage = roadmap.regions.coverage()
    return f'{text}. {coverage[0].upper()}{coverage[1:]}'


def _wanted(options: PlanOptions) -> str:
    """The preference by name: alternatives without one are ordered by their segments."""
    prefer = options.prefer
    if prefer is Preference.FIRST:
        prefer = Preference.FEWEST_SEGMENTS
    return str(prefer.value)
