import io
import re
import sys
import threading

import pytest

from rclpy import _log_output
from rclpy._rosout import Rosout
from rclpy.clock import ROSClock
from rclpy.clock_type import ClockType
from rclpy.logging import (
    LoggingSeverity,
    get_logger,
    get_logging_severity_from_string,
    set_logger_level,
)
from rclpy.time import Time


@pytest.fixture(autouse=True)
def defaults(monkeypatch):
    for name in (
        'RCUTILS_COLORIZED_OUTPUT',
        'RCUTILS_CONSOLE_OUTPUT_FORMAT',
        'RCUTILS_LOGGING_USE_STDOUT',
    ):
        monkeypatch.delenv(name, raising=False)
    _log_output.reset()
    yield
    _log_output.reset()


@pytest.fixture
def console(capsys):
    """What the console got since the last call."""
    return lambda: capsys.readouterr().err


def messages(console):
    return [line.rpartition(': ')[2] for line in console().splitlines()]


def test_the_console_shows_severity_time_and_name(console):
    get_logger('hand.golden').info('ready')
    assert re.fullmatch(r'\[INFO\] \[\d{10}\.\d{9}\] \[hand\.golden\]: ready\n', console())


def test_a_record_is_formatted_as_in_ros():
    record = _log_output.LogRecord(
        1795355645_098134466, LoggingSeverity.INFO, 'hand.golden', 'ready', '/a/b.py', 'main', 7
    )
    assert _log_output.format_record(record) == (
        '[INFO] [1795355645.098134466] [hand.golden]: ready'
    )


def test_the_format_can_be_chosen(console, monkeypatch):
    monkeypatch.setenv(
        'RCUTILS_CONSOLE_OUTPUT_FORMAT', '{severity}|{function_name}|{message}|{nothing}'
    )
    get_logger('a').warning('{name}')
    assert console() == 'WARN|test_the_format_can_be_chosen|{name}|{nothing}\n'


@pytest.mark.parametrize(
    ('method', 'colour'),
    [('info', '\033[0m'), ('warning', '\033[33m'), ('error', '\033[31m'), ('fatal', '\033[31m')],
)
def test_colours_can_be_asked_for(console, monkeypatch, method, colour):
    monkeypatch.setenv('RCUTILS_COLORIZED_OUTPUT', '1')
    getattr(get_logger('a'), method)('x')
    line = console()
    assert line.startswith(f'{colour}[')
    assert line.endswith('x\033[0m\n')


def test_debug_is_dropped_unless_asked_for(console):
    logger = get_logger('a')
    assert logger.debug('first') is False
    logger.set_level(LoggingSeverity.DEBUG)
    assert logger.debug('second') is True
    assert messages(console) == ['second']


def test_a_child_has_its_parents_level():
    set_logger_level('a', LoggingSeverity.ERROR)
    child = get_logger('a').get_child('b')
    assert child.name == 'a.b'
    assert child.get_effective_level() is LoggingSeverity.ERROR
    assert get_logger('ab').get_effective_level() is LoggingSeverity.INFO


def test_a_childs_own_level_wins():
    set_logger_level('a', LoggingSeverity.ERROR)
    set_logger_level('a.b', LoggingSeverity.DEBUG)
    assert get_logger('a.b').is_enabled_for(LoggingSeverity.DEBUG)


def test_unset_gives_the_parents_level_back():
    set_logger_level('a', LoggingSeverity.ERROR)
    set_logger_level('a', LoggingSeverity.UNSET)
    assert get_logger('a').get_effective_level() is LoggingSeverity.INFO


def test_once_logs_the_first_call_of_each_place(console):
    logger = get_logger('a')
    for number in range(3):
        logger.info(f'one {number}', once=True)
        logger.info(f'two {number}', once=True)
    assert messages(console) == ['one 0', 'two 0']


def test_skip_first_leaves_the_first_out(console):
    logger = get_logger('a')
    for number in range(3):
        logger.info(str(number), skip_first=True)
    assert messages(console) == ['1', '2']


def test_throttling_keeps_a_pause_by_the_given_clock(console):
    logger, clock = get_logger('a'), ROSClock()
    clock._set_ros_time_is_active(True)
    for second in (100, 101, 102, 103, 104):
        clock.set_ros_time_override(Time(seconds=second, clock_type=ClockType.ROS_TIME))
        logger.info(str(second), throttle_duration_sec=2.0, throttle_time_source_type=clock)
    assert messages(console) == ['100', '102', '104']


def test_an_unknown_option_is_refused():
    with pytest.raises(TypeError, match='"onse" is not one of the recognized logging options'):
        get_logger('a').info('x', onse=True)


def test_a_place_keeps_its_severity():
    logger = get_logger('a')

    def log(severity):
        logger.log('x', severity)

    log(LoggingSeverity.INFO)
    with pytest.raises(ValueError, match='Logger severity cannot be changed between calls'):
        log(LoggingSeverity.WARN)


def test_an_empty_logger_name_is_refused():
    with pytest.raises(ValueError, match='Logger name must not be empty'):
        get_logger('')


def test_severities_are_found_by_name():
    assert get_logging_severity_from_string('warn') is LoggingSeverity.WARN
    with pytest.raises(RuntimeError, match='loud'):
        get_logging_severity_from_string('loud')


def test_lines_of_many_threads_do_not_mix(console):
    logger = get_logger('a')
    threads = [
        threading.Thread(target=lambda: [logger.info('x' * 200) for _ in range(50)])
        for _ in range(8)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(10)
    assert messages(console) == ['x' * 200] * 400


def test_a_closed_console_does_not_stop_logging(monkeypatch):
    closed = io.StringIO()
    closed.close()
    monkeypatch.setattr(sys, 'stderr', closed)
    assert get_logger('a').info('x') is True


def test_rosout_gets_a_nodes_messages_and_its_childrens_alone():
    published = []
    rosout = Rosout('hand.golden', published.append)
    try:
        get_logger('hand.golden').warning('own')
        get_logger('hand.golden.part').info('child')
        get_logger('hand.golden2').info('other')
    finally:
        rosout.close()
    get_logger('hand.golden').info('late')
    assert [(log.name, log.msg, log.level) for log in published] == [
        ('hand.golden', 'own', 30),
        ('hand.golden.part', 'child', 20),
    ]
    assert published[0].file == __file__
    assert published[0].function == 'test_rosout_gets_a_nodes_messages_and_its_childrens_alone'


def test_what_publishing_logs_does_not_come_back():
    logger, published = get_logger('a'), []

    def publish(log):
        published.append(log.msg)
        logger.info('published')

    rosout = Rosout('a', publish)
    try:
        logger.warning('once')
    finally:
        rosout.close()
    assert published == ['once']
