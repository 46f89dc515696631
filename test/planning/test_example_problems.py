from __future__ import annotations

import math
import os
import re
import subprocess
import sys
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import cfplan_core
from cfplan_core import PlanResult, load_problem, plan
from cfplan_core.contact.detection import touching
from cfplan_core.contact.elements import parse_contact
from cfplan_core.contact.system import ContactSystem
from cfplan_core.model import Grasp, Problem
from cfplan_core.trajectory.plan_file import write_plan
from cfplan_core.trajectory.plan_result import Segment
from cfplan_core.verification import verify_plan

PROBLEMS = sorted((Path(__file__).parents[2] / 'config' / 'problems').glob('*.yaml'))
STORY = next(path for path in PROBLEMS if '1991' in path.stem)
every_problem = pytest.mark.parametrize('path', PROBLEMS, ids=lambda path: path.stem)


@cache
def planned(path: Path) -> tuple[Problem, PlanResult]:
    problem = load_problem(path)
    return problem, plan(problem)


def document(result: PlanResult, path: Path) -> str:
    """Text of a plan file, but for the time that planning took."""
    write_plan(result, path)
    return re.sub(r'"planning_time": [^,]*,', '', path.read_text(encoding='utf-8'))


def touched(problem: Problem, result: PlanResult, frame: int) -> tuple[str, ...]:
    system = ContactSystem(problem)
    z = system.configuration(Grasp(result.object_poses[frame], result.joints[frame]))
    return system.contact_names(touching(system, z, 1e-7).tolist())


@every_problem
def test_example_problem_is_solved_and_certified(path: Path) -> None:
    problem, result = planned(path)
    assert result.solved, result.message
    assert verify_plan(problem, result).failures == ()


@every_problem
def test_plan_is_the_same_on_every_run(path: Path, tmp_path: Path) -> None:
    problem, result = planned(path)
    assert document(plan(problem), tmp_path / 'a') == document(result, tmp_path / 'b')


@pytest.mark.parametrize('seed', ['0', '12345'])
def test_plans_do_not_depend_on_the_hash_seed(seed: str, tmp_path: Path) -> None:
    """In a process of its own, as the order of sets is chosen when Python starts."""
    script = (
        'import sys, pathlib; from cfplan_core import load_problem, plan, write_plan\n'
        'for path in map(pathlib.Path, sys.argv[2:]):\n'
        '    write_plan(plan(load_problem(path)), pathlib.Path(sys.argv[1]) / path.stem)\n'
    )
    source = str(Path(cfplan_core.__file__).parents[1])
    subprocess.run(
        [sys.executable, '-c', script, str(tmp_path), *map(str, PROBLEMS)],
        check=True,
        env={**os.environ, 'PYTHONHASHSEED': seed, 'PYTHONPATH': source},
    )
    for path in PROBLEMS:
        text = (tmp_path / path.stem).read_text(encoding='utf-8')
        without_time = re.sub(r'"planning_time": [^,]*,', '', text)
        assert without_time == document(planned(path)[1], tmp_path / 'here'), path.stem


# The story of 1991.


def story() -> tuple[Problem, PlanResult, tuple[Segment, ...]]:
    problem, result = planned(STORY)
    return problem, result, result.segments


def feet(segment: Segment) -> set[str]:
    """The object's vertices on the palm."""
    return {name.split('|')[0] for name in segment.contacts if '|palm.0.' in name}


def test_story_begins_by_sliding_left_from_form_into_force_closure() -> None:
    _, result, (first, second, *_) = story()
    assert first.contacts == second.contacts
    assert (first.stability, second.stability) == ('form_closure', 'force_closure')
    assert feet(first) == {'object.v0', 'object.v1'}
    poses = result.object_poses[first.first_frame : second.last_frame + 1]
    assert (np.diff(poses[:, 0]) < 0.0).all()
    np.testing.assert_allclose(poses[:, 1:], np.tile(poses[0, 1:], (len(poses), 1)), atol=1e-9)


def test_story_passes_a_configuration_of_five_contacts_and_tips_from_there() -> None:
    """Both segments' contacts: on the old face and along the left finger."""
    problem, result, segments = story()
    sliding, tipping = next(
        pair for pair in pairwise(segments) if len(feet(pair[0])) == 2 and len(feet(pair[1])) == 1
    )
    shared = set(touched(problem, result, tipping.first_frame))
    assert len(set(sliding.contacts) | set(tipping.contacts)) == 5
    assert set(sliding.contacts) | set(tipping.contacts) <= shared
    angles = result.object_poses[tipping.first_frame : tipping.last_frame + 1, 2]
    assert (np.abs(np.diff(angles)) > 1e-6).all()


def test_story_has_a_fingertip_cross_a_vertex_while_the_object_tips() -> None:
    """Before, the object's vertex is on the finger's edge, after it the fingertip on the object's.

    Between them both vertices are at one place.
    """
    problem, result, segments = story()
    crossings = []
    for before, after in pairwise(segments):
        lost = [parse_contact(name) for name in set(before.contacts) - set(after.contacts)]
        won = [parse_contact(name) for name in set(after.contacts) - set(before.contacts)]
        if len(lost) == len(won) == 1 and lost[0].object_vertex > won[0].object_vertex:
            frame = before.last_frame
            corner = problem.object.world_vertices(result.object_poses[frame])[lost[0].vertex]
            outline = problem.hand.world_vertices(result.joints[frame])[won[0].body]
            if np.abs(outline[won[0].vertex] - corner).max() < 1e-8:
                crossings.append(frame)
    assert crossings
    for frame in crossings:
        assert (np.diff(result.object_poses[frame - 1 : frame + 2, 2]) < 0.0).all()


def test_story_lands_on_a_new_face_and_slides_on() -> None:
    _, result, segments = story()
    last = segments[-1]
    assert feet(last) == {'object.v1', 'object.v2'}
    assert feet(segments[-2]) == {'object.v1'}
    poses = result.object_poses[last.first_frame : last.last_frame + 1]
    np.testing.assert_allclose(poses[:, 1:], np.tile(poses[0, 1:], (len(poses), 1)), atol=1e-9)
    assert (np.diff(poses[:, 0]) < 0.0).all()


def test_story_turns_the_object_by_65_degrees() -> None:
    _, result, _ = story()
    assert result.object_poses[-1, 2] == pytest.approx(-math.radians(65.0), abs=1e-6)
