"""Explore: all contact formations that can be reached from a problem's start, as a graph."""

from __future__ import annotations

from dataclasses import dataclass

import networkx as nx

from cfplan_core.contact.system import ContactSystem
from cfplan_core.errors import CfplanError, InvalidProblemError
from cfplan_core.mechanics.frictionless import FrictionlessModel
from cfplan_core.model import Problem
from cfplan_core.options import MOST_JOINTS, RESOLUTION
from cfplan_core.planning.grasp_check import examine_problem
from cfplan_core.planning.pieces import Piece
from cfplan_core.planning.roadmap import Roadmap
from cfplan_core.planning.sheet_graph import configurations as configurations


@dataclass(frozen=True, eq=False)
class Exploration:
    """What can be reached.

    Attributes:
        problem: Explored.
        system: The problem compiled.
        roadmap: All pieces found.
        graph: Undirected. Nodes are indices of pieces that can be reached from the start, with
            the attributes `contacts` (names), `stability`, `dimension`, `depth` (transitions from
            the start), `configurations` (how many were looked at) and `lower` and `upper` (range
            of each joint, rad, by name). Edges are transitions.
        start: Node that holds the start.
        goal: Node that holds the goal; None if the goal is no whole grasp or cannot be reached.
        coverage: How completely, in words.
    """

    problem: Problem
    system: ContactSystem
    roadmap: Roadmap
    graph: nx.Graph
    start: int
    goal: int | None
    coverage: str

    def pieces(self) -> list[Piece]:
        """Pieces that can be reached, in the order of their indices."""
        return [self.roadmap.pieces[index] for index in sorted(self.graph)]

    def others(self) -> list[Piece]:
        """Pieces that cannot be reached from the start, but from the goal, if that is a grasp."""
        goal = examine_problem(self.system, self.roadmap.model).goal
        if goal is None or self.goal is not None:
            return []
        graph = _reachable(self.roadmap, self.roadmap.root(goal.z))
        return [self.roadmap.pieces[index] for index in sorted(graph)]


def explore(
    problem: Problem, resolution: float = RESOLUTION, second_order: bool = True
) -> Exploration:
    """Find all contact formations, split by stability and connected part, that can be reached.

    Args:
        problem: With a hand of one or two joints.
        resolution: Spacing of the grid of joint angles, rad; see `PlanOptions`.
        second_order: Whether stability of second order counts.

    Raises:
        CfplanError: The hand has more joints.
        InvalidProblemError: Something is wrong with the start or the goal.
    """
    system = ContactSystem(problem)
    if system.joint_count > MOST_JOINTS:
        raise CfplanError(
            f'got a hand of {system.joint_count} joints, expected at most {MOST_JOINTS}: others '
            'cannot be explored completely'
        )
    model = FrictionlessModel(system.load, second_order)
    examined = examine_problem(system, model)
    if examined.findings:
        raise InvalidProblemError(examined.findings)
    roadmap = Roadmap(system, model, resolution=resolution)
    start = roadmap.root(examined.start.z)
    graph = _reachable(roadmap, start)
    coverage = roadmap.regions.coverage()
    goal = None
    if examined.goal is not None:
        index = roadmap.root(examined.goal.z).index
        goal = index if index in graph else None
    return Exploration(problem, system, roadmap, graph, start.index, goal, coverage)


def _reachable(roadmap: Roadmap, start: Piece) -> nx.Graph:
    """Breadth first through all transitions."""
    graph = nx.Graph()
    queue = [start]
    graph.add_node(start.index, **_attributes(roadmap, start))
    for piece in queue:
        beside = [*roadmap.regions.beside(piece), *roadmap.settling.beside(piece)]
        for _, other in [*roadmap.neighbours(piece), *beside]:
            if other.index not in graph:
                graph.add_node(other.index, **_attributes(roadmap, other))
                queue.append(other)
            if other is not piece:
                graph.add_edge(piece.index, other.index)
    depths = nx.single_source_shortest_path_length(graph, start.index)
    nx.set_node_attributes(graph, depths, 'depth')
    return graph


def _attributes(roadmap: Roadmap, piece: Piece) -> dict[str, object]:
    points = configurations(piece)
    names = roadmap.system.problem.hand.joint_names
    return {
        'contacts': list(roadmap.system.contact_names(piece.formation.pairs)),
        'stability': piece.stability.value,
        'dimension': piece.dimension,
        'configurations': len(points),
        'lower': dict(zip(names, points[:, 3:].min(axis=0).tolist(), strict=True)),
        'upper': dict(zip(names, points[:, 3:].max(axis=0).tolist(), strict=True)),
    }
