from __future__ import annotations

import errno
import fcntl
import random
import struct
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from multiprocessing import Pipe, get_context
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader
from mcap.records import Channel, Message
from mcap.writer import CompressionType, Writer
from ros.recording.example import STAMP, example, not_solved, recorder

from cfplan_core.errors import CfplanError
from cfplan_ros.planning_service import pictures
from cfplan_ros.recording.intact import IntactRecords, NotMcapError
from cfplan_ros.recording.reading import read_messages, read_run
from cfplan_ros.recording.recovery import InUseError, recover, recover_left_over
from cfplan_ros.recording.rewriting import rewrite

GOLDEN = Path(__file__).parents[1] / 'golden' / 'rosbag2_jazzy.mcap'
Messages = list[tuple[str, int, Any]]


def _messages(path: Path) -> Messages:
    return list(read_messages(path))


@pytest.fixture(scope='module')
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A run that was recorded to its end."""
    directory = tmp_path_factory.mktemp('whole')
    run = example().begin(recorder(directory))
    example().answer(run)
    example().play(run)
    assert run.close() == ''
    return directory / run.name


@pytest.fixture(scope='module')
def flushed(tmp_path_factory: pytest.TempPathFactory) -> list[tuple[int, Messages]]:
    """Lengths of a run's file after each flush, with what it holds by then."""
    directory = tmp_path_factory.mktemp('flushed')
    run = example().begin(recorder(directory))
    part = directory / f'{run.name}.part'
    states = [(part.stat().st_size, _messages(part))]
    example().answer(run)
    states.append((part.stat().st_size, _messages(part)))
    run.close()
    return states


def _torn(whole: Path, length: int, directory: Path) -> Path:
    path = directory / f'{whole.name}.part'
    path.write_bytes(whole.read_bytes()[:length])
    return path


def test_everything_flushed_is_kept_wherever_the_file_is_torn(
    whole: Path, flushed: list[tuple[int, Messages]], tmp_path: Path
) -> None:
    size = whole.stat().st_size
    (request, _), (answer, _) = flushed
    offsets = {request, request + 1, answer - 1, answer, answer + 1, size - 1, size}
    offsets |= {random.Random(1).randrange(request, size) for _ in range(60)}
    for offset in sorted(offsets):
        result = recover(_torn(whole, offset, tmp_path))
        assert result.path == tmp_path / whole.name
        held = _messages(result.path)
        assert held == _messages(whole)[: len(held)]
        for length, messages in flushed:
            if offset >= length:
                assert held[: len(messages)] == messages
        result.path.unlink()


def test_recovered_file_has_an_index_and_correct_checksums(
    whole: Path, flushed: list[tuple[int, Messages]], tmp_path: Path
) -> None:
    result = recover(_torn(whole, flushed[1][0] + 7, tmp_path))
    assert result.path is not None
    with result.path.open('rb') as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        count = len(list(reader.iter_messages()))
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count == count == result.kept
    assert list(tmp_path.iterdir()) == [result.path]


def test_torn_tail_is_counted(
    whole: Path, flushed: list[tuple[int, Messages]], tmp_path: Path
) -> None:
    result = recover(_torn(whole, flushed[1][0] + 7, tmp_path))
    assert (result.kept, result.dropped) == (len(flushed[1][1]), 7)


def test_zeros_where_data_should_have_come_are_no_data(
    whole: Path, flushed: list[tuple[int, Messages]], tmp_path: Path
) -> None:
    path = _torn(whole, flushed[1][0], tmp_path)
    path.write_bytes(path.read_bytes() + bytes(5000))
    result = recover(path)
    assert result.path is not None
    assert _messages(result.path) == flushed[1][1]


def test_missing_preview_is_completed_to_what_the_planner_would_have_written(
    whole: Path, flushed: list[tuple[int, Messages]], tmp_path: Path
) -> None:
    result = recover(_torn(whole, flushed[1][0], tmp_path), preview=pictures)
    assert result.path is not None
    assert _messages(result.path) == _messages(whole)
    assert result.problems == ()


def test_preview_that_ends_early_is_completed(tmp_path: Path) -> None:
    run = example().begin(recorder(tmp_path))
    example().answer(run)
    played = list(example().preview())
    for time_ns, topic, message in played[: len(played) // 3]:
        run.add(topic, message, time_ns)
    run._file.flush()  # type: ignore[union-attr]
    run._file.abandon()  # type: ignore[union-attr]
    result = recover(tmp_path / f'{run.name}.part', preview=pictures)
    assert result.path is not None
    times = [(time, topic) for topic, time, _ in _messages(result.path)]
    assert result.added == len(played) - len(played) // 3
    assert len(set(times)) == len(times) == result.kept + result.added
    assert [time for time, _ in times] == sorted(time for time, _ in times)


def test_run_without_a_plan_gets_no_preview(tmp_path: Path) -> None:
    run = example().begin(recorder(tmp_path))
    run.finish_essential(not_solved(), STAMP)
    run._file.abandon()  # type: ignore[union-attr]
    result = recover(tmp_path / f'{run.name}.part', preview=pictures)
    assert (result.kept, result.added, result.problems) == (2, 0, ())


def test_preview_that_fails_does_not_cost_the_record(
    whole: Path, flushed: list[tuple[int, Messages]], tmp_path: Path
) -> None:
    def fail(*_: Any) -> Any:
        raise CfplanError('no such hand')

    result = recover(_torn(whole, flushed[1][0], tmp_path), preview=fail)
    assert result.path is not None
    assert _messages(result.path) == flushed[1][1]
    assert result.problems == ('no preview added: CfplanError: no such hand',)


def test_damaged_chunk_is_left_out_and_the_rest_kept(
    whole: Path, flushed: list[tuple[int, Messages]], tmp_path: Path
) -> None:
    (request, _), (answer, answered) = flushed
    path = _torn(whole, whole.stat().st_size, tmp_path)
    data = _flipped(path, (request + answer) // 2)
    result = recover(path)
    assert result.path is not None
    assert _messages(result.path) == [
        message for message in _messages(whole) if message not in answered[1:]
    ]
    assert (result.lost, result.added) == (len(answered) - 1, 0)
    assert result.problems[0] == f'damaged: bytes {_chunk_before(data, answer)}'
    assert (tmp_path / f'{whole.name}.unreadable').read_bytes() == data


def test_without_an_index_messages_go_with_the_chunk_that_has_their_type(
    whole: Path, flushed: list[tuple[int, Messages]], tmp_path: Path
) -> None:
    (request, _), (answer, answered) = flushed
    path = _torn(whole, whole.stat().st_size - 1000, tmp_path)
    _flipped(path, (request + answer) // 2)
    result = recover(path)
    assert result.path is not None
    expected = [
        (topic, time, message)
        for topic, time, message in _messages(whole)
        if (topic, time, message) not in answered[1:] and not topic.endswith('torque_limits')
    ]
    assert _messages(result.path) == expected
    assert result.lost == len(_messages(whole)) - len(expected)


def test_preview_that_was_damaged_is_computed_again(
    whole: Path, flushed: list[tuple[int, Messages]], tmp_path: Path
) -> None:
    path = tmp_path / whole.name
    path.write_bytes(whole.read_bytes())
    _flipped(path, flushed[1][0] + 1000)
    result = recover(path, preview=pictures)
    assert result.path == tmp_path / f'{path.stem}_recovered.mcap'
    assert result.lost == result.added == len(list(example().preview()))
    assert _messages(result.path) == _messages(whole)


def _flipped(path: Path, offset: int, by: int = 0xFF) -> bytes:
    """Damage one byte of a file; return what the file then holds."""
    data = bytearray(path.read_bytes())
    data[offset] ^= by
    path.write_bytes(data)
    return bytes(data)


def _chunk_before(data: bytes, offset: int) -> str:
    """First and last byte of the last chunk before a place."""
    head = data.rindex(b'zstd', 0, offset)
    start = head - 9 - 32
    (length,) = struct.unpack_from('<Q', data, start + 1)
    return f'{start} to {start + 9 + length - 1}'


def _places(size: int) -> list[int]:
    """Places in a file, all over it and close together at its two ends."""
    chance = random.Random(2)
    ends = [*range(8, 120, 9), *range(size - 60, size, 2)]
    return [*ends, *sorted(chance.sample(range(8, size), 80))]


def test_file_with_a_damaged_byte_is_complete_only_if_every_message_is_there_and_equal(
    whole: Path, tmp_path: Path
) -> None:
    path, expected, incomplete = tmp_path / 'x.mcap', _raw(whole), 0
    for offset in _places(whole.stat().st_size):
        path.write_bytes(whole.read_bytes())
        _flipped(path, offset, 1 << offset % 8)
        run = read_run(path)
        held = _raw(path)
        assert set(held) <= set(expected), offset
        assert run.count == len(held), offset
        assert run.complete <= (held == expected), offset
        assert bool(run.damage) != run.complete, offset
        incomplete += not run.complete
    assert incomplete > 80


def test_recovery_of_a_damaged_file_keeps_what_can_be_read_and_says_so(
    whole: Path, tmp_path: Path
) -> None:
    path, count = tmp_path / 'x.mcap', len(_raw(whole))
    for offset in _places(whole.stat().st_size)[::6]:
        path.write_bytes(whole.read_bytes())
        _flipped(path, offset)
        if read_run(path).complete:
            continue
        result = recover(path)
        assert result.path is not None
        assert not result.complete, offset
        assert _raw(result.path) == _raw(path), offset
        assert (result.kept, result.lost) == (len(_raw(path)), count - len(_raw(path))), offset
        assert read_run(result.path).complete, offset
        result.path.unlink()


@pytest.mark.parametrize('field', range(9))
def test_chunk_whose_frame_is_damaged_is_read_by_what_is_inside(
    whole: Path, flushed: list[tuple[int, Messages]], tmp_path: Path, field: int
) -> None:
    path = tmp_path / 'x.mcap'
    path.write_bytes(whole.read_bytes())
    start = int(_chunk_before(path.read_bytes(), flushed[1][0]).split()[0])
    _flipped(path, start + field, 0x03)
    run = read_run(path)
    assert run.count == len(_messages(whole))
    assert not run.complete


def test_damage_outside_the_chunks_shows_where_the_file_has_a_checksum_of_it(
    tmp_path: Path,
) -> None:
    path = tmp_path / 'x.mcap'
    with path.open('wb') as file:
        writer = Writer(file, enable_data_crcs=True)
        writer.start()
        writer.add_metadata('room', {'temperature': '21'})
        channel = writer.register_channel('/words', 'json', 0)
        writer.add_message(channel, 1, b'word', 1)
        writer.finish()
    assert read_run(path).complete
    _flipped(path, path.read_bytes().index(b'21'), 1)
    run = read_run(path)
    assert run.damage == ('what is no message fails its checksum',)
    assert not run.complete


def test_lost_metadata_is_damage(whole: Path, tmp_path: Path) -> None:
    path = tmp_path / 'x.mcap'
    path.write_bytes(whole.read_bytes())
    # The prefix of the record: an opcode that readers are to skip.
    start = path.read_bytes().index(b'cfplan', 41) - 4 - 9
    _flipped(path, start, 0x80)
    run = read_run(path)
    assert '0 of 1 metadata record found' in run.damage
    assert not run.complete


def test_index_record_that_looks_like_a_message_is_none(
    whole: Path, flushed: list[tuple[int, Messages]], tmp_path: Path
) -> None:
    # The last record before that place; 7 is an index, 5 would be a message.
    data = whole.read_bytes()[: flushed[1][0]]
    path = tmp_path / 'x.mcap'
    path.write_bytes(data)
    assert _flipped(path, len(data) - 9 - 22, 7 ^ 5)[-9 - 22] == 5
    assert _raw(path) == _raw(whole)[: len(flushed[1][1])]


def _raw(path: Path) -> list[tuple[str, int, bytes]]:
    channels: dict[int, str] = {}
    held = []
    with path.open('rb') as file:
        for record in IntactRecords(file, path):
            if isinstance(record, Channel):
                channels[record.id] = record.topic
            elif isinstance(record, Message):
                held.append((channels[record.channel_id], record.log_time, record.data))
    return held


def test_damage_to_the_length_of_a_chunk_is_left_out(whole: Path, tmp_path: Path) -> None:
    path = _torn(whole, whole.stat().st_size, tmp_path)
    data = bytearray(path.read_bytes())
    # The chunk's compression, then eight bytes with the length of its records.
    length = data.index(b'zstd') + len(b'zstd')
    data[length : length + 8] = b'\xff' * 8
    path.write_bytes(data)
    damaged = _chunk_before(bytes(data), length + 8)
    assert recover(path).problems[0] == f'damaged: bytes {damaged}'


def test_damaged_chunk_of_another_compression_is_left_out(tmp_path: Path) -> None:
    path = tmp_path / 'other.mcap'
    with path.open('wb') as file:
        writer = Writer(file, compression=CompressionType.LZ4)
        writer.start()
        channel = writer.register_channel('/words', 'json', 0)
        for time in range(2):
            writer.add_message(channel, time, b'word' * 100, time)
            writer.flush()
        writer.finish()
    data = bytearray(path.read_bytes())
    # The second chunk's records: its compression, then eight bytes with their length.
    start = data.index(b'lz4', data.index(b'lz4') + 1) + len(b'lz4') + 8
    data[start : start + 8] = bytes(8)
    path.write_bytes(data[:-100])
    result = recover(path)
    assert (result.kept, result.lost) == (1, 1)
    (problem,) = result.problems
    assert problem.startswith('damaged: bytes ')


def test_other_recordings_are_recovered_beside_the_torn_file(tmp_path: Path) -> None:
    torn = tmp_path / 'x.mcap'
    data = GOLDEN.read_bytes()
    torn.write_bytes(data[: data.rindex(b'rosbag2')])
    result = recover(torn, preview=pictures)
    assert result.path == tmp_path / 'x_recovered.mcap'
    assert torn.exists()
    with GOLDEN.open('rb') as golden, result.path.open('rb') as file:
        expected = [
            (c.topic, m.log_time, m.data) for _, c, m in make_reader(golden).iter_messages()
        ]
        held = [(c.topic, m.log_time, m.data) for _, c, m in make_reader(file).iter_messages()]
    assert held == expected


def test_complete_file_is_left_as_it_is(whole: Path) -> None:
    before = whole.read_bytes()
    result = recover(whole)
    assert (result.path, result.kept) == (None, len(_messages(whole)))
    assert whole.read_bytes() == before


def test_complete_file_is_copied_to_the_output(whole: Path, tmp_path: Path) -> None:
    output = tmp_path / 'new' / 'deep' / 'out.mcap'
    result = recover(whole, output)
    assert (result.path, result.complete, result.kept) == (output, True, len(_messages(whole)))
    assert output.read_bytes() == whole.read_bytes()
    assert [path.name for path in output.parent.iterdir()] == ['out.mcap']


def test_error_names_the_output_that_was_asked_for(
    whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: Any) -> None:
        raise OSError(28, 'No space left on device', 'out.mcap.tmp')

    monkeypatch.setattr('cfplan_ros.recording.recovery.os.fsync', fail)
    with pytest.raises(OSError, match='No space') as failed:
        recover(whole, tmp_path / 'out.mcap')
    assert failed.value.filename == str(tmp_path / 'out.mcap')
    assert list(tmp_path.iterdir()) == []


def test_output_leaves_the_torn_file(
    whole: Path, flushed: list[tuple[int, Messages]], tmp_path: Path
) -> None:
    part = _torn(whole, flushed[1][0], tmp_path)
    before = part.read_bytes()
    recover(part, tmp_path / 'out.mcap')
    assert part.read_bytes() == before
    assert _messages(tmp_path / 'out.mcap') == flushed[1][1]


def test_output_that_is_there_is_not_overwritten(whole: Path, tmp_path: Path) -> None:
    part = _torn(whole, whole.stat().st_size - 9, tmp_path)
    (tmp_path / 'out.mcap').write_text('precious')
    with pytest.raises(CfplanError, match='is there already'):
        recover(part, tmp_path / 'out.mcap')
    assert (tmp_path / 'out.mcap').read_text() == 'precious'


@pytest.mark.parametrize(
    ('data', 'said'),
    [
        (b'', 'the file is empty, expected an MCAP file'),
        (b'# a text file\n', "begins with b'# a text', expected an MCAP file"),
        (b'\x89MCAP0\r\n', 'holds no complete message'),
    ],
)
def test_file_without_a_message_is_refused(tmp_path: Path, data: bytes, said: str) -> None:
    path = tmp_path / 'x.mcap'
    path.write_bytes(data)
    with pytest.raises(NotMcapError, match=r'x\.mcap: ') as refused:
        recover(path)
    assert str(refused.value).endswith(said)


def test_failure_to_write_leaves_the_torn_file_alone(
    whole: Path,
    flushed: list[tuple[int, Messages]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    part = _torn(whole, flushed[1][0], tmp_path)
    before = part.read_bytes()

    def fail(*_: Any) -> None:
        raise OSError(28, 'No space left on device')

    monkeypatch.setattr(Writer, 'finish', fail)
    with pytest.raises(OSError, match='No space'):
        recover(part)
    assert [path.name for path in tmp_path.iterdir()] == [part.name]
    assert part.read_bytes() == before


def test_left_over_runs_are_completed_on_start(
    whole: Path, flushed: list[tuple[int, Messages]], tmp_path: Path
) -> None:
    _torn(whole, flushed[1][0], tmp_path)
    lines: list[str] = []
    (completed,) = recover_left_over(tmp_path, pictures, lines.append)
    assert _messages(completed) == _messages(whole)
    (line,) = lines
    assert f'kept {len(flushed[1][1])} messages' in line


def test_run_in_use_is_left_to_the_node_that_writes_it(tmp_path: Path) -> None:
    run = example().begin(recorder(tmp_path))
    other = recorder(tmp_path)
    assert other.recover_left_over(pictures) == []
    with pytest.raises(InUseError):
        recover(tmp_path / f'{run.name}.part')
    assert example().answer(run) == run.close() == ''
    assert read_run(tmp_path / run.name).complete


def test_without_locks_a_left_over_run_is_left_alone_and_named(
    whole: Path,
    flushed: list[tuple[int, Messages]],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fail(*_: Any) -> None:
        raise OSError(errno.ENOLCK, 'No locks available')

    monkeypatch.setattr(fcntl, 'flock', fail)
    part = _torn(whole, flushed[1][0], tmp_path)
    lines: list[str] = []
    assert recover_left_over(tmp_path, pictures, lines.append) == []
    assert lines == [f'{part}: left alone, as no lock tells here whether it is in use']


def test_without_locks_a_run_is_recorded_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: Any) -> None:
        raise OSError(errno.ENOLCK, 'No locks available')

    monkeypatch.setattr(fcntl, 'flock', fail)
    run = example().begin(recorder(tmp_path))
    assert example().answer(run) == run.close() == ''


def test_file_of_which_nothing_can_be_read_is_set_aside_once(tmp_path: Path) -> None:
    part = tmp_path / 'run_1.mcap.part'
    part.write_bytes(b'\x89MCAP0\r\n garbage')
    lines: list[str] = []
    assert recover_left_over(tmp_path, pictures, lines.append) == []
    assert recover_left_over(tmp_path, pictures, lines.append) == []
    assert len(lines) == 1
    assert (tmp_path / 'run_1.mcap.unreadable').read_bytes() == b'\x89MCAP0\r\n garbage'


def test_file_that_recovery_fails_on_does_not_cost_the_others(
    whole: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ('run_1', 'run_2'):
        (tmp_path / f'{name}.mcap.part').write_bytes(whole.read_bytes())
    once = iter([KeyError('a defect')])

    def fail_once(*arguments: Any) -> None:
        for error in once:
            raise error
        rewrite(*arguments)

    monkeypatch.setattr('cfplan_ros.recording.recovery.rewrite', fail_once)
    log: list[str] = []
    assert recover_left_over(tmp_path, None, log.append) == [tmp_path / 'run_2.mcap']
    assert log[0].endswith("run_1.mcap.part: not recovered: KeyError: 'a defect'")


def test_files_of_others_are_not_touched(tmp_path: Path) -> None:
    (tmp_path / 'film.mkv.part').write_bytes(b'x')
    recover_left_over(tmp_path, pictures, print)
    assert [path.name for path in tmp_path.iterdir()] == ['film.mkv.part']


def test_missing_directory_holds_nothing_to_recover(tmp_path: Path) -> None:
    assert recover_left_over(tmp_path / 'missing', pictures, print) == []


def test_lock_is_released_when_its_holder_is_killed(tmp_path: Path) -> None:
    with _recording_process(tmp_path) as (process, names):
        assert names.poll(timeout=20)
        process.kill()
        process.join(timeout=20)
    for path in tmp_path.glob('*.part'):
        with path.open('rb') as file:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)


@pytest.mark.parametrize('seed', range(12))
def test_every_run_answered_before_a_kill_is_complete_after_recovery(
    whole: Path, tmp_path: Path, seed: int
) -> None:
    chance = random.Random(seed)
    answered: list[str] = []
    with _recording_process(tmp_path) as (process, names):
        for _ in range(chance.randrange(1, 4)):
            assert names.poll(timeout=20)
            answered.append(names.recv())
        # Some instant of what follows; the process does not end by itself.
        process.join(timeout=chance.uniform(0.0, 0.05))
        process.kill()
        process.join(timeout=20)
        with suppress(EOFError):
            while names.poll(timeout=20):
                answered.append(names.recv())
    recover_left_over(tmp_path, pictures, print)
    expected = _messages(whole)
    for name in answered:
        assert read_run(tmp_path / name).complete
        assert _messages(tmp_path / name) == expected
    assert not list(tmp_path.glob('*.part'))


@contextmanager
def _recording_process(directory: Path) -> Iterator[tuple[BaseProcess, Connection]]:
    """A process that records runs without end, and sends the name of each that it answered."""
    played = list(example().preview())
    names, ours = Pipe(duplex=False)
    process = get_context('fork').Process(target=_record_forever, args=(directory, played, ours))
    process.start()
    ours.close()
    try:
        yield process, names
    finally:
        process.kill()
        process.join(timeout=20)
        names.close()


def _record_forever(directory: Path, played: list[Any], names: Connection) -> None:
    into = recorder(directory)
    while True:
        run = example().begin(into)
        if example().answer(run) == '':
            names.send(run.name)
        for time_ns, topic, message in played:
            run.add(topic, message, time_ns)
        run.close()
