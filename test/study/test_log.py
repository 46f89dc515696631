"""The log of a study: what was written is there, whatever stopped the writing."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

from cfplan_core import CfplanError
from cfplan_core.study.design import StudyRun
from cfplan_core.study.log import StudyLog, sorted_text
from cfplan_core.study.record import COLUMNS, Record, Verdict, record_of


@pytest.fixture(scope='session')
def records(design: Callable[..., tuple[StudyRun, ...]]) -> list[Record]:
    runs = design('friction=0,0.1,2', 'gain=5:20', samples=2)
    reasons = ['', 'with, commas', 'and "quotes"', 'a µ and\n a new line']
    return [
        record_of(
            run,
            list(Verdict)[k % 4],
            {'position_error': 1e-7 * k / 3, 'lost_at': None if k % 2 else 0.5},
            'object.v3|left.link_1.e0',
            reasons[k % 4],
        )
        for k, run in enumerate(runs)
    ]


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / 'new' / 'study.csv'


def _written(path: Path, records: list[Record]) -> None:
    with StudyLog(path) as log:
        for record in records:
            log.append(record)


def test_records_are_read_as_they_were_written(path: Path, records: list[Record]) -> None:
    _written(path, records)
    with StudyLog(path) as log:
        assert list(log.records.values()) == records


def test_row_is_in_the_file_before_the_next_run(path: Path, records: list[Record]) -> None:
    with StudyLog(path) as log:
        for k, record in enumerate(records, 1):
            log.append(record)
            assert path.read_bytes().count(b'\n') == 1 + k


def test_file_cut_anywhere_loses_the_row_that_is_cut_alone(
    path: Path, records: list[Record]
) -> None:
    _written(path, records[:4])
    whole = path.read_bytes()
    for length in range(len(whole) + 1):
        path.write_bytes(whole[:length])
        with StudyLog(path) as log:
            kept = max(0, whole[:length].count(b'\n') - 1)
            assert list(log.records.values()) == records[:kept]
            for record in records[kept:4]:
                log.append(record)
        assert path.read_bytes() == whole


def test_last_row_of_rubbish_is_dropped(path: Path, records: list[Record]) -> None:
    _written(path, records[:2])
    whole = path.read_bytes()
    path.write_bytes(whole + b'\0\0,\0\n')
    with StudyLog(path) as log:
        assert list(log.records.values()) == records[:2]
    assert path.read_bytes() == whole


def test_rubbish_before_the_last_row_is_refused_and_kept(
    path: Path, records: list[Record]
) -> None:
    _written(path, records[:3])
    lines = path.read_bytes().splitlines(keepends=True)
    lines[2] = b'rubbish\n'
    path.write_bytes(b''.join(lines))
    with pytest.raises(CfplanError, match='line 3: got 1 columns, expected'):
        StudyLog(path)
    assert path.read_bytes() == b''.join(lines)


@pytest.mark.parametrize('text', ['a letter to a friend', 'name,value\n1,2\n'])
def test_file_of_something_else_is_refused_and_kept(path: Path, text: str) -> None:
    path.parent.mkdir()
    path.write_text(text, encoding='utf-8')
    with pytest.raises(CfplanError, match='expected the columns of a study'):
        StudyLog(path)
    assert path.read_text(encoding='utf-8') == text


def test_two_studies_do_not_write_one_file(path: Path, records: list[Record]) -> None:
    with StudyLog(path), pytest.raises(CfplanError, match='in use by another study'):
        StudyLog(path)
    StudyLog(path).close()


def test_sorted_file_does_not_depend_on_the_order(path: Path, records: list[Record]) -> None:
    texts = []
    for order in (records, records[::-1]):
        path.unlink(missing_ok=True)
        with StudyLog(path) as log:
            for record in order:
                log.append(record)
            log.sort()
        texts.append(path.read_bytes())
    assert texts[0] == texts[1] == sorted_text(records)
    assert os.listdir(path.parent) == [path.name]
    rows = texts[0].decode().splitlines()[1:]
    at = COLUMNS.index('friction')
    frictions = [float(row.split(',')[at]) for row in rows if ',h020,' in row]
    assert frictions == sorted(frictions)


def test_later_row_of_a_run_counts(path: Path, records: list[Record]) -> None:
    failed = replace(records[0], verdict=Verdict.FAILED)
    _written(path, [failed, *records[1:]])
    with StudyLog(path) as log:
        log.forget([failed.key])
        assert failed.key not in log.records
        log.append(records[0])
    with StudyLog(path) as log:
        log.sort()
    assert path.read_bytes() == sorted_text(records)
