from __future__ import annotations

import os
import random
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from ros_standalone.middleware import (
    ClosedError,
    ConfigurationError,
    Participant,
    WaitSet,
)

STRING = 'std_msgs/msg/String'
TRIGGER = 'std_srvs/srv/Trigger'
PAYLOAD = bytes((0, 1, 0, 0)) + b'text'


def exchange(here, there, qos):
    """Whether a message of one participant reaches another."""
    writer = here.create_writer(here.add_node('a', '/'), '/words', STRING, '', qos)
    reader = there.create_reader(there.add_node('b', '/'), '/words', STRING, '', qos)
    here.graph.wait_until(lambda: writer.matched_count() > 0, 5.0)
    writer.publish(PAYLOAD)
    return WaitSet(there).wait([reader], 5.0) == {reader}


def test_two_participants_of_a_process_talk(make_participant, volatile):
    assert exchange(make_participant(), make_participant(), volatile)


def test_participants_can_be_opened_again(make_participant, volatile):
    for _ in range(3):
        here, there = make_participant(), make_participant()
        assert exchange(here, there, volatile)
        here.close()
        there.close()


def test_one_participant_outlives_the_other(make_participant, volatile):
    make_participant().close()
    here, other = make_participant(), make_participant()
    other.close()
    assert exchange(here, make_participant(), volatile)


def test_other_domain_is_not_heard(participant, domain, volatile):
    other = Participant(domain + 100)
    try:
        writer = participant.create_writer(
            participant.add_node('a', '/'), '/words', STRING, '', volatile
        )
        other.create_reader(other.add_node('b', '/'), '/words', STRING, '', volatile)
        assert not participant.graph.wait_until(lambda: writer.matched_count() > 0, 0.5)
    finally:
        other.close()


def test_closing_twice_is_closing_once(participant):
    participant.close()
    participant.close()
    assert not participant.is_open


def test_closed_participant_makes_nothing(participant, volatile):
    node = participant.add_node('late', '/')
    participant.close()
    with pytest.raises(ClosedError, match='the participant has been closed'):
        participant.create_writer(node, '/words', STRING, '', volatile)


def test_closing_closes_what_it_made(participant, volatile):
    node = participant.add_node('tester', '/')
    reader = participant.create_reader(node, '/words', STRING, '', volatile)
    participant.close()
    with pytest.raises(ClosedError, match='reader on rt/words'):
        reader.take()


def test_impossible_domain_is_an_error():
    with pytest.raises(ConfigurationError, match=r'0\.\.232, got 233'):
        Participant(233)


def test_unreadable_cyclone_settings_are_an_error_that_names_them(monkeypatch):
    monkeypatch.setenv('CYCLONEDDS_URI', 'file:///missing/settings.xml')
    with pytest.raises(ConfigurationError, match=r'_URI: file:///missing/settings\.xml'):
        Participant()


def test_cyclone_settings_of_a_file_are_used(monkeypatch, tmp_path, volatile):
    log = tmp_path / 'cyclone.log'
    path = tmp_path / 'settings.xml'
    path.write_text(
        '<CycloneDDS><Domain><General><Interfaces><NetworkInterface address="127.0.0.1"/>'
        '</Interfaces><AllowMulticast>false</AllowMulticast></General><Tracing><Verbosity>config'
        f'</Verbosity><OutputFile>{log}</OutputFile></Tracing></Domain></CycloneDDS>'
    )
    monkeypatch.setenv('CYCLONEDDS_URI', f'file://{path}')
    Participant().close()
    assert '127.0.0.1' in log.read_text()


def test_other_discovery_in_one_domain_is_an_error(participant, monkeypatch):
    monkeypatch.setenv('ROS_AUTOMATIC_DISCOVERY_RANGE', 'OFF')
    with pytest.raises(ConfigurationError, match='open in this process with other discovery'):
        Participant()


def test_process_that_forgets_to_close_ends_well(domain):
    program = (
        'from ros_standalone.middleware import Participant, WaitSet\n'
        'from rclpy.qos import QoSProfile\n'
        'import threading\n'
        'p = Participant()\n'
        'n = p.add_node("a", "/")\n'
        'r = p.create_reader(n, "/words", "std_msgs/msg/String", "", QoSProfile(depth=1))\n'
        'w = WaitSet(p)\n'
        'threading.Thread(target=w.wait, args=([r], None), daemon=True).start()\n'
    )
    environment = {**os.environ, 'PYTHONPATH': os.pathsep.join(filter(None, sys.path))}
    done = subprocess.run(
        [sys.executable, '-X', 'faulthandler', '-c', program],
        env=environment,
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert (done.returncode, done.stderr) == (0, '')


@pytest.mark.parametrize('seed', range(5))
def test_closing_in_any_order_while_threads_use_it_neither_crashes_nor_hangs(
    make_participant, volatile, seed
):
    participant = make_participant()
    node = participant.add_node('tester', '/')
    reader = participant.create_reader(node, '/words', STRING, '', volatile)
    writer = participant.create_writer(node, '/words', STRING, '', volatile)
    server = participant.create_server(node, '/ask', TRIGGER, '', volatile)
    client = participant.create_client(node, '/ask', TRIGGER, '', volatile)
    entities = [reader, writer, server, client]
    waitset = WaitSet(participant)
    ended = threading.Event()

    def use(action):
        while not ended.is_set():
            try:
                action()
            except ClosedError:
                return

    def look():
        participant.graph.topic_names_and_types()
        client.is_ready()

    def churn():
        participant.create_reader(node, '/words', STRING, '', volatile).close()

    actions = [
        lambda: writer.publish(PAYLOAD),
        lambda: (waitset.wait([reader, server], 0.01), reader.take()),
        lambda: client.send(PAYLOAD),
        look,
        churn,
    ]
    threads = [threading.Thread(target=use, args=(action,)) for action in actions]
    for thread in threads:
        thread.start()
    ended.wait(0.1)
    order = [*entities, waitset, participant]
    random.Random(seed).shuffle(order)
    for entity in order:
        entity.close()
    ended.set()
    for thread in threads:
        thread.join(10.0)
        assert not thread.is_alive()


def test_participants_leave_no_open_files_behind(make_participant, volatile):
    def opened():
        return len(list(Path('/proc/self/fd').iterdir()))

    make_participant().close()
    before = opened()
    for _ in range(5):
        make_participant().close()
    assert opened() == before
