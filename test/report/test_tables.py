from __future__ import annotations

import io
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from cfplan_core.model import Problem
from cfplan_core.report.tables import MOST_FAILURES, print_plan
from cfplan_core.trajectory.plan_result import PlanResult, Statistics
from cfplan_core.trajectory.segment_ends import segment_ends


def printed(result: PlanResult, problem: Problem | None = None, width: int = 100) -> str:
    stream = io.StringIO()
    print_plan(result, Console(file=stream, width=width), problem)
    return stream.getvalue()


def row_of(text: str, title: str, first: str) -> list[str]:
    """Words of the row that starts with a word, in the table under a title."""
    lines = text[text.index(title) :].splitlines()
    return next(line.split() for line in lines if line.split()[:1] == [first])


def test_every_segment_is_listed_with_its_contacts_stability_and_frames(
    result: PlanResult,
) -> None:
    text = printed(result)
    for k, segment in enumerate(result.segments):
        words = row_of(text, 'Segments', str(k + 1))
        assert words[1] == segment.contacts[0]
        assert words[2:7] == [
            *segment.stability.split('_'),
            str(segment.first_frame),
            'to',
            str(segment.last_frame),
        ]
        assert all(name in text for name in segment.contacts)


def test_segments_say_when_they_are(result: PlanResult) -> None:
    words = row_of(printed(result), 'Segments', '2')
    first, last = result.segments[1].first_frame, result.segments[1].last_frame
    assert words[-3:] == [f'{result.times[first]:.2f}', 'to', f'{result.times[last]:.2f}']


def test_joint_ranges_are_those_of_the_frames(result: PlanResult) -> None:
    words = row_of(printed(result), 'Joint angles', 'left_joint')
    angles = result.joints[:, 0]
    expected = [angles[0], angles[-1], angles.min(), angles.max()]
    assert np.allclose([float(word) for word in words[1:]], expected, atol=5e-4)


def test_joint_limits_are_shown_with_the_problem(problem: Problem, result: PlanResult) -> None:
    words = row_of(printed(result, problem), 'Joint angles', 'left_joint')
    assert words[-3:] == ['0.030', 'to', '3.112']


def test_infinite_torque_limits_are_called_unbounded(result: PlanResult) -> None:
    text = printed(result)
    assert row_of(text, 'Torque limits', 'left_joint')[1] == 'unbounded'
    assert 'inf' not in text
    assert 'nan' not in text


def test_finite_torque_limits_are_least_and_greatest(
    three_joints: tuple[Problem, PlanResult],
) -> None:
    words = row_of(printed(three_joints[1]), 'Torque limits', 'knuckle')
    assert words[1:7] == ['-1.1', 'to', '-0.1', '0.1', 'to', '0.2']


def test_the_narrowest_interval_is_where_the_limits_are_nearest(
    three_joints: tuple[Problem, PlanResult],
) -> None:
    text = printed(three_joints[1])
    assert row_of(text, 'Torque limits', 'thumb_joint')[-3:] == ['0', 'to', '0.05']


def test_without_a_plan_the_message_and_what_was_explored_are_printed(
    unsolved: PlanResult,
) -> None:
    text = printed(unsolved)
    assert 'budget exhausted' in text
    assert unsolved.message in text
    for words in (['initial', 'tree', '8'], ['goal', 'tree', '6'], ['met', '23'], ['tried', '53']):
        assert any(line.split()[-len(words) :] == words for line in text.splitlines())


def test_failures_are_listed_most_frequent_first(unsolved: PlanResult) -> None:
    text = printed(unsolved)
    places = [
        text.index(reason) for reason in ('the object falls', 'links collide', 'joint limit')
    ]
    assert places == sorted(places)
    assert row_of(text, 'Why transitions failed', '40')[1:] == ['the', 'object', 'falls']


def test_rare_failures_are_summed_up(unsolved: PlanResult) -> None:
    failures = {f'reason {k}': 1 for k in range(MOST_FAILURES + 3)}
    text = printed(replace(unsolved, statistics=Statistics(failures=failures)))
    assert '3 other reasons' in text


def test_brackets_in_names_are_printed_as_they_are(unsolved: PlanResult) -> None:
    strange = replace(unsolved, problem='[bold]x', message='[red]no', statistics=Statistics())
    assert '[bold]x' in printed(strange)
    assert '[red]no' in printed(strange)


@pytest.mark.parametrize('width', [80, 120])
def test_tables_keep_contacts_in_one_line(result: PlanResult, width: int) -> None:
    lines = printed(result, width=width).splitlines()
    assert max(len(line) for line in lines) <= width
    for segment in result.segments:
        assert all(any(name in line for line in lines) for name in segment.contacts)


def test_contacts_that_break_and_are_made_are_marked(result: PlanResult) -> None:
    text = printed(result)
    found = 0
    for segment, end in zip(result.segments, segment_ends(result.segments), strict=True):
        for name in segment.contacts:
            assert name in text
        for names, mark in ((end.broken, '-'), (end.made, '+')):
            for name in names:
                assert f'{mark} {name}' in text
                found += 1
    assert found > 4


def test_torque_controlled_joints_are_listed_where_they_are_planned(result: PlanResult) -> None:
    control = {'left_joint': 'position', 'right_joint': 'effort'}
    first = replace(result.segments[0], control=control)
    planned = replace(result, segments=(first, *result.segments[1:]))
    assert 'by torque' in printed(planned)
    assert 'by torque' not in printed(result)
