from __future__ import annotations

import json
import re
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from cfplan_core import load_problem
from cfplan_ros.recording.topics import ESSENTIAL, PREVIEW, RecordedTopic
from cfplan_ros.visualization.frames import WORLD_FRAME

CONFIG = Path(__file__).parents[3] / 'config'
NODE = '/cfplan_planner'
TOPICS: dict[str, RecordedTopic] = {
    topic.full_name(NODE): topic for topic in (*ESSENTIAL, *PREVIEW)
}
# The node's, not the run's.
DIAGNOSTICS = '/diagnostics'


@pytest.fixture(scope='module')
def layout() -> dict[str, Any]:
    loaded: dict[str, Any] = json.loads((CONFIG / 'foxglove_layout.json').read_text('utf-8'))
    return loaded


@pytest.fixture(scope='module')
def rviz() -> dict[str, Any]:
    loaded: dict[str, Any] = yaml.safe_load((CONFIG / 'cfplan.rviz').read_text('utf-8'))
    return loaded


def panels_in(layout: Any) -> Iterator[str]:
    """Ids of the panels in a mosaic."""
    if isinstance(layout, str):
        yield layout
    else:
        assert set(layout) == {'direction', 'first', 'second', 'splitPercentage'}
        assert layout['direction'] in ('row', 'column')
        yield from panels_in(layout['first'])
        yield from panels_in(layout['second'])


def plot_paths(layout: dict[str, Any]) -> list[str]:
    return [
        path['value']
        for name, panel in layout['configById'].items()
        if name.startswith('Plot!')
        for path in panel['paths']
    ]


def fields_of(message_class: Any) -> dict[str, str]:
    fields: dict[str, str] = message_class.get_fields_and_field_types()
    return fields


def test_the_layout_has_the_parts_of_an_exported_one(layout: dict[str, Any]) -> None:
    assert {'configById', 'globalVariables', 'userNodes', 'playbackConfig', 'layout'} == set(
        layout
    )


def test_every_panel_of_the_layout_is_configured_and_shown_once(layout: dict[str, Any]) -> None:
    shown = list(panels_in(layout['layout']))
    for name in list(shown):
        for tab in layout['configById'][name].get('tabs', []):
            shown += panels_in(tab['layout'])
    assert sorted(shown) == sorted(layout['configById'])


def test_every_topic_of_the_layout_exists(layout: dict[str, Any]) -> None:
    used = {path.split('.')[0] for path in plot_paths(layout)}
    for panel in layout['configById'].values():
        used |= set(panel.get('topics', {}))
        used |= {panel[key] for key in ('topicPath', 'topicToRender') if key in panel}
    assert used - {DIAGNOSTICS} <= set(TOPICS)
    assert {f'{NODE}/markers', f'{NODE}/contact_markers', f'{NODE}/plan_result'} <= used


def test_every_plotted_field_exists(layout: dict[str, Any]) -> None:
    for path in plot_paths(layout):
        topic, *steps = path.split('.')
        message_class = TOPICS[topic].message_class
        for depth, step in enumerate(steps):
            name = re.fullmatch(r'(\w+)\[\d+\]', step)
            assert name is not None
            kind = fields_of(message_class)[name[1]]
            if depth < len(steps) - 1:
                package, inner = re.fullmatch(r'sequence<(\w+)/(\w+)>', kind).groups()  # type: ignore[union-attr]
                message_class = getattr(import_module(f'{package}.msg'), inner)
            else:
                assert kind == 'sequence<double>'


def test_the_layout_plots_both_limits_of_each_joint_by_itself(layout: dict[str, Any]) -> None:
    for k in range(6):
        panel = layout['configById'][f'Plot!cfplan_torque_{k + 1}']
        ends = [path['value'].rpartition('.')[2] for path in panel['paths']]
        assert ends == [f'lower[{k}]', f'upper[{k}]']


def test_plots_go_by_the_header_stamp(layout: dict[str, Any]) -> None:
    for name, panel in layout['configById'].items():
        if name.startswith('Plot!'):
            assert {path['timestampMethod'] for path in panel['paths']} == {'headerStamp'}


def test_the_layout_looks_along_z_onto_the_palm(layout: dict[str, Any]) -> None:
    scene = layout['configById']['3D!cfplan_scene']
    camera = scene['cameraState']
    assert scene['followTf'] == WORLD_FRAME
    assert (camera['perspective'], camera['phi'], camera['thetaOffset']) == (False, 0, 0)


def test_the_layout_hides_no_namespace_but_the_start_s(layout: dict[str, Any]) -> None:
    markers = layout['configById']['3D!cfplan_scene']['topics'][f'{NODE}/markers']
    assert markers['visible']
    assert set(markers['namespaces']) == {'start_contacts', 'start_forces'}


def test_rviz_shows_the_plane_from_above_in_the_palm_s_frame(rviz: dict[str, Any]) -> None:
    manager = rviz['Visualization Manager']
    assert manager['Global Options']['Fixed Frame'] == WORLD_FRAME
    assert manager['Views']['Current']['Class'] == 'rviz_default_plugins/TopDownOrtho'


def displays(rviz: dict[str, Any]) -> list[dict[str, Any]]:
    found: list[dict[str, Any]] = rviz['Visualization Manager']['Displays']
    return found


def test_every_topic_of_rviz_exists_with_the_durability_that_is_offered(
    rviz: dict[str, Any],
) -> None:
    subscribed = [display['Topic'] for display in displays(rviz) if 'Topic' in display]
    assert subscribed
    for topic in subscribed:
        offered = TOPICS[topic['Value']].qos.durability.name
        assert topic['Durability Policy'].upper().replace(' ', '_') == offered


def test_rviz_shows_markers_and_frames(rviz: dict[str, Any]) -> None:
    enabled = [display for display in displays(rviz) if display['Enabled']]
    shown = {display['Topic']['Value'] for display in enabled if 'Topic' in display}
    assert shown == {f'{NODE}/markers', f'{NODE}/contact_markers'}
    assert 'rviz_default_plugins/TF' in {display['Class'] for display in enabled}


def test_both_viewers_see_the_whole_hand_of_1991(
    layout: dict[str, Any], rviz: dict[str, Any]
) -> None:
    problem = load_problem(CONFIG / 'problems' / 'trinkle_hunter_1991.yaml')
    bodies = problem.hand.world_vertices(problem.start.joints)
    links = [v for name, v in bodies.items() if not name.startswith('palm.')]
    camera = layout['configById']['3D!cfplan_scene']['cameraState']
    view = rviz['Visualization Manager']['Views']['Current']
    for center, height in (
        (camera['targetOffset'][1], camera['distance']),
        (view['Y'], 0.7 * rviz['Window Geometry']['Height'] / view['Scale']),
    ):
        for vertices in links:
            assert np.abs(vertices[:, 1] - center).max() < 0.5 * height
