"""The README's example call is what it says it is."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import yaml
from cfplan_msgs.srv import PlanManipulation
from ros.node.harness import REPOSITORY, Client, Code, Planner, story

from cfplan_core import plan
from cfplan_ros.conversions.plans import plan_result


def example() -> dict[str, Any]:
    text = (REPOSITORY / 'README.md').read_text(encoding='utf-8')
    call = re.search(r'ros2 service call (\S+) (\S+) "(\{.*?\})"\n', text, re.DOTALL)
    assert call is not None
    assert call[1] == '/cfplan_planner/plan'
    assert call[2] == 'cfplan_msgs/srv/PlanManipulation'
    return dict(yaml.safe_load(call[3]))


def fill(message: Any, values: dict[str, Any]) -> None:
    """Set fields as ``ros2 service call`` does."""
    types = message.get_fields_and_field_types()
    for name, value in values.items():
        field = getattr(message, name)
        if isinstance(value, dict):
            fill(field, value)
        elif value and isinstance(value[0] if isinstance(value, list) else None, dict):
            package, element = types[name].split('<')[1].split(',')[0].split('>')[0].split('/')
            element_class = getattr(__import__(f'{package}.msg', fromlist=['msg']), element)
            field.extend(element_class() for _ in value)
            for each, inner in zip(field, value, strict=True):
                fill(each, inner)
        else:
            setattr(message, name, value)


def test_example_call_turns_the_block_as_the_paper_does(planner: Planner, client: Client) -> None:
    request = PlanManipulation.Request()
    fill(request, example())
    response = client.plan(request)
    assert response.error_code == Code.NONE, response.error_msg
    answered, expected = plan_result(response), plan(story())
    assert [s.contacts for s in answered.segments] == [s.contacts for s in expected.segments]
    np.testing.assert_allclose(answered.joints[-1], expected.joints[-1], atol=1e-6)
