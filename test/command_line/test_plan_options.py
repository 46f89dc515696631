from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import Result

from cfplan_core import load_problem, read_plan, verify_plan

Cfplan = Callable[..., Result]

PROBLEM = Path(__file__).parents[2] / 'config' / 'problems' / 'h1181.yaml'


def test_alternatives_are_listed_and_written_beside_the_best(
    cfplan: Cfplan, tmp_path: Path
) -> None:
    out = tmp_path / 'plan.json'
    result = cfplan('plan', PROBLEM, '--prefer', 'shortest', '--alternatives', '2', '--json', out)
    assert result.exit_code == 0
    assert 'none better exists' in ' '.join(result.output.split())
    plans = [read_plan(out), read_plan(tmp_path / 'plan.2.json')]
    for each in plans:
        assert verify_plan(load_problem(PROBLEM), each).failures == ()
        assert f'{each.length:.3f}' in result.output


def test_segments_are_printed_and_written_with_their_needed_force(
    cfplan: Cfplan, tmp_path: Path
) -> None:
    out = tmp_path / 'plan.json'
    result = cfplan('plan', PROBLEM, '--json', out)
    for segment in json.loads(out.read_text(encoding='utf-8'))['segments']:
        assert f'{segment["needed_force"]:.2f} weights' in result.output


def test_a_constraint_changes_the_plan(cfplan: Cfplan, tmp_path: Path) -> None:
    out = tmp_path / 'plan.json'
    assert cfplan('plan', PROBLEM, '--max-contacts', '4', '--json', out).exit_code == 0
    segments = read_plan(out).segments
    assert min(len(segment.contacts) for segment in segments) == 3


def test_a_force_that_no_plan_keeps_is_infeasible(cfplan: Cfplan) -> None:
    result = cfplan('plan', PROBLEM, '--max-needed-force', '1.35')
    assert result.exit_code == 1
    assert 'contacts would need more than the largest force' in ' '.join(result.output.split())


@pytest.mark.parametrize(
    ('arguments', 'message'),
    [
        (('--max-needed-force', '-1'), '-1.0 is not a finite number of weights above zero'),
        (('--prefer', 'fastest'), "'fastest' is not one of"),
        (('--stay-within', '0,0 1'), "'1' is no corner x,y"),
        (('--stay-within', '0,0 1,1'), 'expected at least three corners'),
        (('--forbid', 'object.v0|palm.0.e2,'), 'is no list of contacts'),
        (('--forbid', 'object.v0|thumb.e2'), 'forbidden'),
        (('--hold', 'elbow'), "got 'elbow', expected names of left_joint, right_joint"),
    ],
)
def test_what_makes_no_sense_is_refused_by_name(
    cfplan: Cfplan, arguments: tuple[str, ...], message: str
) -> None:
    result = cfplan('plan', PROBLEM, *arguments)
    assert result.exit_code == 2
    assert message in ' '.join((result.output + result.stderr).split())


def test_a_start_that_breaks_a_constraint_is_refused_by_the_name_of_the_file(
    cfplan: Cfplan, tmp_path: Path
) -> None:
    out = tmp_path / 'plan.json'
    result = cfplan('plan', PROBLEM, '--max-contacts', '3', '--json', out)
    assert result.exit_code == 2
    for shown in (result.stderr, read_plan(out).message):
        assert f'{PROBLEM}: start: got 4 contacts' in shown
        assert '<problem>' not in shown
