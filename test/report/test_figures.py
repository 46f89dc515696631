from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import combinations, pairwise

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PathCollection, PolyCollection
from matplotlib.colors import to_rgba
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon
from matplotlib.path import Path as PlotPath
from matplotlib.text import Text
from matplotlib.transforms import Bbox

from cfplan_core.errors import CfplanError
from cfplan_core.model import Problem
from cfplan_core.report.figures import (
    frames_figure,
    grasps_figure,
    torque_figure,
    trajectory_figure,
    trees_figure,
)
from cfplan_core.report.figures.grasps import grasps_of, inward_direction
from cfplan_core.report.figures.timeline import SEGMENT_LABEL
from cfplan_core.report.figures.torque import (
    LOWER,
    NOMINAL,
    UNBOUNDED,
    UPPER,
    finite_runs,
    interval_limits,
    torque_view,
)
from cfplan_core.report.figures.trajectory import CURVE
from cfplan_core.report.figures.tree_key import formation_letters
from cfplan_core.report.figures.tree_nodes import NODE_LABEL
from cfplan_core.report.scene import story_frames
from cfplan_core.report.style import body_colours, joint_colours
from cfplan_core.trajectory.plan_result import PlanResult, Segment, TreeNode

Trees = tuple[tuple[TreeNode, ...], tuple[TreeNode, ...]]
FIGURES = (grasps_figure, frames_figure, trees_figure, trajectory_figure, torque_figure)


def texts(figure: Figure) -> list[tuple[Text, Bbox]]:
    """Visible texts that say something, with their extents, pixels."""
    assert isinstance(figure.canvas, FigureCanvasAgg)
    figure.canvas.draw()
    renderer = figure.canvas.get_renderer()
    shown = [
        text
        for text in figure.findobj(Text)
        if text.get_visible() and text.get_text().strip() and text.figure is not None
    ]
    extents = [(text, text.get_window_extent(renderer)) for text in shown]
    # Ticks outside the limits exist but are not drawn.
    return [(text, box) for text, box in extents if drawn(text, figure)]


def drawn(text: Text, figure: Figure) -> bool:
    for axes in figure.axes:
        for axis, (low, high) in ((axes.xaxis, axes.get_xlim()), (axes.yaxis, axes.get_ylim())):
            for tick in axis.get_major_ticks():
                if text in (tick.label1, tick.label2):
                    margin = 1e-9 * (high - low)
                    return bool(axes.axison and low - margin <= tick.get_loc() <= high + margin)
    return True


def overlaps(a: Bbox, b: Bbox, slack: float = 1.0) -> bool:
    return min(a.x1, b.x1) - max(a.x0, b.x0) > slack and min(a.y1, b.y1) - max(a.y0, b.y0) > slack


def drawn_numbers(figure: Figure) -> Iterator[np.ndarray]:
    for line in figure.findobj(Line2D):
        yield np.asarray(line.get_xydata(), dtype=float)
    for patch in figure.findobj(Polygon):
        yield patch.get_xy()
    for collection in figure.findobj(PolyCollection):
        for path in collection.get_paths():
            yield path.vertices
    for scatter in figure.findobj(PathCollection):
        yield np.asarray(scatter.get_offsets(), dtype=float)


@pytest.mark.parametrize('make', FIGURES)
def test_no_texts_overlap(
    make: Callable[[Problem, PlanResult], Figure], problem: Problem, result: PlanResult
) -> None:
    for (a, box), (b, other) in combinations(texts(make(problem, result)), 2):
        assert not overlaps(box, other), (a.get_text(), b.get_text())


@pytest.mark.parametrize('make', FIGURES)
def test_no_text_is_cut_by_the_page(
    make: Callable[[Problem, PlanResult], Figure], problem: Problem, result: PlanResult
) -> None:
    figure = make(problem, result)
    page = figure.bbox
    for text, box in texts(figure):
        assert page.x0 <= box.x0, text.get_text()
        assert page.y0 <= box.y0, text.get_text()
        assert box.x1 <= page.x1, text.get_text()
        assert box.y1 <= page.y1, text.get_text()


@pytest.mark.parametrize('make', FIGURES)
def test_texts_are_large_enough_to_read(
    make: Callable[[Problem, PlanResult], Figure], problem: Problem, result: PlanResult
) -> None:
    assert min(text.get_fontsize() for text, _ in texts(make(problem, result))) >= 6.0


@pytest.mark.parametrize('make', FIGURES)
def test_only_finite_numbers_are_drawn(
    make: Callable[[Problem, PlanResult], Figure], problem: Problem, result: PlanResult
) -> None:
    assert not np.isfinite(result.torque_upper).all()
    assert all(np.isfinite(numbers).all() for numbers in drawn_numbers(make(problem, result)))


@pytest.mark.parametrize('make', [grasps_figure, frames_figure])
def test_bodies_have_their_colours(
    make: Callable[[Problem, PlanResult], Figure], problem: Problem, result: PlanResult
) -> None:
    colours = body_colours(problem.hand)
    bodies = [p for p in make(problem, result).findobj(Polygon) if p.get_gid() in colours]
    assert {body.get_gid() for body in bodies} == set(colours)
    for body in bodies:
        assert body.get_facecolor() == to_rgba(colours[body.get_gid()])


@pytest.mark.parametrize('make', FIGURES)
def test_a_plan_that_stands_still_can_be_drawn(
    make: Callable[[Problem, PlanResult], Figure], problem: Problem, still: PlanResult
) -> None:
    assert all(np.isfinite(numbers).all() for numbers in drawn_numbers(make(problem, still)))


@pytest.mark.parametrize('make', [grasps_figure, frames_figure, trajectory_figure, torque_figure])
def test_other_hands_can_be_drawn_without_overlap(
    make: Callable[[Problem, PlanResult], Figure], three_joints: tuple[Problem, PlanResult]
) -> None:
    for (a, box), (b, other) in combinations(texts(make(*three_joints)), 2):
        assert not overlaps(box, other), (a.get_text(), b.get_text())


def test_long_names_do_not_overlap(three_joints: tuple[Problem, PlanResult]) -> None:
    problem, plan = three_joints
    index, thumb = problem.hand.fingers
    joints = tuple(
        replace(joint, name=f'right_index_finger_{joint.name}') for joint in index.joints
    )
    long = replace(index, name='right_index_finger_of_the_hand', joints=joints)
    hand = replace(problem.hand, fingers=(long, thumb))
    contact = 'object.v0|right_index_finger_of_the_hand.distal.e0'
    segments = tuple(replace(segment, contacts=(contact,)) for segment in plan.segments)
    renamed = replace(plan, joint_names=hand.joint_names, segments=segments)
    for make in (grasps_figure, trajectory_figure, torque_figure):
        figure = make(replace(problem, hand=hand), renamed)
        for (a, box), (b, other) in combinations(texts(figure), 2):
            assert not overlaps(box, other), (a.get_text(), b.get_text())


def test_figure_3_lists_the_contacts_of_start_and_goal(
    problem: Problem, result: PlanResult
) -> None:
    words = [text.get_text() for text, _ in texts(grasps_figure(problem, result))]
    assert (
        words.count('vertex 0') == 2
    )  # On the palm at the start, on the left finger at the goal.
    assert words.count('edge 2') == 6
    assert words.count('left.link_1') == 2
    assert [words.count(letter) for letter in 'abcde'] == [4, 4, 4, 4, 0]


def test_figure_3_numbers_the_vertices_of_the_object(problem: Problem, result: PlanResult) -> None:
    words = [text.get_text() for text, _ in texts(grasps_figure(problem, result))]
    assert all(words.count(str(k)) == 2 for k in range(len(problem.object.vertices)))


def test_figure_3_takes_contacts_from_the_segments_without_trees(
    problem: Problem, result: PlanResult
) -> None:
    (_, _, start), (_, _, goal) = grasps_of(problem, replace(result, trees=((), ())))
    assert start == result.segments[0].contacts
    assert goal == result.segments[-1].contacts


def test_figure_3_shows_the_goal_of_a_failed_search_only_if_it_is_a_grasp(
    problem: Problem, unsolved: PlanResult
) -> None:
    vague = replace(problem, goal=replace(problem.goal, joints=None))
    assert [title for title, _, _ in grasps_of(problem, unsolved)] == ['(a) start', '(b) goal']
    assert [title for title, _, _ in grasps_of(vague, unsolved)] == ['(a) start']


def test_figure_3_of_a_start_alone_has_room_for_its_header(
    problem: Problem, unsolved: PlanResult
) -> None:
    vague = replace(problem, goal=replace(problem.goal, joints=None))
    for (a, box), (b, other) in combinations(texts(grasps_figure(vague, unsolved)), 2):
        assert not overlaps(box, other), (a.get_text(), b.get_text())


def test_figure_3_writes_no_vertex_number_on_the_hand(
    problem: Problem, result: PlanResult
) -> None:
    figure = grasps_figure(problem, result)
    digits = [(t, box) for t, box in texts(figure) if t.get_text() in '0123']
    assert digits
    for text, box in digits:
        for patch in figure.findobj(Polygon):
            if patch.axes is text.axes and patch.get_gid() not in (None, 'object'):
                outline = patch.get_transform().transform(patch.get_xy())
                centre = (box.x0 + box.x1) / 2.0, (box.y0 + box.y1) / 2.0
                assert not PlotPath(outline).contains_point(centre), text.get_text()


def test_vertex_numbers_lie_inside_at_convex_and_reflex_vertices() -> None:
    notched = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [1.0, 1.0], [0.0, 2.0]])
    assert np.allclose(inward_direction(notched, 0), [1.0, 1.0])
    assert inward_direction(notched, 3)[1] < 0.0


def test_figure_4_numbers_its_frames(problem: Problem, result: PlanResult) -> None:
    words = {text.get_text() for text, _ in texts(frames_figure(problem, result))}
    frames = story_frames(result.segments)
    assert {str(frame) for frame in frames} <= words
    assert {f'{result.times[frame]:.2f} s' for frame in frames} <= words


def test_figure_4_draws_bodies_where_the_frames_put_them(
    problem: Problem, result: PlanResult
) -> None:
    figure = frames_figure(problem, result)
    for axes, frame in zip(figure.axes, story_frames(result.segments), strict=True):
        (body,) = [p for p in axes.patches if p.get_gid() == 'object']
        vertices = problem.object.world_vertices(result.object_poses[frame])
        assert np.allclose(body.get_xy()[:-1], vertices)


@pytest.mark.parametrize(('initial', 'goal'), [(5, 3), (60, 60), (1, 1), (40, 1), (5, 60)])
def test_figure_5_has_no_overlapping_texts_at_any_size(
    problem: Problem,
    result: PlanResult,
    make_trees: Callable[[int, int], Trees],
    initial: int,
    goal: int,
) -> None:
    figure = trees_figure(problem, replace(result, trees=make_trees(initial, goal)))
    boxes = texts(figure)
    edges = np.array([box.extents for _, box in boxes])
    for k, (text, box) in enumerate(boxes):
        width = np.minimum(edges[:, 2], box.x1) - np.maximum(edges[:, 0], box.x0)
        height = np.minimum(edges[:, 3], box.y1) - np.maximum(edges[:, 1], box.y0)
        hit = np.flatnonzero((width > 1.0) & (height > 1.0))
        assert list(hit) == [k], [text.get_text()] + [boxes[n][0].get_text() for n in hit]


def test_figure_5_labels_every_node_with_its_formation(
    problem: Problem, result: PlanResult
) -> None:
    letters = formation_letters(result.trees)
    labels = [
        text.get_text()
        for text, _ in texts(trees_figure(problem, result))
        if text.get_gid() == NODE_LABEL
    ]
    expected = [letters[frozenset(node.contacts)] for tree in result.trees for node in tree]
    assert sorted(labels) == sorted(expected)


def test_letters_follow_the_path_from_start_to_goal(result: PlanResult) -> None:
    letters = formation_letters(result.trees)
    initial, goal = ([node for node in tree if node.on_path] for tree in result.trees)
    found = dict.fromkeys(letters[frozenset(n.contacts)] for n in [*initial, *reversed(goal)])
    assert list(found) == sorted(found)


def test_the_same_contacts_have_the_same_letter_in_any_order() -> None:
    node = TreeNode(None, ('object.v0|palm.0.e2', 'object.v1|palm.0.e2'), '', 1, False, False)
    other = replace(node, contacts=node.contacts[::-1])
    assert len(formation_letters(((node,), (other,)))) == 1


def test_figure_5_explains_every_letter(problem: Problem, result: PlanResult) -> None:
    words = {text.get_text() for text, _ in texts(trees_figure(problem, result))}
    assert 'palm v0·e2 v1·e2, left v3·e0, right v2·e2' in words
    assert set(formation_letters(result.trees).values()) <= words


def test_figure_5_draws_one_tree_alone(problem: Problem, unsolved: PlanResult) -> None:
    figure = trees_figure(problem, replace(unsolved, trees=(unsolved.trees[0], ())))
    assert 'goal tree, 0 nodes' in {text.get_text() for text, _ in texts(figure)}


def test_figure_6_draws_the_joints_in_degrees(problem: Problem, result: PlanResult) -> None:
    lines = [c for c in trajectory_figure(problem, result).findobj(Line2D) if c.get_gid() == CURVE]
    assert len(lines) == len(result.segments)
    for line, segment in zip(lines, result.segments, strict=True):
        stretch = result.joints[segment.first_frame : segment.last_frame + 1]
        assert np.allclose(np.deg2rad(line.get_xydata()), stretch)


def test_figure_6_numbers_its_corners(problem: Problem, result: PlanResult) -> None:
    figure = trajectory_figure(problem, result)
    words = {text.get_text() for text in figure.axes[0].texts}
    assert {str(segment.last_frame) for segment in result.segments} | {'0'} <= words


def test_figure_6_of_three_joints_is_over_time(three_joints: tuple[Problem, PlanResult]) -> None:
    problem, plan = three_joints
    lines = [c for c in trajectory_figure(*three_joints).findobj(Line2D) if c.get_gid() == CURVE]
    assert len(lines) == 3
    for k, (line, joint) in enumerate(zip(lines, problem.hand.joints, strict=True)):
        assert np.array_equal(line.get_xdata(), plan.times)
        assert np.allclose(np.deg2rad(line.get_ydata()), plan.joints[:, k])
        assert line.get_color() == joint_colours(problem.hand)[joint.name]


def test_figure_7_draws_every_finite_limit(problem: Problem, result: PlanResult) -> None:
    figure = torque_figure(problem, result)
    for k, axes in enumerate(figure.axes[: len(result.joint_names)]):
        for gid, limits in ((LOWER, result.torque_lower), (UPPER, result.torque_upper)):
            lines = [line for line in axes.lines if line.get_gid() == gid]
            points = {tuple(point) for line in lines for point in line.get_xydata().tolist()}
            finite = np.isfinite(limits[:, k])
            expected = zip(result.times[finite].tolist(), limits[finite, k].tolist(), strict=True)
            assert points >= set(expected)


def test_figure_7_never_joins_limits_across_an_unbounded_stretch(
    problem: Problem, result: PlanResult
) -> None:
    for line in torque_figure(problem, result).findobj(Line2D):
        if line.get_gid() in (LOWER, UPPER):
            frames = np.searchsorted(result.times, line.get_xdata())
            assert np.all(np.diff(frames) <= 1)


def test_figure_7_hatches_steps_whose_own_frames_are_unbounded(
    problem: Problem, result: PlanResult
) -> None:
    figure = torque_figure(problem, result)
    for k, axes in enumerate(figure.axes[: len(result.joint_names)]):
        expected = 0.0
        for n, segment in enumerate(result.segments):
            enough = any if segment.stability == 'form_closure' else all
            for frame in range(segment.first_frame, segment.last_frame):
                shared = n > 0 and frame == segment.first_frame
                own = [frame + 1] if shared else [frame, frame + 1]
                sides = (result.torque_lower[own, k], result.torque_upper[own, k])
                if any(enough(np.isinf(side)) for side in sides):
                    expected += result.times[frame + 1] - result.times[frame]
        hatched = [c for c in axes.collections if c.get_gid() == UNBOUNDED]
        extents = [c.get_paths()[0].get_extents() for c in hatched]
        assert sum(extent.width for extent in extents) == pytest.approx(expected)
        assert all(c.get_hatch() for c in hatched)


def test_limits_jump_at_the_frame_that_two_segments_share() -> None:
    values = np.array([1.0, 2.0, 5.0, 6.0])
    segments = (Segment((), 'force_closure', 0, 1), Segment((), 'force_closure', 1, 3))
    assert interval_limits(values, segments).tolist() == [1.0, 2.0, 5.0, 5.0, 5.0, 6.0]


def test_form_closure_before_force_closure_stays_unbounded_to_its_end() -> None:
    inf = np.inf
    values = np.array([inf, inf, 3.0, 4.0])
    segments = (Segment((), 'form_closure', 0, 1), Segment((), 'force_closure', 1, 3))
    assert interval_limits(values, segments).tolist() == [inf, inf, 3.0, 3.0, 3.0, 4.0]


def test_force_closure_that_ends_unbounded_keeps_its_last_finite_limit() -> None:
    inf = np.inf
    values = np.array([3.0, inf, inf])
    segments = (Segment((), 'force_closure', 0, 1), Segment((), 'form_closure', 1, 2))
    assert interval_limits(values, segments).tolist() == [3.0, 3.0, inf, inf]


def test_figure_7_marks_unbounded_stretches_in_words(problem: Problem, result: PlanResult) -> None:
    words = [text.get_text() for text, _ in texts(torque_figure(problem, result))]
    assert words.count('unbounded') == 4  # Two stretches for each of two joints.


def test_figure_7_has_a_panel_per_joint_in_its_colour(
    three_joints: tuple[Problem, PlanResult],
) -> None:
    problem, plan = three_joints
    figure = torque_figure(problem, plan)
    colours = joint_colours(problem.hand)
    for axes, name in zip(figure.axes, plan.joint_names, strict=False):
        assert name in axes.get_ylabel()
        limits = [line for line in axes.lines if line.get_gid() in (LOWER, UPPER)]
        assert {line.get_color() for line in limits} <= {colours[name]}


def test_the_torque_view_is_not_blown_up_by_a_limit_near_form_closure() -> None:
    upper = np.append(np.linspace(0.1, 0.2, 50), [900.0, np.inf])
    low, high = torque_view(np.zeros(52), upper)
    assert low < 0.0 < 0.2 < high < 0.5


def test_the_torque_view_of_no_finite_limit_is_finite() -> None:
    low, high = torque_view(np.full(3, -np.inf), np.full(3, np.inf))
    assert np.isfinite(low)
    assert low < 0.0 < high


def test_the_torque_view_shows_all_nominal_torques() -> None:
    low, high = torque_view(np.zeros(4), np.full(4, 0.1), np.array([0.05, -0.7, 0.9, 0.1]))
    assert low < -0.7 < 0.9 < high


def test_figure_7_draws_nominal_torques_where_they_are_planned(
    problem: Problem, result: PlanResult
) -> None:
    nominal = np.linspace(-0.1, 0.1, result.joints.size).reshape(result.joints.shape)
    figure = torque_figure(problem, replace(result, torque_nominal=nominal))
    for k in range(len(result.joint_names)):
        (line,) = (line for line in figure.axes[k].lines if line.get_gid() == NOMINAL)
        np.testing.assert_array_equal(line.get_ydata(), nominal[:, k])
    assert NOMINAL in [text.get_text() for text, _ in texts(figure)]


def test_figure_7_has_no_nominal_torques_where_none_are_planned(
    problem: Problem, result: PlanResult
) -> None:
    figure = torque_figure(problem, replace(result, torque_nominal=np.empty((0, 0))))
    assert not [line for axes in figure.axes for line in axes.lines if line.get_gid() == NOMINAL]


def test_finite_runs_are_longest_stretches() -> None:
    values = np.array([np.inf, 1.0, 2.0, -np.inf, 3.0])
    assert list(finite_runs(values)) == [slice(1, 3), slice(4, 5)]


def test_numbers_of_short_segments_do_not_touch(problem: Problem, result: PlanResult) -> None:
    ends = [*range(0, 40, 1), 56]
    many = tuple(
        Segment(result.segments[0].contacts, 'force_closure', a, b) for a, b in pairwise(ends)
    )
    figure = torque_figure(problem, replace(result, segments=many))
    numbers = [(t, box) for t, box in texts(figure) if t.get_gid() == SEGMENT_LABEL]
    assert len(numbers) == len(many)
    for (a, box), (b, other) in combinations(numbers, 2):
        assert not overlaps(box, other), (a.get_text(), b.get_text())


def test_a_malformed_contact_is_refused(problem: Problem, result: PlanResult) -> None:
    segments = (replace(result.segments[0], contacts=('nonsense',)), *result.segments[1:])
    with pytest.raises(CfplanError, match='nonsense'):
        frames_figure(problem, replace(result, segments=segments))


def test_a_number_that_does_not_fit_its_segment_is_above_it(
    problem: Problem, result: PlanResult
) -> None:
    narrow = (
        replace(result.segments[0], first_frame=0, last_frame=21),
        replace(result.segments[0], first_frame=21, last_frame=22),
        replace(result.segments[0], first_frame=22, last_frame=56),
    )
    times = result.times.copy()
    times[21] = times[22] - 1e-3
    figure = torque_figure(problem, replace(result, segments=narrow, times=times))
    heights = {t.get_text(): t.get_position()[1] for t in figure.findobj(Text) if t.get_gid()}
    assert heights == {'1': 0.5, '2': 1.5, '3': 0.5}
