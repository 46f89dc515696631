"""What becomes of a plan once it is found: its run is recorded, and viewers are shown it.

Only the essential part of a recording is written before the answer goes out. What viewers are
shown costs as much as some searches, and Python computes one thing at a time: it is computed on a
thread of its own that leaves precedence to planning.
"""

from __future__ import annotations

import time
import traceback
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

from cfplan_core import Problem
from cfplan_ros.conversions.times import nanoseconds_of
from cfplan_ros.diagnostics import RecorderState
from cfplan_ros.parameters import Settings
from cfplan_ros.planning_queue import Admission, JobQueue
from cfplan_ros.planning_service import SCENE, pictures
from cfplan_ros.recording.recorder import Recorder, Run
from cfplan_ros.visualization.preview import TRANSFORMS

# Planning must have rested for so long before viewers are shown a plan, s, but after so long it
# is shown in any case, s.
_QUIET = 0.1
_STAND_BACK = 10.0
# So many runs may wait to be completed; of more the planning thread takes care itself.
_MOST_UNFINISHED = 64


class RunKeeper:
    """Records runs and shows plans.

    Args:
        node_name: Fully qualified name of the node.
        publish: Called with topic and message, from the keeper's thread.
        planning: Has precedence.
        log: Takes a line on what went wrong.
    """

    def __init__(
        self,
        node_name: str,
        publish: Callable[[str, Any], None],
        planning: JobQueue[Any],
        log: Callable[[str], object],
    ) -> None:
        self._node_name = node_name
        self._publish = publish
        self._planning = planning
        self._log = log
        self._recorder: Recorder | None = None
        self._failure = ''
        self._finishing: JobQueue[Callable[[], object]] = JobQueue(lambda job: job(), 'finishing')

    def apply(self, settings: Settings) -> None:
        """Record as the settings say from the next run on, and recover what is left over."""
        if not settings.record:
            self._recorder = None
        elif self._recorder is None or self._recorder.directory != Path(settings.record_directory):
            self._recorder = Recorder(settings.record_directory, self._node_name, self._log)
            self._finishing.submit(
                partial(self._recorder.recover_left_over, pictures), _MOST_UNFINISHED
            )

    def begin(self, request: Any, metadata: dict[str, object], time_ns: int) -> Run | None:
        """Start to record a run; None if runs are not recorded."""
        recorder = self._recorder
        return None if recorder is None else recorder.begin(request, metadata, time_ns)

    def keep(self, run: Run | None, response: Any, messages: list[tuple[str, Any]]) -> None:
        """Write what a run is about; the response tells afterwards whether that went well.

        Args:
            run: From `begin`.
            response: To be answered.
            messages: Topic and message of the plan.
        """
        if run is None:
            return
        response.record = run.name
        stamp = nanoseconds_of(response.plan.header.stamp)
        self._failure = run.finish_essential(response, stamp, messages)
        if self._failure:
            response.record = ''
            before = f'{response.error_msg}\n' if response.error_msg else ''
            response.error_msg = f'{before}the run is not recorded: {self._failure}'

    def finish(self, run: Run | None, problem: Problem | None, plan: Any) -> None:
        """Show a plan and complete the file of its run, soon.

        Args:
            run: From `begin`.
            problem: None if the request was invalid.
            plan: As message; without points there is nothing to show.
        """
        job = partial(self._finish, run, problem, plan)
        if self._finishing.submit(partial(job, _STAND_BACK), _MOST_UNFINISHED) is not (
            Admission.ACCEPTED
        ):
            job(0.0)

    def state(self, space_warning: float) -> RecorderState:
        """Say what became of the last run.

        Args:
            space_warning: Bytes left on the disk below which to warn.
        """
        recorder = self._recorder
        return RecorderState(
            directory='' if recorder is None else str(recorder.directory),
            last_file='' if recorder is None else recorder.last_file,
            last_failure=self._failure,
            free_space=None if recorder is None else recorder.free_space(),
            space_warning=space_warning,
        )

    def close(self, timeout: float) -> None:
        """Complete the files, within `timeout` s; the next start completes what remains."""
        self._finishing.close()
        self._finishing.join(timeout)

    def _show(self, topic: str, message: Any) -> None:
        # Once the keeper is closed the publishers may be gone; the files are still completed.
        if not self._finishing.canceled.is_set():
            self._publish(topic, message)

    def _finish(
        self, run: Run | None, problem: Problem | None, plan: Any, stand_back: float
    ) -> None:
        until = time.monotonic() + stand_back
        shown: Iterator[tuple[int, str, Any]] = iter(())
        if problem is not None:
            shown = pictures(problem, plan, nanoseconds_of(plan.header.stamp))
        try:
            while True:
                self._planning.wait_until_idle(until - time.monotonic(), _QUIET)
                picture = next(shown, None)
                if picture is None:
                    break
                due, topic, message = picture
                at_start = due == nanoseconds_of(plan.header.stamp)
                if topic in SCENE or (topic == TRANSFORMS and at_start):
                    self._show(topic, message)
                elif run is None or run.failure:
                    break
                if run is not None:
                    run.add(topic, message, due)
        except Exception:
            self._log(f'a plan is not shown:\n{traceback.format_exc()}')
        failure = '' if run is None else run.close()
        if failure and not self._failure:
            self._failure = failure
            self._log(f'the run is not recorded to its end: {failure}')
