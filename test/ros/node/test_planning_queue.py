from __future__ import annotations

import threading

from cfplan_ros.planning_queue import Admission, JobQueue

TIMEOUT = 10.0


class Gate:
    """Serves jobs that wait for it to open."""

    def __init__(self) -> None:
        self.entered = threading.Event()
        self.open = threading.Event()
        self.served: list[int] = []

    def serve(self, job: int) -> None:
        self.entered.set()
        assert self.open.wait(TIMEOUT)
        self.served.append(job)


def test_jobs_are_served_in_the_order_of_their_arrival() -> None:
    gate = Gate()
    jobs = JobQueue(gate.serve, 'test')
    assert [jobs.submit(k, 10) for k in range(5)] == [Admission.ACCEPTED] * 5
    gate.open.set()
    assert jobs.wait_until_idle(TIMEOUT)
    assert gate.served == [0, 1, 2, 3, 4]
    jobs.close()


def test_job_beyond_the_capacity_is_not_taken() -> None:
    gate = Gate()
    jobs = JobQueue(gate.serve, 'test')
    jobs.submit(0, 1)
    assert gate.entered.wait(TIMEOUT)
    assert jobs.submit(1, 1) is Admission.ACCEPTED
    assert jobs.submit(2, 1) is Admission.FULL
    gate.open.set()
    assert jobs.wait_until_idle(TIMEOUT)
    assert gate.served == [0, 1]
    jobs.close()


def test_without_capacity_one_job_is_taken() -> None:
    gate = Gate()
    jobs = JobQueue(gate.serve, 'test')
    assert jobs.submit(0, 0) is Admission.ACCEPTED
    assert jobs.submit(1, 0) is Admission.FULL
    gate.open.set()
    assert jobs.wait_until_idle(TIMEOUT)
    assert jobs.submit(2, 0) is Admission.ACCEPTED
    jobs.close()


def test_closed_queue_serves_what_waits_and_takes_nothing_more() -> None:
    gate = Gate()
    jobs = JobQueue(gate.serve, 'test')
    jobs.submit(0, 10)
    jobs.submit(1, 10)
    jobs.close()
    assert jobs.canceled.is_set()
    assert jobs.submit(2, 10) is Admission.CLOSED
    gate.open.set()
    assert jobs.join(TIMEOUT)
    assert gate.served == [0, 1]


def test_load_counts_what_is_served_and_what_waits() -> None:
    gate = Gate()
    jobs = JobQueue(gate.serve, 'test')
    assert jobs.load == (False, 0)
    jobs.submit(0, 10)
    assert gate.entered.wait(TIMEOUT)
    jobs.submit(1, 10)
    assert jobs.load == (True, 1)
    assert not jobs.wait_until_idle(0.0)
    gate.open.set()
    jobs.close()
