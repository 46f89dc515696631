"""Runs on workers: none is lost with its worker, none is repeated, and nobody else can listen."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil
import pytest

from cfplan_core import CfplanError
from cfplan_core.study.cluster import _local_cluster, run_study
from cfplan_core.study.design import StudyRun
from cfplan_core.study.log import StudyLog
from cfplan_core.study.record import Record, Verdict, record_of

distributed = pytest.importorskip('distributed')

Design = Callable[..., tuple[StudyRun, ...]]


@pytest.fixture
def log(tmp_path: Path) -> Iterator[StudyLog]:
    with StudyLog(tmp_path / 'study.csv') as opened:
        yield opened


def _workers() -> list[psutil.Process]:
    """The workers that this process has started."""
    servers = [p for p in psutil.Process().children() if 'forkserver' in ' '.join(p.cmdline())]
    return [worker for server in servers for worker in server.children()]


def _quick(delay: float = 0.0) -> Callable[[StudyRun], Record]:
    """Make a run that does nothing but wait."""

    def execute(run: StudyRun) -> Record:
        import time

        time.sleep(delay)
        return record_of(run, Verdict.IN_GOAL)

    return execute


def test_runs_of_a_killed_worker_are_run_again(design: Design, log: StudyLog) -> None:
    runs = design('friction=0,0.1', samples=10)
    records: list[Record] = []

    def kill_after_three(record: Record) -> None:
        records.append(record)
        if len(records) == 3:
            _workers()[0].kill()

    run_study(runs, log, workers=2, done=kill_after_three, execute=_quick(0.05))
    assert sorted(r.key for r in records) == sorted(r.key for r in runs)
    assert {r.verdict for r in records} == {Verdict.IN_GOAL}
    assert not _workers()


def test_run_that_fails_each_time_is_recorded_with_why_and_spares_the_others(
    design: Design, log: StudyLog
) -> None:
    runs = design('friction=0,0.1,0.2')
    raising, deadly = runs[1].key, runs[4].key

    def execute(run: StudyRun) -> Record:
        if run.key == raising:
            raise ZeroDivisionError('no such\nluck')
        if run.key == deadly:
            os._exit(1)
        return record_of(run, Verdict.IN_GOAL)

    run_study(runs, log, workers=1, attempts=2, execute=execute)
    assert set(log.records) == {run.key for run in runs}
    failed = {k: r.reason for k, r in log.records.items() if r.verdict is Verdict.FAILED}
    assert failed == {
        raising: 'tried 2 times: ZeroDivisionError: no such luck',
        deadly: 'its worker was lost 2 times',
    }


def test_all_listens_on_the_loopback_interface_alone(design: Design, log: StudyLog) -> None:
    heard: set[str] = set()

    def listen(_: Record) -> None:
        for process in (psutil.Process(), *_workers()):
            for socket in process.net_connections('inet'):
                if socket.status == psutil.CONN_LISTEN:
                    heard.add(socket.laddr.ip)

    run_study(design(), log, workers=1, done=listen, execute=_quick())
    assert heard == {'127.0.0.1'}


def test_runs_in_the_log_are_not_repeated(design: Design, log: StudyLog) -> None:
    runs = design('friction=0,0.1')
    for run in runs[:3]:
        log.append(record_of(run, Verdict.MISSED))
    done: list[Record] = []
    with _local_cluster(workers=1, attempts=1) as cluster:
        address = cluster.scheduler_address
        run_study(runs, log, scheduler=address, done=done.append, execute=_quick())
    assert [record.key for record in done] == [runs[3].key]


def test_complete_study_needs_no_workers(
    design: Design, log: StudyLog, monkeypatch: pytest.MonkeyPatch
) -> None:
    for run in design():
        log.append(record_of(run, Verdict.MISSED))
    monkeypatch.setitem(sys.modules, 'distributed', None)
    run_study(design(), log)


def test_missing_dask_is_named_with_what_to_do(
    design: Design, log: StudyLog, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, 'distributed', None)
    with pytest.raises(CfplanError, match=r"pip install 'cfplan_ros\[study\]'"):
        run_study(design(), log)


@pytest.mark.parametrize('address', ['nonsense://a', '127.0.0.1:1'])
def test_scheduler_that_does_not_answer_is_named(
    design: Design, log: StudyLog, address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr('cfplan_core.study.cluster._CONNECTING', 0.5)
    with pytest.raises(CfplanError, match=f'no scheduler answers at {address}'):
        run_study(design(), log, scheduler=address)


def test_scheduler_that_drops_runs_leaves_those_that_ended(design: Design, log: StudyLog) -> None:
    def gone(_: Record) -> None:
        client = distributed.default_client()
        client.cancel([distributed.Future(key, client) for key in client.futures], force=True)

    runs = design('friction=0,0.1', samples=5)
    with pytest.raises(CfplanError, match='the same command goes on'):
        run_study(runs, log, workers=1, done=gone, execute=_quick(0.1))
    assert 1 <= len(log.records) < len(runs)
