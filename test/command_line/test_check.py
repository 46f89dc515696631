from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import Result

from cfplan_core.command_line.check import table_1_row

Cfplan = Callable[..., Result]


def _rows(output: str) -> list[tuple[str, ...]]:
    """Cells of every row of every table."""
    return [
        tuple(cell for cell in re.split(r'\s{2,}', line.strip())) for line in output.splitlines()
    ]


def test_bodies_and_joints_are_listed(cfplan: Cfplan, problem_file: Path) -> None:
    result = cfplan('check', problem_file)
    assert result.exit_code == 0
    rows = _rows(result.output)
    assert ('object', '4', '0.1') in rows
    assert ('palm.0', '4', 'fixed') in rows
    assert ('right.link_2', '4', 'massless') in rows
    assert ('left_joint', '0.03 to 3.112', '1', '5') in rows


def test_start_lies_on_the_palm_with_two_vertices(cfplan: Cfplan, problem_file: Path) -> None:
    start = cfplan('check', problem_file).output.partition('Goal contact formation')[0]
    rows = _rows(start)
    assert ('vertex 0', 'palm.0', 'edge 2') in rows
    assert ('vertex 1', 'palm.0', 'edge 2') in rows


def test_both_grasps_have_stability_and_dimension(cfplan: Cfplan, problem_file: Path) -> None:
    output = cfplan('check', problem_file).output
    assert output.count('closure, dimension ') == 2


@pytest.mark.parametrize(
    ('contact', 'row'),
    [
        ('object.v1|palm.0.e3', ('vertex 1', 'palm.0', 'edge 3')),
        ('object.e0|right.link_2.v2', ('edge 0', 'right.link_2', 'vertex 2')),
        ('object.e12|f.a.b.v10', ('edge 12', 'f.a.b', 'vertex 10')),
    ],
)
def test_contact_takes_the_form_of_table_1(contact: str, row: tuple[str, str, str]) -> None:
    assert table_1_row(contact) == row


def test_everything_wrong_is_listed(cfplan: Cfplan, broken_file: Path) -> None:
    result = cfplan('check', broken_file)
    assert result.exit_code == 2
    assert f'{broken_file}: object.mass: got -0.1, expected ' in result.output
    assert f'{broken_file}: hand.fingers[0].base_angle: got .nan, expected ' in result.output
    assert result.output.endswith('2 findings\n')


def test_start_that_penetrates_is_refused(
    cfplan: Cfplan, problem_file: Path, tmp_path: Path
) -> None:
    text = problem_file.read_text(encoding='utf-8')
    path = tmp_path / 'deep.yaml'
    path.write_text(text.replace('[0.0075, 0.023043472, 0.0]', '[0.0075, 0.022, 0.0]'))
    result = cfplan('check', path)
    assert result.exit_code == 2
    assert f'{path}: start' in result.output


def test_goal_that_leaves_something_open_is_printed(
    cfplan: Cfplan, problem_file: Path, tmp_path: Path
) -> None:
    text = problem_file.read_text(encoding='utf-8')
    path = tmp_path / 'open.yaml'
    given = "goal:\n  contacts: ['object.v1|palm.0.e2']\n  joints: {left_joint: 0.76}\n"
    path.write_text(text[: text.index('goal:')] + given, encoding='utf-8')
    output = cfplan('check', path).output
    goal = output.partition('The goal is given in part')[2]
    assert ('vertex 1', 'palm.0', 'edge 2') in _rows(goal)
    assert 'joints left_joint 0.76 rad' in goal


@pytest.mark.parametrize('width', [80, 160])
def test_tables_fit_the_terminal(
    width: int, cfplan: Cfplan, problem_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv('COLUMNS', str(width))
    output = cfplan('check', problem_file).output
    assert max(len(line) for line in output.splitlines()) <= width
    assert '…' not in output


def test_goal_beyond_a_joint_limit_is_one_finding(
    cfplan: Cfplan, problem_file: Path, tmp_path: Path
) -> None:
    before, _, _ = problem_file.read_text(encoding='utf-8').partition('\ngoal:')
    beyond = tmp_path / 'beyond.yaml'
    beyond.write_text(f'{before}\ngoal:\n  joints: {{left_joint: 9.0}}\n', encoding='utf-8')
    result = cfplan('check', beyond)
    assert result.exit_code == 2
    assert result.output.count('goal.joints.left_joint') == 1
    assert '1 finding' in result.output
