"""``cfplan explore``: all contact formations that can be reached, as a table and a graph."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click
from rich.table import Table

from cfplan_core.command_line.console import answers, new_table
from cfplan_core.command_line.inputs import examine
from cfplan_core.command_line.plan_options import resolution_option, second_order_option

if TYPE_CHECKING:
    from cfplan_core.exploration import Exploration


@click.command(short_help='List all contact formations that can be reached.')
@click.argument('file', metavar='PROBLEM', type=click.Path(path_type=Path))
@click.option(
    '--dot',
    'dot_path',
    type=click.Path(dir_okay=False, path_type=Path),
    metavar='OUT',
    help='Write the graph for Graphviz.',
)
@click.option(
    '--json',
    'json_path',
    type=click.Path(dir_okay=False, path_type=Path),
    metavar='OUT',
    help="Write the graph as JSON, in networkx's node-link form.",
)
@resolution_option
@second_order_option
def explore(
    file: Path,
    dot_path: Path | None,
    json_path: Path | None,
    resolution: float,
    second_order: bool,
) -> int:
    """List all contact formations, and the transitions between them, that can be reached.

    For the start grasp of a PROBLEM with a hand of one or two joints. A formation is listed once
    for each stability class and each connected part.

    Exit status: 0 explored, 2 invalid input or usage.
    """
    from cfplan_core.exploration import explore as explore_problem

    explored = explore_problem(examine(file).valid_problem(), resolution, second_order)
    if dot_path is not None or json_path is not None:
        from cfplan_core.report.graph_files import write_dot, write_json

        if dot_path is not None:
            write_dot(explored, dot_path)
        if json_path is not None:
            write_json(explored, json_path)
    console = answers()
    console.print(_table(explored))
    nodes, transitions = len(explored.graph), explored.graph.number_of_edges()
    parts = 'part of a contact formation' if nodes == 1 else 'parts of contact formations'
    console.print(f'{nodes} {parts}, {transitions} transition{"s" if transitions != 1 else ""}.')
    console.print(f'{explored.coverage[0].upper()}{explored.coverage[1:]}.')
    return 0


def _table(explored: Exploration) -> Table:
    table = new_table(f'What can be reached in {explored.problem.name}')
    table.add_column('Part', justify='right', overflow='fold')
    table.add_column('Contacts', no_wrap=True)
    table.add_column('Stability', overflow='fold')
    table.add_column('Joints (rad)', min_width=len('-0.000 to -0.000'), overflow='fold')
    table.add_column('Next to', overflow='fold')
    for index in sorted(explored.graph):
        node = explored.graph.nodes[index]
        role = {explored.start: ' start', explored.goal: ' goal'}.get(index, '')
        if explored.start == explored.goal == index:
            role = ' start, goal'
        table.add_row(
            f'{index}{role}',
            '\n'.join(node['contacts']),
            f'{node["stability"].replace("_", " ")}\ndimension {node["dimension"]}',
            '\n'.join(
                f'{name}\n{node["lower"][name]:.3f} to {node["upper"][name]:.3f}'
                for name in explored.problem.hand.joint_names
            ),
            ', '.join(str(other) for other in sorted(explored.graph[index])),
        )
    return table
