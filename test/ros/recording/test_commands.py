from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from mcap.reader import make_reader
from mcap.writer import Writer
from ros.recording.example import NODE, STAMP, example, not_solved, recorder

from cfplan_core.command_line.application import Application
from cfplan_ros.command_line.bag import bag
from cfplan_ros.command_line.recover import recover
from cfplan_ros.recording.reading import read_run
from cfplan_ros.recording.recorder import Run

GOLDEN = Path(__file__).parents[1] / 'golden' / 'rosbag2_jazzy.mcap'


def _cfplan(*arguments: object, columns: int = 200) -> Result:
    application = Application('cfplan', commands={'bag': bag, 'recover': recover})
    runner = CliRunner(env={'COLUMNS': str(columns)})
    return runner.invoke(application, [str(argument) for argument in arguments])


@pytest.fixture
def whole(tmp_path: Path) -> Path:
    run = example().begin(recorder(tmp_path))
    example().answer(run)
    example().play(run)
    run.close()
    return tmp_path / run.name


@pytest.fixture
def cut_short(tmp_path: Path) -> Path:
    """A run whose planner died after its answer."""
    run = example().begin(recorder(tmp_path))
    example().answer(run)
    return _die(run, tmp_path)


def _die(run: Run, directory: Path) -> Path:
    assert run._file is not None
    run._file.abandon()
    return directory / f'{run.name}.part'


def test_bag_says_what_a_run_holds(whole: Path) -> None:
    result = _cfplan('bag', whole)
    assert result.exit_code == 0
    held = read_run(whole)
    first, *_ = result.output.splitlines()
    assert f'{whole}: {whole.stat().st_size} bytes, {held.count} messages' in first
    assert 'problem trinkle_hunter_1991' in result.output
    assert f'by {NODE}, cfplan 0.1.0' in result.output


def test_bag_lists_every_topic_with_type_qos_and_count(whole: Path) -> None:
    lines = [line.split() for line in _cfplan('bag', whole).output.splitlines()]
    rows = {first[0]: (first, second) for first, second in pairwise(lines) if first}
    for topic in read_run(whole).topics:
        first, second = rows[topic.name]
        latched = topic.name in (f'{NODE}/plan_result', f'{NODE}/markers', '/tf_static')
        assert first[1:3] == ['reliable', str(topic.count)]
        assert second[:2] == [topic.type_name, 'latched,' if latched else 'volatile,']


def test_bag_prints_types_unbroken_in_80_columns(whole: Path) -> None:
    words = _cfplan('bag', whole, columns=80).output.split()
    topics = read_run(whole).topics
    assert {topic.type_name for topic in topics} <= set(words)
    assert {topic.name for topic in topics} <= set(words)


def test_bag_breaks_longer_names_after_a_slash_only(whole: Path) -> None:
    lines = _cfplan('bag', whole, columns=66).output.splitlines()
    start = next(k for k, line in enumerate(lines) if 'PlanManipulation_Request' in line)
    assert lines[start].split()[0] == 'PlanManipulation_Request'
    assert lines[start - 1].split()[0] == 'cfplan_msgs/msg/'


def test_bag_says_solved_of_a_run_with_a_plan(whole: Path) -> None:
    output = _cfplan('bag', whole).output
    assert 'trinkle_hunter_1991: solved' in output
    assert 'NONE' not in output


def test_bag_counts_one_message_as_one(tmp_path: Path) -> None:
    run = example().begin(recorder(tmp_path))
    run.close()
    assert ', 1 message in 0.000 s' in _cfplan('bag', tmp_path / run.name).output


@pytest.mark.parametrize('share', [0.3, 0.4, 0.5])
def test_bag_says_what_of_a_damaged_run_can_be_read(whole: Path, share: float) -> None:
    count = read_run(whole).count
    _damage(whole, share)
    result = _cfplan('bag', whole)
    held = read_run(whole).count
    assert 0 < held < count
    assert result.exit_code == 1
    assert f'{whole}: damaged: bytes ' in result.output
    assert f'; {held} of {count} messages can be read; cfplan recover' in result.output


@pytest.mark.parametrize('share', [0.3, 0.4, 0.5])
def test_recover_says_how_many_messages_of_a_damaged_run_are_lost(
    whole: Path, share: float
) -> None:
    count = read_run(whole).count
    _damage(whole, share)
    held = read_run(whole).count
    result = _cfplan('recover', whole)
    assert result.exit_code == 0
    assert f'kept {held} of {count} messages, lost {count - held}, added' in result.output
    assert 'is complete' not in result.output
    assert read_run(whole.with_name(f'{whole.stem}_recovered.mcap')).count == count


def test_bag_does_not_say_that_a_lost_answer_was_never_given(whole: Path) -> None:
    _damage(whole, 0.1)
    output = _cfplan('bag', whole).output
    assert 'The answer is not among what can be read' in output
    assert 'ended before' not in output


def test_bag_says_what_a_recovered_file_has_lost(whole: Path) -> None:
    count = read_run(whole).count
    _damage(whole, 0.1)
    held = read_run(whole).count
    _cfplan('recover', whole)
    result = _cfplan('bag', whole.with_name(f'{whole.stem}_recovered.mcap'))
    assert result.exit_code == 0
    assert f'recovered: messages kept {held}, lost {count - held}, added 0' in result.output
    assert 'The answer is not among what can be read' in result.output


def _damage(path: Path, share: float) -> None:
    data = bytearray(path.read_bytes())
    data[int(share * len(data))] ^= 0xFF
    path.write_bytes(data)


def test_bag_of_a_run_that_is_being_written_says_so(tmp_path: Path) -> None:
    run = example().begin(recorder(tmp_path))
    path = tmp_path / f'{run.name}.part'
    result = _cfplan('bag', path)
    assert result.exit_code == 1
    assert 'The planner has not answered yet' in result.output
    assert f'{path}: a planner is still writing this file' in result.output
    assert 'recover' not in result.output
    assert example().answer(run) == run.close() == ''


def test_bag_of_a_file_without_a_message_does_not_recommend_recover(cut_short: Path) -> None:
    # Magic and header.
    cut_short.write_bytes(cut_short.read_bytes()[:41])
    result = _cfplan('bag', cut_short)
    assert result.exit_code == 1
    assert 'not complete; there is nothing to recover' in result.output
    assert 'cfplan recover' not in result.output
    assert _cfplan('recover', cut_short).exit_code == 2


def test_bag_prints_the_plan_as_plan_does(whole: Path) -> None:
    from cfplan_core.command_line.application import application

    printed = CliRunner(env={'COLUMNS': '200'}).invoke(
        application, ['plan', 'config/problems/trinkle_hunter_1991.yaml']
    )
    segments = printed.output.partition('Segments')[2]
    assert segments
    assert segments in _cfplan('bag', whole).output


def test_bag_says_why_there_is_no_plan(tmp_path: Path) -> None:
    run = example().begin(recorder(tmp_path))
    run.finish_essential(not_solved(), STAMP)
    run.close()
    result = _cfplan('bag', tmp_path / run.name)
    assert result.exit_code == 0
    assert 'searched to the end' in result.output


def test_bag_of_a_run_that_was_never_answered_says_so(tmp_path: Path) -> None:
    run = example().begin(recorder(tmp_path))
    run.close()
    assert 'ended before the planner answered' in _cfplan('bag', tmp_path / run.name).output


def test_bag_reads_a_file_that_is_cut_short_and_says_so(cut_short: Path) -> None:
    result = _cfplan('bag', cut_short)
    assert result.exit_code == 1
    assert 'Segments' in result.output
    assert 'not complete; cfplan recover' in result.output


def test_bag_reads_other_recordings() -> None:
    result = _cfplan('bag', GOLDEN)
    assert result.exit_code == 0
    assert 'not a run of cfplan' in result.output
    assert '/hand/golden/markers' in result.output


def test_bag_does_not_guess_at_messages_of_another_version(whole: Path, tmp_path: Path) -> None:
    other = tmp_path / 'other.mcap'
    _with_other_hashes(whole, other)
    result = _cfplan('bag', other)
    assert result.exit_code == 0
    assert 'PlanManipulation_Response differs from the type that is installed' in result.output


def _with_other_hashes(source: Path, target: Path) -> None:
    """Copy a recording as one of other types with the same names."""
    with source.open('rb') as file, target.open('wb') as out:
        reader, writer = make_reader(file), Writer(out)
        writer.start('ros2')
        for record in reader.iter_metadata():
            writer.add_metadata(record.name, record.metadata)
        channels = {}
        for schema, channel, message in reader.iter_messages():
            assert schema is not None
            if channel.id not in channels:
                schema_id = writer.register_schema(schema.name, schema.encoding, schema.data)
                metadata = {**channel.metadata, 'topic_type_hash': 'RIHS01_other'}
                channels[channel.id] = writer.register_channel(
                    channel.topic, 'cdr', schema_id, metadata
                )
            writer.add_message(channels[channel.id], message.log_time, message.data, 0)
        writer.finish()


def test_recover_completes_a_run_and_says_how_many_messages_it_kept(cut_short: Path) -> None:
    kept = read_run(cut_short).count
    result = _cfplan('recover', cut_short)
    assert result.exit_code == 0
    assert f'kept {kept} messages' in result.output
    complete = cut_short.with_suffix('')
    assert str(complete) in result.output
    assert read_run(complete).complete
    assert read_run(complete).count == kept + len(list(example().preview()))
    assert not cut_short.exists()


def test_recover_writes_where_it_is_told(cut_short: Path, tmp_path: Path) -> None:
    assert _cfplan('recover', cut_short, '-o', tmp_path / 'out.mcap').exit_code == 0
    assert read_run(tmp_path / 'out.mcap').complete
    assert cut_short.exists()


def test_recover_copies_a_complete_file_to_where_it_is_told(whole: Path, tmp_path: Path) -> None:
    output = tmp_path / 'new' / 'out.mcap'
    result = _cfplan('recover', whole, '-o', output)
    assert result.exit_code == 0
    assert f'is complete, with {read_run(whole).count} messages' in result.output
    assert f'complete file: {output}' in result.output
    assert output.read_bytes() == whole.read_bytes()


def test_recover_names_the_output_that_cannot_be_written(whole: Path, tmp_path: Path) -> None:
    # Short enough for a name, too long for a temporary one that is derived from it.
    output = tmp_path / f'{"x" * 248}.mcap'
    result = _cfplan('recover', whole, '-o', output)
    assert result.exit_code == 2
    assert f'{output}: File name too long' in result.output


def test_recover_of_a_complete_file_has_nothing_to_do(whole: Path) -> None:
    result = _cfplan('recover', whole)
    assert result.exit_code == 0
    assert 'nothing to recover' in result.output


def test_recover_refuses_a_run_that_is_being_written(tmp_path: Path) -> None:
    run = example().begin(recorder(tmp_path))
    result = _cfplan('recover', tmp_path / f'{run.name}.part')
    run.close()
    assert result.exit_code == 2
    assert 'still writing this file' in result.output


@pytest.mark.parametrize('command', ['bag', 'recover'])
@pytest.mark.parametrize(
    ('make', 'said'),
    [
        (lambda path: None, 'No such file or directory'),
        (lambda path: path.mkdir(), 'Is a directory'),
        (lambda path: path.write_bytes(b''), 'the file is empty, expected an MCAP file'),
        (
            lambda path: path.write_text('hello, world'),
            "begins with b'hello, w', expected an MCAP",
        ),
    ],
)
def test_what_is_no_recording_is_refused_by_name(
    tmp_path: Path, command: str, make: Callable[[Path], object], said: str
) -> None:
    path = tmp_path / 'file.mcap'
    make(path)
    result = _cfplan(command, path)
    assert result.exit_code == 2
    assert f'{path}: {said}' in result.output
    assert 'Traceback' not in result.output
