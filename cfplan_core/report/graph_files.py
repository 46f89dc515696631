"""Graphs of contact formations as DOT, for Graphviz, and as JSON."""

from __future__ import annotations

import json
from pathlib import Path

from cfplan_core.exploration import Exploration
from cfplan_core.report.figures.saving import replacing

FORMAT = 'cfplan/graph/1'
_SHAPES = {0: 'point', 1: 'box', 2: 'ellipse'}


def write_json(explored: Exploration, path: Path) -> None:
    """Write a graph in networkx's node-link form, with problem, start, goal and coverage.

    `networkx.node_link_graph(document, edges='edges')` reads it.

    Raises:
        CfplanError: The file cannot be written.
    """
    document = {
        'format': FORMAT,
        'problem': explored.problem.name,
        'start': explored.start,
        'goal': explored.goal,
        'coverage': explored.coverage,
        'directed': False,
        'multigraph': False,
        'graph': {},
        'nodes': [{'id': k, **explored.graph.nodes[k]} for k in sorted(explored.graph)],
        'edges': [{'source': a, 'target': b} for a, b in _edges(explored)],
    }
    with replacing(path) as temporary:
        text = json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False)
        temporary.write_text(text + '\n', encoding='utf-8')


def write_dot(explored: Exploration, path: Path) -> None:
    """Write a graph in Graphviz's language: curves are boxes, regions ellipses.

    Raises:
        CfplanError: The file cannot be written.
    """
    lines = [f'graph {_quoted(explored.problem.name)} {{', '  node [fontsize=9];']
    for index in sorted(explored.graph):
        node = explored.graph.nodes[index]
        label = '\n'.join([f'{index}: {node["stability"]}', *node['contacts']])
        style = f'label={_quoted(label)}, shape={_SHAPES[node["dimension"]]}'
        if node['dimension'] == 0:
            style = f'xlabel={_quoted(label)}, shape=point'
        if index == explored.start:
            style += ', penwidth=3, color=blue'
        elif index == explored.goal:
            style += ', penwidth=3, color=red'
        lines.append(f'  {index} [{style}];')
    lines += [f'  {a} -- {b};' for a, b in _edges(explored)]
    with replacing(path) as temporary:
        temporary.write_text('\n'.join([*lines, '}', '']), encoding='utf-8')


def _edges(explored: Exploration) -> list[tuple[int, int]]:
    return sorted((min(edge), max(edge)) for edge in explored.graph.edges)


def _quoted(text: str) -> str:
    escaped = text.replace('\\', '\\\\').replace('"', '\\"').replace('\n', '\\n')
    return f'"{escaped}"'
