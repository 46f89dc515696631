from __future__ import annotations

import errno
import os
import resource
import shutil
import subprocess
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from ros.recording.example import NODE, START, example, not_solved, recorder

from cfplan_ros.recording.reading import read_run
from cfplan_ros.recording.recorder import Recorder, Run
from cfplan_ros.recording.run_file import RunFile


def _record(into: Recorder) -> Run:
    run = example().begin(into)
    example().answer(run)
    run.close()
    return run


def _descriptors() -> int:
    return len(os.listdir('/proc/self/fd'))


def test_finished_run_is_a_complete_file_of_the_name_it_was_given(tmp_path: Path) -> None:
    run = _record(recorder(tmp_path))
    assert [path.name for path in tmp_path.iterdir()] == [run.name]
    assert read_run(tmp_path / run.name).complete


def test_file_has_no_final_name_before_it_is_closed(tmp_path: Path) -> None:
    run = example().begin(recorder(tmp_path))
    assert [path.name for path in tmp_path.iterdir()] == [f'{run.name}.part']
    run.close()


def test_request_is_in_the_file_when_planning_begins(tmp_path: Path) -> None:
    run = example().begin(recorder(tmp_path))
    held = read_run(tmp_path / f'{run.name}.part')
    assert held.request == example().request
    assert held.metadata['node'] == NODE
    run.close()


def test_answer_is_in_the_file_before_it_goes_out(tmp_path: Path) -> None:
    run = example().begin(recorder(tmp_path))
    example().answer(run)
    held = read_run(tmp_path / f'{run.name}.part')
    assert held.response == example().response
    assert held.count == 2 + len(example().essentials)
    run.close()


def test_run_without_a_plan_is_recorded(tmp_path: Path) -> None:
    run = example().begin(recorder(tmp_path))
    assert run.finish_essential(not_solved(), START + 1) == ''
    run.close()
    held = read_run(tmp_path / run.name)
    assert held.response == not_solved()
    assert held.count == 2


def test_run_that_is_never_answered_keeps_its_request(tmp_path: Path) -> None:
    run = example().begin(recorder(tmp_path))
    run.close()
    held = read_run(tmp_path / run.name)
    assert held.complete
    assert held.request is not None
    assert held.response is None


def test_runs_of_one_second_have_names_of_their_own(tmp_path: Path) -> None:
    into = recorder(tmp_path)
    names = {_record(into).name for _ in range(5)}
    assert {path.name for path in tmp_path.iterdir()} == names
    assert len(names) == 5


def test_nodes_that_share_a_directory_never_share_a_file(tmp_path: Path) -> None:
    recorders = [recorder(tmp_path) for _ in range(4)]
    names: list[str] = []
    barrier = threading.Barrier(len(recorders))

    def work(into: Recorder) -> None:
        barrier.wait(timeout=20)
        names.extend(_record(into).name for _ in range(5))

    threads = [threading.Thread(target=work, args=(each,)) for each in recorders]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=60)
    assert len(set(names)) == 20
    assert {path.name for path in tmp_path.iterdir()} == set(names)
    assert all(read_run(path).complete for path in tmp_path.iterdir())


def test_names_hold_the_utc_time_and_nothing_of_the_request(tmp_path: Path) -> None:
    run = _record(recorder(tmp_path))
    stem, suffix = run.name.split('.')
    word, time, counter = stem.split('_')
    assert (word, counter, suffix) == ('run', '0001', 'mcap')
    assert (len(time), time[8], time[-1]) == (16, 'T', 'Z')


def test_one_thread_may_finish_a_run_while_another_begins_the_next(tmp_path: Path) -> None:
    into = recorder(tmp_path)
    first = example().begin(into)
    example().answer(first)
    finishing = threading.Thread(target=lambda: (example().play(first), first.close()))
    finishing.start()
    second = _record(into)
    finishing.join(timeout=30)
    assert read_run(tmp_path / first.name).count > read_run(tmp_path / second.name).count
    assert read_run(tmp_path / first.name).complete


def test_messages_after_the_close_are_ignored(tmp_path: Path) -> None:
    run = _record(recorder(tmp_path))
    before = (tmp_path / run.name).read_bytes()
    example().play(run)
    assert run.close() == ''
    assert (tmp_path / run.name).read_bytes() == before


def test_directory_is_created(tmp_path: Path) -> None:
    run = _record(recorder(tmp_path / 'a' / 'b'))
    assert (tmp_path / 'a' / 'b' / run.name).exists()


def test_free_space_is_that_of_the_disk(tmp_path: Path) -> None:
    free = recorder(tmp_path).free_space()
    assert free == pytest.approx(shutil.disk_usage(tmp_path).free, rel=0.05)
    assert recorder(tmp_path / 'missing').free_space() is None


def test_directory_that_is_a_file_is_a_reason(tmp_path: Path) -> None:
    (tmp_path / 'runs').write_text('')
    into = recorder(tmp_path / 'runs')
    run = example().begin(into)
    assert run.failure == f'{tmp_path / "runs"}: Not a directory'
    assert run.name == ''
    assert into.last_failure == run.failure


def test_run_that_could_not_begin_takes_everything_and_says_why(tmp_path: Path) -> None:
    (tmp_path / 'runs').write_text('')
    run = example().begin(recorder(tmp_path / 'runs'))
    example().play(run)
    assert example().answer(run) == run.close() == run.failure != ''


@pytest.fixture
def mounted(tmp_path: Path) -> Iterator[Callable[[str], Path]]:
    """Mounts small file systems, for root only."""
    places: list[Path] = []

    def mount(options: str) -> Path:
        place = tmp_path / f'mounted{len(places)}'
        place.mkdir()
        command = ['mount', '-t', 'tmpfs', '-o', options, 'tmpfs', str(place)]
        if subprocess.run(command, capture_output=True, timeout=20, check=False).returncode:
            pytest.skip('mounting a file system takes root')
        places.append(place)
        return place

    yield mount
    for place in places:
        subprocess.run(['umount', str(place)], capture_output=True, timeout=20, check=False)


def test_read_only_directory_is_a_reason(mounted: Callable[[str], Path]) -> None:
    place = mounted('ro')
    run = example().begin(recorder(place))
    assert run.failure.startswith(f'{place}/run_')
    assert run.failure.endswith('Read-only file system')


@pytest.mark.skipif(os.geteuid() == 0, reason='root may write everywhere')
def test_directory_without_permission_is_a_reason(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    run = example().begin(recorder(tmp_path))
    assert run.failure.endswith('Permission denied')


@pytest.mark.parametrize('space', [0, 4, 8, 16, 24, 32, 48, 64])
def test_full_disk_is_a_reason_and_costs_nothing_that_was_written(
    mounted: Callable[[str], Path], space: int
) -> None:
    place = mounted('size=256k')
    into = recorder(place)
    kept = _record(into)
    _fill(place, leave=space * 1024)
    descriptors = _descriptors()
    run = example().begin(into)
    reasons = [run.failure, example().answer(run)]
    answered = not reasons[-1]
    example().play(run)
    reasons.append(run.close())
    assert reasons[-1].endswith('bytes free)')
    assert 'No space left on device' in reasons[-1]
    assert str(place) in reasons[-1]
    assert into.last_failure == reasons[-1]
    assert _descriptors() == descriptors
    assert read_run(place / kept.name).complete
    assert bool(run.name) == answered
    if answered:
        assert read_run(place / f'{run.name}.part').response == example().response


def _fill(place: Path, leave: int) -> None:
    with (place / 'filler').open('wb', buffering=0) as filler:
        try:
            while True:
                filler.write(b'x' * 4096)
        except OSError:
            size = filler.tell() - leave
    os.truncate(place / 'filler', size)


def test_recorder_works_again_when_there_is_space(mounted: Callable[[str], Path]) -> None:
    place = mounted('size=512k')
    into = recorder(place)
    _fill(place, leave=0)
    assert _record(into).failure
    (place / 'filler').unlink()
    run = _record(into)
    assert run.failure == ''
    assert read_run(place / run.name).complete


@pytest.mark.parametrize('size', [0, 3_000, 12_000, 20_000, 40_000])
def test_file_that_may_not_grow_is_a_reason_and_keeps_what_it_holds(
    tmp_path: Path, size: int
) -> None:
    into, limits = recorder(tmp_path), resource.getrlimit(resource.RLIMIT_FSIZE)
    descriptors = _descriptors()
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        run = example().begin(into)
        reason = example().answer(run)
        example().play(run)
        run.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert 'File too large' in run.failure
    assert _descriptors() == descriptors
    parts = list(tmp_path.iterdir())
    assert [read_run(path).response is not None for path in parts] in ([], [not reason])


@pytest.mark.parametrize('call', ['fsync', 'rename'])
def test_error_of_any_call_is_a_reason_and_leaves_the_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, call: str
) -> None:
    into = recorder(tmp_path)
    run = example().begin(into)
    example().answer(run)
    descriptors = _descriptors()

    def fail(*_: Any) -> None:
        raise OSError(errno.EIO, os.strerror(errno.EIO))

    with monkeypatch.context() as patched:
        patched.setattr(os, call, fail)
        reason = run.close()
    assert reason == f'{tmp_path / run.name}.part: Input/output error'
    assert _descriptors() == descriptors - 1
    assert read_run(tmp_path / f'{run.name}.part').response == example().response


def test_directory_deleted_meanwhile_is_a_reason(tmp_path: Path) -> None:
    run = example().begin(recorder(tmp_path / 'runs'))
    shutil.rmtree(tmp_path / 'runs')
    assert 'deleted while it was written' in example().answer(run)
    assert run.name == ''


def test_directory_deleted_after_the_answer_is_a_reason(tmp_path: Path) -> None:
    run = example().begin(recorder(tmp_path / 'runs'))
    example().answer(run)
    shutil.rmtree(tmp_path / 'runs')
    assert run.close().endswith('No such file or directory')


def test_directory_deleted_between_runs_is_created_again(tmp_path: Path) -> None:
    into = recorder(tmp_path / 'runs')
    _record(into)
    shutil.rmtree(tmp_path / 'runs')
    assert read_run(tmp_path / 'runs' / _record(into).name).complete


def test_name_taken_while_it_was_chosen_is_not_overwritten(tmp_path: Path) -> None:
    taken, free = tmp_path / 'run_1.mcap', tmp_path / 'run_2.mcap'
    taken.write_text('precious')
    file = RunFile([taken, free])
    file.add_metadata('cfplan', {})
    file.close()
    assert file.path == free
    assert taken.read_text() == 'precious'
    assert sorted(tmp_path.iterdir()) == [taken, free]
