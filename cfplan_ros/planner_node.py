"""The node `cfplan_planner`: plans on request, publishes and records what it finds.

Planning runs on a thread of its own. The service callback is a coroutine in a reentrant callback
group: it hands the request to that thread and awaits an rclpy Future, so that the executor is free
meanwhile, the single-threaded one too. Whoever sets the future also triggers a guard condition of
the node, since a future that is set on another thread does not wake every version's executor. All
of this is public rclpy, the same in Humble and later.

On SIGINT and SIGTERM the answers must still go out, which takes a valid context and a spinning
executor. `main` therefore handles the signals itself: the executor spins on a second thread, the
first waits for a signal, and the context is shut down last.
"""

from __future__ import annotations

import copy
import queue
import signal
import sys
import threading
import traceback
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from types import FrameType
from typing import Any

import rclpy
from cfplan_msgs.srv import PlanManipulation
from diagnostic_msgs.msg import DiagnosticArray
from rcl_interfaces.msg import SetParametersResult
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.exceptions import ParameterException
from rclpy.executors import SingleThreadedExecutor
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.signals import SignalHandlerOptions
from rclpy.task import Future
from std_srvs.srv import Trigger

from cfplan_core import CfplanError, Problem
from cfplan_core.trajectory.parameterization import import_toppra
from cfplan_ros.conversions.times import seconds_of
from cfplan_ros.diagnostics import LastPlan, PlannerState, diagnostic_array
from cfplan_ros.parameters import Configuration, ParameterError, configure, declare
from cfplan_ros.planning_queue import Admission, JobQueue
from cfplan_ros.planning_service import (
    CANCELED,
    COMMANDS,
    NO_HAND,
    OUTCOMES,
    Response,
    carry_out,
    plan_messages,
    read_request,
    refused,
)
from cfplan_ros.preview_player import PreviewPlayer
from cfplan_ros.recording.topics import ESSENTIAL, PREVIEW, REQUEST, RESPONSE
from cfplan_ros.run_keeper import RunKeeper
from cfplan_ros.visualization.preview import TRANSFORMS, preview

NAME = 'cfplan_planner'

# How long shutting down may wait for each of: the search, the answers, the files. Seconds.
_PATIENCE = 1.0
# Files are worth more of it; what is not complete by then the next start completes.
_FILE_PATIENCE = 3.0
# Playing begins this much after it was asked for: time to compute the first messages, ns.
_LEAD_IN = 200_000_000


@dataclass(frozen=True, eq=False)
class _Call:
    """A request on its way, with the configuration that was in force when it came."""

    request: Any
    configuration: Configuration
    answer: Future[Any]


class PlannerNode(Node):
    """Offers ``~/plan`` and ``~/play``, publishes plans, and reports on ``/diagnostics``.

    Args:
        kwargs: Of `rclpy.node.Node`, such as `context` and `parameter_overrides`.

    Raises:
        ParameterError: Parameters that it was started with cannot work.
        ParameterException: One has the wrong type or is out of its range.
    """

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(NAME, **kwargs)
        try:
            configuration = configure(declare(self))
        except Exception:
            self.destroy_node()
            raise
        self._last_plan: LastPlan | None = None
        self._last_solved: tuple[Problem, Any] | None = None
        self._unanswered: set[_Call] = set()
        self._answered = threading.Condition()
        self._outputs = {
            topic.name: self.create_publisher(topic.message_class, _private(topic.name), topic.qos)
            for topic in (*ESSENTIAL, *PREVIEW)
            if topic.name not in (REQUEST, RESPONSE)
        }
        self._diagnostics = self.create_publisher(DiagnosticArray, '/diagnostics', 1)
        self._planning: JobQueue[_Call] = JobQueue(self._serve, 'planning')
        self._transforms: Any = None
        self._player = PreviewPlayer(self._publish, self._now, self._play_failed)
        self._keeper = RunKeeper(
            self.get_fully_qualified_name(),
            self._publish,
            self._planning,
            self.get_logger().warning,
        )
        self._apply(configuration)
        self.add_on_set_parameters_callback(self._on_parameters)
        self._wake = self.create_guard_condition(lambda: None, ReentrantCallbackGroup())
        self.create_service(
            PlanManipulation, '~/plan', self._on_plan, callback_group=ReentrantCallbackGroup()
        )
        self.create_service(Trigger, '~/play', self._on_play)
        # Simulated time may stand still; whoever watches the node must hear of it all the same.
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        self.create_timer(1.0, self._on_diagnostics, clock=steady)
        self.create_timer(1.0, self._hold_pose, clock=steady)

    def introduction(self) -> str:
        """Say in one line what the node offers, with which hand, and where runs go."""
        settings = self._configuration.settings
        hand = f'hand {settings.hand_file}' if settings.hand_file else 'no hand (set hand_file)'
        runs = f'runs in {Path(settings.record_directory).absolute()}'
        return (
            f'ready: service {self.get_fully_qualified_name()}/plan, {hand}, '
            f'{runs if settings.record else "runs are not recorded"}; Ctrl-C ends it'
        )

    def stop(self) -> None:
        """Cancel what is being planned, have every request answered and every file closed.

        The executor must still be spinning, on another thread, as it sends the answers.
        """
        self._planning.close()
        if not self._planning.join(_PATIENCE):
            with self._answered:
                unanswered = list(self._unanswered)
            for call in unanswered:
                self._reply(call, self._refused(call, Response.CANCELED, CANCELED))
        with self._answered:
            self._answered.wait_for(lambda: not self._unanswered, _PATIENCE)
        self._player.close(_PATIENCE)
        self._keeper.close(_FILE_PATIENCE)

    # Parameters.

    def _apply(self, configuration: Configuration) -> None:
        self._configuration = configuration
        self._keeper.apply(configuration.settings)

    def _on_parameters(self, parameters: Sequence[Parameter]) -> SetParametersResult:
        values = {parameter.name: parameter.value for parameter in parameters}
        before = self._configuration
        try:
            self._apply(configure(before.settings.changed(values), before, values))
        except ParameterError as error:
            return SetParametersResult(successful=False, reason=str(error))
        return SetParametersResult(successful=True)

    # Planning.

    async def _on_plan(self, request: Any, _: Any) -> Any:
        call = _Call(request, self._configuration, Future())
        if call.configuration.hand is None:
            return self._refused(call, Response.NOT_CONFIGURED, NO_HAND)
        with self._answered:
            self._unanswered.add(call)
        try:
            capacity = call.configuration.settings.queue_length
            admission = self._planning.submit(call, capacity)
            if admission is Admission.CLOSED:
                return self._refused(call, Response.CANCELED, CANCELED)
            if admission is Admission.FULL:
                text = f'busy: a plan is being computed and {capacity} requests are waiting'
                return self._refused(call, Response.BUSY, text)
            return await call.answer
        finally:
            with self._answered:
                self._unanswered.discard(call)
                self._answered.notify_all()

    def _reply(self, call: _Call, response: Any) -> None:
        if not call.answer.done():
            call.answer.set_result(response)
            self._wake.trigger()

    def _refused(self, call: _Call, code: int, text: str) -> Any:
        return refused(code, text, call.request, call.configuration.setup, self._now())

    def _serve(self, call: _Call) -> None:
        """Answer a request; runs on the planning thread."""
        try:
            self._plan(call)
        except Exception as error:
            # A search that was given up at the end finds its publishers gone.
            if not self._planning.canceled.is_set():
                self.get_logger().error(f'planning failed:\n{traceback.format_exc()}')
            text = f'a defect of the planner: {type(error).__name__}: {error}'
            self._reply(call, Response(error_code=Response.UNKNOWN, error_msg=text))

    def _plan(self, call: _Call) -> None:
        if self._planning.canceled.is_set():
            self._reply(call, self._refused(call, Response.CANCELED, CANCELED))
            return
        settings, started = call.configuration.settings, self._now()
        task = read_request(call.request, call.configuration.setup)
        metadata = {**task.metadata(), 'parameters': asdict(settings)}
        run = self._keeper.begin(call.request, metadata, started)
        try:
            # A clock that was set back must not put the answer before the request.
            response = carry_out(task, self._planning.canceled, lambda: max(started, self._now()))
        except Exception:
            self._keeper.finish(run, None, None)
            raise
        solved = response.error_code == Response.NONE
        commanded = settings.publish and not call.request.options.plan_only
        messages = [
            (topic, message)
            for topic, message in (plan_messages(response.plan) if solved else ())
            if commanded or topic not in COMMANDS
        ]
        self._keeper.keep(run, response, messages)
        for topic, message in messages:
            self._publish(topic, message)
        if task.problem is not None and solved:
            self._last_solved = task.problem, response.plan
        self._reply(call, response)
        self._tell(response, task.capped)
        self._keeper.finish(run, task.problem, response.plan)

    def _publish(self, topic: str, message: Any) -> None:
        self._outputs[topic.removeprefix('~/')].publish(message)
        if topic == TRANSFORMS:
            self._transforms = message

    def _tell(self, response: Any, capped: bool) -> None:
        """Log an answer and keep it for diagnostics."""
        name, outcome = response.plan.problem_name, OUTCOMES[response.error_code]
        seconds = seconds_of(response.planning_time)
        self._last_plan = LastPlan(name, outcome, seconds)
        text = f'{_shortened(name) or "unnamed problem"}: {outcome} after {seconds:.3f} s'
        if capped:
            text += ', the time budget is capped by maximal_time_budget'
        if response.record:
            text += f', recorded as {response.record}'
        log = self.get_logger()
        # One call site for each severity: rclpy holds a call site to one.
        if response.error_msg:
            log.warning(f'{text}: {_shortened(response.error_msg, 2000)}')
        else:
            log.info(text)

    # Playing.

    def _on_play(self, _: Any, response: Any) -> Any:
        if self._last_solved is None:
            response.message = 'there is no plan to play'
            return response
        problem, solved = self._last_solved
        speed = self._configuration.settings.preview_speed
        response.success = self._player.play(
            preview(problem, solved, self._now() + _LEAD_IN, speed)
        )
        response.message = (
            'playing the last plan' if response.success else 'a plan is being played'
        )
        return response

    def _hold_pose(self) -> None:
        """Tell viewers again where links and object are: transforms go stale."""
        if self._transforms is None or self._player.playing:
            return
        held = copy.deepcopy(self._transforms)
        for transform in held.transforms:
            transform.header.stamp = self.get_clock().now().to_msg()
        self._outputs[TRANSFORMS].publish(held)

    def _play_failed(self, error: Exception) -> None:
        self.get_logger().error(f'playing ended: {error}')

    # Diagnostics.

    def _on_diagnostics(self) -> None:
        settings = self._configuration.settings
        planning, waiting = self._planning.load
        hand = settings.hand_file if self._configuration.hand is not None else ''
        recorder = self._keeper.state(1e6 * settings.disk_space_warning)
        stamp = self.get_clock().now().to_msg()
        planner = PlannerState(hand, planning, waiting, self._last_plan)
        self._diagnostics.publish(diagnostic_array(self.get_name(), stamp, planner, recorder))

    def _now(self) -> int:
        return int(self.get_clock().now().nanoseconds)


def main(args: Sequence[str] | None = None) -> int:
    """Run the node until SIGINT or SIGTERM.

    Args:
        args: Command line with the program's name first; that of the process by default.

    Returns:
        Exit status: 0 after a signal, 2 if the node cannot start with these arguments.
    """
    wake: queue.SimpleQueue[BaseException | None] = queue.SimpleQueue()

    def on_signal(number: int, frame: FrameType | None) -> None:
        # The next one ends the process in any case.
        signal.signal(number, signal.SIG_DFL)
        wake.put(None)

    before = {
        number: signal.signal(number, on_signal) for number in (signal.SIGINT, signal.SIGTERM)
    }
    try:
        try:
            rclpy.init(
                args=None if args is None else list(args),
                signal_handler_options=SignalHandlerOptions.NO,
            )
        except (RuntimeError, ValueError) as error:
            print(f'{NAME}: {error}', file=sys.stderr)
            return 2
        try:
            return _run(wake)
        finally:
            rclpy.shutdown()
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)


def _run(wake: queue.SimpleQueue[BaseException | None]) -> int:
    try:
        # The first request shall not wait for it, nor find that it is missing.
        import_toppra()
        node = PlannerNode()
    except (CfplanError, ParameterException) as error:
        get_logger(NAME).fatal(str(error))
        return 2
    executor = SingleThreadedExecutor()
    executor.add_node(node)

    def spin() -> None:
        try:
            executor.spin()
        except BaseException as error:
            wake.put(error)

    spinning = threading.Thread(target=spin, name='executor', daemon=True)
    spinning.start()
    node.get_logger().info(node.introduction())
    # Plain queues of Python can be filled by a signal handler, and waiting for one lets it run.
    failure = wake.get()
    node.stop()
    executor.shutdown(timeout_sec=_PATIENCE)
    spinning.join(_PATIENCE)
    node.destroy_node()
    if failure is not None:
        raise failure
    return 0


def _shortened(text: str, most: int = 200) -> str:
    """Return a text that fits into a log."""
    return text if len(text) <= most else f'{text[:most]}... ({len(text)} characters)'


def _private(topic: str) -> str:
    return topic if topic.startswith('/') else f'~/{topic}'


if __name__ == '__main__':
    sys.exit(main())
