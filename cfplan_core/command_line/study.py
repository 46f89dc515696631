"""``cfplan study``: plan and execute over many parameters, on many processors or machines."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from cfplan_core.command_line.console import answers, complain
from cfplan_core.command_line.inputs import examine
from cfplan_core.command_line.outputs import PICTURES, check_outputs, check_suffix
from cfplan_core.command_line.progress import progress_bar
from cfplan_core.errors import CfplanError

if TYPE_CHECKING:
    from rich.progress import Progress as Bar

    from cfplan_core.study.design import StudyRun
    from cfplan_core.study.log import StudyLog
    from cfplan_core.study.record import Record

FAILED = 1


@click.command(short_help='Plan and execute over many parameters.')
@click.argument('files', nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option(
    '-o',
    '--output',
    'log_path',
    required=True,
    type=click.Path(dir_okay=False, path_type=Path),
    metavar='CSV',
    help='Write a row for each run as it ends; runs that the file has already are not repeated.',
)
@click.option(
    '--vary',
    'variations',
    multiple=True,
    metavar='NAME=VALUES',
    help='Values with commas between, for a grid, or LOW:HIGH to draw from; may be given again. '
    'A wrong NAME lists those that there are.',
)
@click.option(
    '--samples',
    type=click.IntRange(min=1),
    default=1,
    show_default=True,
    metavar='N',
    help='Runs of each combination of values, each with other draws and other errors.',
)
@click.option(
    '--seed',
    type=click.IntRange(min=0),
    default=0,
    show_default=True,
    metavar='S',
    help='Of what is drawn.',
)
@click.option(
    '--workers',
    type=click.IntRange(min=1),
    metavar='N',
    help='Processes on this machine; without it as many as processors.',
)
@click.option(
    '--scheduler',
    metavar='ADDRESS',
    help='Run on the workers of this dask scheduler instead, e.g. tcp://HOST:8786.',
)
@click.option(
    '--attempts',
    type=click.IntRange(min=1),
    default=3,
    show_default=True,
    metavar='N',
    help='Record a run as failed after so many lost workers or errors.',
)
@click.option('--retry-failed', is_flag=True, help='Repeat runs that are recorded as failed.')
@click.option(
    '--parquet',
    'parquet_path',
    type=click.Path(dir_okay=False, path_type=Path),
    metavar='OUT',
    help='Write the rows of this study as Parquet at the end.',
)
@click.option(
    '--figure',
    'figure_path',
    type=click.Path(dir_okay=False, path_type=Path),
    metavar='OUT',
    help='Draw success against each parameter, as .png, .pdf or .svg.',
)
def study(
    files: tuple[Path, ...],
    log_path: Path,
    variations: tuple[str, ...],
    samples: int,
    seed: int,
    workers: int | None,
    scheduler: str | None,
    attempts: int,
    retry_failed: bool,
    parquet_path: Path | None,
    figure_path: Path | None,
) -> int:
    """Plan and execute the problems FILES over a grid and a sample of parameters.

    A study that was interrupted, killed or cut off goes on where it stopped when the same command
    is given again. The file of a complete study does not depend on the number of workers.

    Exit status: 0 all runs ended, in the goal grasp or not, 1 some failed, 2 invalid input or
    usage, 130 interrupted.
    """
    from cfplan_core.execution.scene import import_mujoco
    from cfplan_core.report.study_tables import study_tables
    from cfplan_core.study.cluster import import_distributed, start_fork_server
    from cfplan_core.study.design import design_study
    from cfplan_core.study.log import StudyLog
    from cfplan_core.study.parameters import parse_variations
    from cfplan_core.study.record import Verdict

    check_suffix('--figure', figure_path, PICTURES)
    check_outputs(
        {'--output': log_path, '--parquet': parquet_path, '--figure': figure_path}, files
    )
    if scheduler is not None and workers is not None:
        raise CfplanError(
            f'--workers: got {workers} beside --scheduler, expected none: its workers are there'
        )
    try:
        varied = parse_variations(variations)
    except CfplanError as error:
        raise CfplanError(f'--vary: {error}') from None
    if scheduler is None:
        start_fork_server()
    problems = [examine(file).valid_problem() for file in files]
    runs = design_study(problems, varied, samples, seed)
    import_distributed()
    import_mujoco()
    if parquet_path is not None:
        from cfplan_core.study.parquet import import_pyarrow

        import_pyarrow()
    with StudyLog(log_path) as log:
        if retry_failed:
            log.forget(run.key for run in runs if _has_failed(log, run))
        try:
            _run(runs, log, workers, scheduler, attempts)
        except KeyboardInterrupt:
            ended = len(_ended(runs, log))
            complain(f'{ended} of {len(runs)} runs are in {log_path}; the same command goes on')
            raise
        log.sort()
        records = _ended(runs, log)
    answers().print(study_tables(records))
    _write(records, parquet_path, figure_path)
    return FAILED if any(record.verdict is Verdict.FAILED for record in records) else 0


def _has_failed(log: StudyLog, run: StudyRun) -> bool:
    from cfplan_core.study.record import Verdict

    record = log.records.get(run.key)
    return record is not None and record.verdict is Verdict.FAILED


def _ended(runs: Sequence[StudyRun], log: StudyLog) -> list[Record]:
    return [log.records[run.key] for run in runs if run.key in log.records]


def _run(
    runs: Sequence[StudyRun],
    log: StudyLog,
    workers: int | None,
    scheduler: str | None,
    attempts: int,
) -> None:
    from cfplan_core.study.cluster import run_study

    with progress_bar() as bar:
        shown = None if bar is None else _shown_on(bar, runs, log)
        run_study(runs, log, workers=workers, scheduler=scheduler, attempts=attempts, done=shown)


def _shown_on(bar: Bar, runs: Sequence[StudyRun], log: StudyLog) -> Callable[[Record], None]:
    """Make the function that takes the records to the bar."""
    from cfplan_core.study.record import Verdict

    verdicts = Counter(record.verdict for record in _ended(runs, log))
    task = bar.add_task('starting workers', total=len(runs), completed=verdicts.total())

    def show(record: Record) -> None:
        verdicts[record.verdict] += 1
        ended = verdicts.total()
        successes = verdicts[Verdict.IN_GOAL]
        description = f'{ended} of {len(runs)} runs, {successes} in the goal'
        bar.update(task, completed=ended, description=description)

    return show


def _write(records: Sequence[Record], parquet_path: Path | None, figure_path: Path | None) -> None:
    """Write the files that were asked for, and say which."""
    if parquet_path is not None:
        from cfplan_core.study.parquet import write_parquet

        write_parquet(records, parquet_path)
        answers().print(f'Parquet: {parquet_path}', soft_wrap=True)
    if figure_path is not None:
        from cfplan_core.report.figures.saving import save_figure
        from cfplan_core.report.figures.study import study_figure

        save_figure(study_figure(records), figure_path)
        answers().print(f'Figure: {figure_path}', soft_wrap=True)
