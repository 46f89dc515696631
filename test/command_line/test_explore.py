from __future__ import annotations

import json
from pathlib import Path

import networkx as nx
import pytest
from click.testing import CliRunner
from PIL import Image

from cfplan_core.command_line.application import application

FOLDER = Path(__file__).parents[2] / 'config' / 'problems' / 'existence'


def test_formations_are_listed_and_the_graph_is_written(tmp_path: Path) -> None:
    dot, document = tmp_path / 'graph.dot', tmp_path / 'graph.json'
    arguments = ['explore', str(FOLDER / 'barrier_too_low.yaml')]
    ran = CliRunner().invoke(application, [*arguments, '--dot', str(dot), '--json', str(document)])
    assert ran.exit_code == 0, ran.output
    assert 'object.e3|left.link.v1' in ran.output
    assert 'Everything that can be reached' in ran.output
    content = json.loads(document.read_text(encoding='utf-8'))
    graph = nx.node_link_graph(content, edges='edges')
    assert nx.is_connected(graph)
    assert f'{len(graph)} parts of contact formations, {graph.number_of_edges()} transitions' in (
        ran.output
    )
    lines = dot.read_text(encoding='utf-8').splitlines()
    assert sum(' -- ' in line for line in lines) == graph.number_of_edges()
    assert sum('label=' in line for line in lines) == len(graph)


@pytest.mark.parametrize('name', ['link_long_enough', 'one_joint_goes_on'])
def test_map_is_drawn(name: str, tmp_path: Path) -> None:
    picture = tmp_path / 'map.png'
    ran = CliRunner().invoke(
        application, ['map', str(FOLDER / f'{name}.yaml'), '-o', str(picture)]
    )
    assert ran.exit_code == 0, ran.output
    colours = Image.open(picture).convert('RGB').getcolors(1 << 24)
    assert colours is not None
    assert len(colours) > 50


def test_map_of_an_unknown_kind_is_refused(tmp_path: Path) -> None:
    problem = FOLDER / 'one_joint_goes_on.yaml'
    ran = CliRunner().invoke(application, ['map', str(problem), '-o', str(tmp_path / 'map.bmp')])
    assert ran.exit_code == 2
    assert '.png' in ran.stderr


@pytest.mark.parametrize('width', ['80', '120'])
def test_table_of_two_joints_is_whole_in_a_terminal(
    width: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv('COLUMNS', width)
    ran = CliRunner().invoke(application, ['explore', str(FOLDER / 'barrier_too_low.yaml')])
    assert '…' not in ran.output
    assert all(len(line) <= int(width) for line in ran.output.splitlines())
    for word in ('Stability', 'force', 'closure', 'dimension 2', 'left_joint', 'right_joint'):
        assert word in ran.output
