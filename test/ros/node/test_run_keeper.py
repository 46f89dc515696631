"""What becomes of plans that are not shown yet when the node ends."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from ros.recording.example import NODE, START, Example, example

from cfplan_ros.parameters import DEFAULTS
from cfplan_ros.planning_queue import JobQueue
from cfplan_ros.run_keeper import RunKeeper


@pytest.fixture
def planning() -> Iterator[JobQueue[Any]]:
    queue: JobQueue[Any] = JobQueue(lambda job: None, 'planning')
    yield queue
    queue.close()


def test_run_that_ends_after_the_publishers_is_completed_all_the_same(
    planning: JobQueue[Any], tmp_path: Path
) -> None:
    complaints: list[str] = []
    solved: Example = example()

    def publish(topic: str, message: Any) -> None:
        raise RuntimeError('the publisher is gone')

    keeper = RunKeeper(NODE, publish, planning, complaints.append)
    keeper.apply(replace(DEFAULTS, record_directory=str(tmp_path)))
    run = keeper.begin(solved.request, solved.metadata, START)
    keeper.keep(run, solved.response, solved.essentials)
    planning.close()
    keeper.close(20.0)
    keeper.finish(run, solved.problem, solved.response.plan)

    assert complaints == []
    (file,) = tmp_path.iterdir()
    with file.open('rb') as stream:
        count = len(list(make_reader(stream).iter_messages()))
    assert count == 2 + len(solved.essentials) + len(list(solved.preview()))
