"""Four fingers of five joints each: planned within 60 s and 1 GB, and certified."""

from __future__ import annotations

import resource
import time
from pathlib import Path

from cfplan_core import load_problem, plan, verify_plan

PROBLEMS = Path(__file__).parents[1] / 'config' / 'problems' / 'many_joints'


def test_twenty_joints_take_a_minute_and_a_gigabyte_at_most() -> None:
    problem = load_problem(PROBLEMS / 'four_fingers_five_joints.yaml')
    began = time.process_time()
    result = plan(problem)
    taken = time.process_time() - began
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0
    print(f'\n20 joints: {taken:.1f} s, {memory:.0f} MB')
    assert verify_plan(problem, result).failures == ()
    assert taken < 60.0
    assert memory < 1024.0
