"""``cfplan call``: send a problem file to a running planner and print its answer."""

from __future__ import annotations

import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from cfplan_core.command_line.console import INVALID_INPUT, answers, complain
from cfplan_core.command_line.plan import EXIT_STATUS, finite_seconds, print_result, write_result
from cfplan_core.command_line.plan_options import wanted_plan
from cfplan_core.command_line.progress import progress_bar
from cfplan_core.command_line.trajectory_options import timed_plan, trajectory_options
from cfplan_core.errors import CfplanError
from cfplan_core.trajectory.plan_result import PlanResult, Status
from cfplan_ros.command_line.runtime import needs_rclpy

if TYPE_CHECKING:
    from cfplan_core.model import Problem

NOT_ANSWERED = 4
_POLL_PERIOD = 0.2


@click.command(short_help='Ask a running planner for a plan.')
@click.argument('file', type=click.Path(path_type=Path))
@click.option(
    '--node',
    'node_name',
    default='/cfplan_planner',
    show_default=True,
    metavar='NAME',
    help='The planner, with its namespace.',
)
@click.option(
    '--json',
    'json_path',
    type=click.Path(dir_okay=False, path_type=Path),
    metavar='OUT',
    help='Write the result here as JSON, whatever the outcome; missing directories are created. '
    'Alternatives go beside it, as OUT with .2, .3 and so on before its suffix.',
)
@click.option(
    '--figures',
    'figure_directory',
    type=click.Path(file_okay=False, path_type=Path),
    metavar='DIR',
    help='Draw the figures into this directory; it is created if missing.',
)
@click.option(
    '--time-budget',
    type=float,
    callback=finite_seconds,
    metavar='S',
    help="Give up after S seconds; the planner's default otherwise.",
)
@click.option(
    '--max-nodes',
    type=click.IntRange(min=1, max=2**32 - 1),
    metavar='N',
    help='Give up once the two trees have N nodes or more together.',
)
@click.option(
    '--plan-only', is_flag=True, help='Let the planner answer without publishing the trajectory.'
)
@click.option(
    '--wait',
    type=float,
    default=5.0,
    show_default=True,
    callback=finite_seconds,
    metavar='S',
    help='How long to wait for the planner to be there.',
)
@wanted_plan
@timed_plan
def call(
    file: Path,
    node_name: str,
    json_path: Path | None,
    figure_directory: Path | None,
    time_budget: float | None,
    max_nodes: int | None,
    plan_only: bool,
    wait: float,
    **wanted: Any,
) -> int:
    """Send the problem FILE to a running planner and print its answer as `cfplan plan` does.

    The planner must have the hand of FILE. What the planner publishes and records is its own
    affair; the answer says under which name it recorded the run. Ctrl-C ends the waiting, not
    the planner's search.

    Exit status: 0 solved, 1 infeasible (searched to the end), 2 invalid input or usage, 3 budget
    exhausted, 4 the planner is not there or could not plan, 130 interrupted.
    """
    from cfplan_core.model.loading import load_problem
    from cfplan_core.options import PlanOptions

    problem = load_problem(file)
    for directory in (json_path.parent if json_path else None, figure_directory):
        if directory is not None:
            directory.mkdir(parents=True, exist_ok=True)

    with needs_rclpy():
        from cfplan_ros.conversions.plans import plan_result
        from cfplan_ros.conversions.requests import request_from_problem
    trajectory = trajectory_options(wanted)
    options = PlanOptions(
        time_budget=time_budget, max_nodes=max_nodes, trajectory=trajectory, **wanted
    )
    request = request_from_problem(problem, options, plan_only=plan_only)
    response = _answer_to(request, node_name, wait)
    if response is None:
        return NOT_ANSWERED

    result = plan_result(response)
    if result is None or response.error_code == response.CANCELED:
        complain(f'{node_name}: {response.error_msg}')
        return NOT_ANSWERED
    return _report(problem, result, response, json_path, figure_directory)


def _answer_to(request: Any, node_name: str, wait: float) -> Any:
    """Call the planner's service; None, with a complaint, if it does not answer."""
    import rclpy
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.signals import SignalHandlerOptions

    # Without handlers of its own Ctrl-C is Python's KeyboardInterrupt, as in every other command.
    context = rclpy.Context()
    try:
        rclpy.init(args=[], context=context, signal_handler_options=SignalHandlerOptions.NO)
        node = rclpy.create_node('cfplan_call', context=context)
    except (RuntimeError, ValueError) as error:
        raise CfplanError(str(error)) from error
    executor = SingleThreadedExecutor(context=context)
    try:
        executor.add_node(node)
        with progress_bar() as bar:
            if bar is not None:
                bar.add_task(f'{node_name} is planning', total=None)
            return _call(request, node, executor, node_name, wait)
    finally:
        executor.shutdown()
        node.destroy_node()
        rclpy.shutdown(context=context)


def _call(request: Any, node: Any, executor: Any, node_name: str, wait: float) -> Any:
    from cfplan_msgs.srv import PlanManipulation
    from rclpy.exceptions import NameValidationException

    planner = f'/{node_name.strip("/")}'
    service = f'{planner}/plan'
    try:
        client = node.create_client(PlanManipulation, service)
    except NameValidationException as error:
        raise CfplanError(f'--node {node_name}: {error}') from error
    if not client.wait_for_service(timeout_sec=wait):
        complain(f'no planner offers {service}, waited {wait:g} s; start one with: cfplan node')
        return None
    names = [f'{space.rstrip("/")}/{name}' for name, space in node.get_node_names_and_namespaces()]
    if names.count(planner) > 1:
        complain(
            f'{names.count(planner)} planners are called {planner}, and each would plan and '
            'publish; end all but one, or rename them: --ros-args -r __node:=NAME'
        )
        return None
    future = client.call_async(request)
    try:
        while not future.done():
            executor.spin_until_future_complete(future, timeout_sec=_POLL_PERIOD)
            if not future.done() and not _still_there(client, executor, future):
                complain(f'{node_name}: the planner ended without an answer')
                return None
    except KeyboardInterrupt:
        complain(f'{node_name} has the request all the same, and will publish what it finds')
        raise
    return future.result()


def _still_there(client: Any, executor: Any, future: Any) -> bool:
    """Tell whether the service is offered; its last answer may come just after it has gone."""
    if client.service_is_ready():
        return True
    deadline = time.monotonic() + 1.0
    while not future.done() and time.monotonic() < deadline:
        executor.spin_until_future_complete(future, timeout_sec=_POLL_PERIOD)
    return bool(future.done())


def _report(
    problem: Problem,
    result: PlanResult,
    response: Any,
    json_path: Path | None,
    figure_directory: Path | None,
) -> int:
    if result.status is Status.INVALID:
        complain(result.message)
        if json_path is not None:
            write_result(result, json_path)
        return INVALID_INPUT
    if json_path is not None:
        write_result(result, json_path)
    figures: list[Path] = []
    if figure_directory is not None:
        from cfplan_core.report.figures import write_figures

        figures = write_figures(problem, result, figure_directory)
    print_result(problem, result, figures)
    if response.record:
        answers().print(f'Recorded by the planner as {response.record}', soft_wrap=True)
    if result.solved and response.error_msg:
        complain(response.error_msg)
    return EXIT_STATUS[result.status]
