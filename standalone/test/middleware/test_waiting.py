from __future__ import annotations

import threading
import time

import pytest

from ros_standalone.middleware import GuardCondition, WaitSet

STRING = 'std_msgs/msg/String'
PAYLOAD = bytes((0, 1, 0, 0)) + b'text'


@pytest.fixture
def waitset(participant):
    return WaitSet(participant)


@pytest.fixture
def node(participant):
    return participant.add_node('tester', '/')


def wait_in_thread(waitset, entities):
    """Start a wait without end; returns the thread and what it found."""
    found = []
    thread = threading.Thread(target=lambda: found.append(waitset.wait(entities, None)))
    thread.start()
    return thread, found


def test_time_runs_out_without_anything(waitset):
    before = time.monotonic()
    assert waitset.wait([], 0.15) == set()
    assert time.monotonic() - before >= 0.15


def test_no_time_means_a_look(waitset, participant):
    guard = GuardCondition(participant)
    assert waitset.wait([guard], 0.0) == set()
    guard.trigger()
    assert waitset.wait([guard], 0.0) == {guard}


def test_trigger_ends_one_wait(waitset, participant):
    guard = GuardCondition(participant)
    guard.trigger()
    assert waitset.wait([guard], 10.0) == {guard}
    assert waitset.wait([guard], 0.05) == set()


def test_trigger_of_another_thread_ends_a_wait_without_end(waitset, participant):
    guard = GuardCondition(participant)
    thread, found = wait_in_thread(waitset, [guard])
    guard.trigger()
    thread.join(10.0)
    assert found == [{guard}]


def test_only_what_is_ready_is_returned(waitset, participant):
    guards = [GuardCondition(participant) for _ in range(3)]
    guards[1].trigger()
    assert waitset.wait(guards, 10.0) == {guards[1]}


def test_entity_that_is_no_longer_waited_for_does_not_wake(waitset, participant):
    first, second = GuardCondition(participant), GuardCondition(participant)
    assert waitset.wait([first, second], 0.0) == set()
    first.trigger()
    assert waitset.wait([second], 0.05) == set()
    assert waitset.wait([first, second], 0.0) == {first}


def test_reader_is_ready_until_its_last_message_is_taken(waitset, participant, node, volatile):
    reader = participant.create_reader(node, '/words', STRING, '', volatile)
    writer = participant.create_writer(node, '/words', STRING, '', volatile)
    for _ in range(2):
        writer.publish(PAYLOAD)
    for _ in range(2):
        assert waitset.wait([reader], 10.0) == {reader}
        reader.take()
    assert waitset.wait([reader], 0.05) == set()


def test_closing_an_entity_ends_the_wait_for_it(waitset, participant, node, volatile):
    reader = participant.create_reader(node, '/words', STRING, '', volatile)
    thread, found = wait_in_thread(waitset, [reader])
    reader.close()
    thread.join(10.0)
    assert found == [set()]


def test_closing_the_wait_set_ends_its_wait(waitset, participant):
    thread, found = wait_in_thread(waitset, [GuardCondition(participant)])
    waitset.close()
    thread.join(10.0)
    assert found == [set()]


def test_closing_the_participant_ends_every_wait(make_participant):
    participant = make_participant()
    waits = [wait_in_thread(WaitSet(participant), []) for _ in range(3)]
    participant.close()
    for thread, found in waits:
        thread.join(10.0)
        assert found == [set()]


def test_closed_entity_is_passed_over(waitset, participant):
    guard = GuardCondition(participant)
    guard.close()
    guard.trigger()
    assert waitset.wait([guard], 0.05) == set()


def test_waiting_thread_does_not_stop_others(waitset):
    counted = 0
    thread = threading.Thread(target=waitset.wait, args=([], 0.3))
    thread.start()
    while thread.is_alive():
        counted += 1
    assert counted > 1000
