"""The runs of a study on the workers of dask.distributed, of this machine or of many."""

from __future__ import annotations

import logging
import multiprocessing
import os
import signal
import threading
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from itertools import islice
from multiprocessing import forkserver
from types import ModuleType
from typing import Any

from cfplan_core.errors import CfplanError
from cfplan_core.study.design import StudyRun
from cfplan_core.study.log import StudyLog
from cfplan_core.study.record import Record, Verdict, record_of
from cfplan_core.study.running import run_once

ATTEMPTS = 3
"""How often a run is tried before it is recorded as failed, unless asked otherwise."""

LOOPBACK = '127.0.0.1'
_CONNECTING = 10.0
# Runs that the scheduler knows of at a time: enough for hundreds of workers, and little memory.
_IN_FLIGHT = 1000


def import_distributed() -> ModuleType:
    """Import dask.distributed.

    Raises:
        CfplanError: It is not installed.
    """
    try:
        import distributed
    except ImportError as error:
        raise CfplanError(
            f'a study needs dask.distributed: {error}; install it with '
            "pip install 'cfplan_ros[study]', or pip install distributed"
        ) from error
    module: ModuleType = distributed
    return module


def available_workers() -> int:
    """Count the processors that this process may use."""
    return len(os.sched_getaffinity(0))


def run_study(
    runs: Sequence[StudyRun],
    log: StudyLog,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    attempts: int = ATTEMPTS,
    done: Callable[[Record], None] | None = None,
    execute: Callable[[StudyRun], Record] = run_once,
) -> None:
    """Run what is not in the log yet, and log every run as it ends.

    A run whose worker is lost, or that raises, is tried again. On a scheduler that others run,
    its own ``allowed-failures`` says how many workers a run may lose.

    Args:
        runs: With different keys.
        log: Of the study.
        workers: Processes of one thread on this machine; as many as processors if None.
        scheduler: Address of a scheduler to use instead.
        attempts: How often a run is tried before it is recorded as failed.
        done: Called with every record once it is on disk.
        execute: What a worker does.

    Raises:
        CfplanError: dask.distributed is missing, or no scheduler answers.
        OSError: The log cannot be written.
    """
    missing = [run for run in runs if run.key not in log.records]
    if not missing:
        return
    with _connected(scheduler, workers, len(missing), attempts) as client:
        for record in _records(client, missing, attempts, execute):
            log.append(record)
            if done is not None:
                done(record)


def _records(
    client: Any,
    runs: Sequence[StudyRun],
    attempts: int,
    execute: Callable[[StudyRun], Record],
) -> Iterator[Record]:
    """Give the records of runs in the order in which they end."""
    waiting = iter(runs)

    def submit(count: int) -> list[Any]:
        futures = []
        for run in islice(waiting, count):
            # The run goes along whole: data held by a worker would be lost with it.
            future = client.submit(execute, run, key=f'cfplan-{run.key}', retries=attempts - 1)
            run_of[future.key] = run
            futures.append(future)
        return futures

    run_of: dict[str, StudyRun] = {}
    ending = import_distributed().as_completed(submit(_IN_FLIGHT))
    for future in ending:
        yield _record(run_of.pop(future.key), future, attempts)
        future.release()
        ending.update(submit(1))


def _record(run: StudyRun, future: Any, attempts: int) -> Record:
    """Take the record of a run that ended, or record why there is none."""
    if future.status == 'finished':
        record: Record = future.result()
        return record
    if future.status != 'error':
        raise CfplanError(
            f'the scheduler is gone, or has dropped a run ({future.status}); the runs that ended '
            'are in the file, the same command goes on'
        )
    error = future.exception()
    if isinstance(error, import_distributed().KilledWorker):
        reason = f'its worker was lost {attempts} times'
    else:
        reason = f'tried {attempts} times: {type(error).__name__}: {error}'
    return record_of(run, Verdict.FAILED, reason=reason)


@contextmanager
def _connected(
    scheduler: str | None, workers: int | None, runs: int, attempts: int
) -> Iterator[Any]:
    """Connect to a scheduler, or start one on this machine, with workers."""
    if scheduler is None:
        start_fork_server()
    distributed = import_distributed()
    # What becomes of workers is in the log of the study.
    for name in ('distributed', 'distributed.client'):
        logging.getLogger(name).setLevel(logging.CRITICAL)
    if scheduler is not None:
        try:
            client = distributed.Client(scheduler, timeout=_CONNECTING)
        except (OSError, ValueError, TypeError) as error:
            raise CfplanError(f'no scheduler answers at {scheduler}: {error}') from None
        with client:
            yield client
        return
    count = min(runs, workers if workers is not None else available_workers())
    with _local_cluster(count, attempts) as cluster, distributed.Client(cluster) as client:
        client.register_plugin(_deaf_to_interrupts())
        yield client


def start_fork_server() -> None:
    """Start the process that workers of this machine are forked from, unless there is one.

    It imports what they need: whoever has something to do before `run_study` calls this first.
    """
    context = multiprocessing.get_context('forkserver')
    context.set_forkserver_preload(['cfplan_core.study.worker_imports'])
    with _on_interrupt(signal.SIG_IGN):
        # It leaves Ctrl-C, which it gets too, to the study, and so do those that it forks.
        forkserver.ensure_running()


@contextmanager
def _on_interrupt(handler: Any) -> Iterator[None]:
    """Have Ctrl-C do something else for a while; only the main thread can change that."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, handler)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


@contextmanager
def _local_cluster(workers: int, attempts: int) -> Iterator[Any]:
    import dask

    distributed = import_distributed()
    settings = {
        'distributed.worker.multiprocessing-method': 'forkserver',
        'distributed.scheduler.allowed-failures': attempts - 1,
        # No run is held by a worker that is busy with another: it would share that one's fate.
        'distributed.scheduler.worker-saturation': 1.0,
        'distributed.scheduler.http.routes': [],
        'distributed.worker.http.routes': [],
        'distributed.worker.profile.enabled': False,
    }
    interrupts: list[int] = []
    # The settings hold for workers that are started anew, too.
    with dask.config.set(settings), ExitStack() as stack:
        # A cluster that is interrupted while it starts cannot be closed.
        with _on_interrupt(lambda *_: interrupts.append(signal.SIGINT)), warnings.catch_warnings():
            # The port that the scheduler would like to have may be taken; nobody needs it.
            warnings.filterwarnings('ignore', message='Port .* is already in use')
            cluster = distributed.LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                processes=True,
                host=LOOPBACK,
                dashboard_address=None,
                memory_limit=0,
                silence_logs=logging.CRITICAL,
            )
            stack.enter_context(cluster)
        if interrupts:
            raise KeyboardInterrupt
        yield cluster


def _deaf_to_interrupts() -> Any:
    """Make what lets workers of this machine leave Ctrl-C, which they get too, to the study."""

    class DeafToInterrupts(import_distributed().WorkerPlugin):  # type: ignore[misc]
        name = 'deaf-to-interrupts'

        def setup(self, worker: object) -> None:
            signal.signal(signal.SIGINT, signal.SIG_IGN)

    return DeafToInterrupts()
