from __future__ import annotations

import threading
import time

import pytest

import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.executors import (
    ConditionReachedException,
    ExternalShutdownException,
    MultiThreadedExecutor,
    ShutdownException,
    SingleThreadedExecutor,
    TimeoutException,
)
from rclpy.task import Future

TIMEOUT = 20.0


def guards(node, callbacks, group):
    """Trigger a guard condition of the group for each callback."""
    for callback in callbacks:
        node.create_guard_condition(callback, group).trigger()


def test_spin_once_waits_no_longer_than_its_timeout(executor):
    start = time.monotonic()
    executor.spin_once(timeout_sec=0.1)
    assert 0.1 <= time.monotonic() - start < 5.0


def test_spin_once_without_time_looks_once(node, executor):
    calls = []
    guards(node, [lambda: calls.append(True)], None)
    executor.spin_once(timeout_sec=0)
    assert calls == [True]


def test_an_error_of_a_callback_comes_out_of_spin(node, executor):
    guards(node, [lambda: 1 / 0], None)
    with pytest.raises(ZeroDivisionError):
        executor.spin()


def test_an_error_of_a_callback_comes_out_of_a_threaded_spin_at_once(node, executor):
    executor.shutdown()
    with MultiThreadedExecutor(2) as threaded:
        threaded.add_node(node)
        guards(node, [lambda: 1 / 0], None)
        with pytest.raises(ZeroDivisionError):
            threaded.spin()


def test_an_interrupt_in_a_callback_frees_its_group(node, executor):
    calls = []

    def interrupt():
        raise KeyboardInterrupt

    guards(node, [interrupt], None)
    with pytest.raises(KeyboardInterrupt):
        executor.spin()
    guards(node, [lambda: calls.append(True)], None)
    executor.spin_once(timeout_sec=TIMEOUT)
    assert calls == [True]


def test_a_guard_condition_that_was_triggered_twice_is_served_once(node, executor):
    calls = []
    guard = node.create_guard_condition(lambda: calls.append(True))
    guard.trigger()
    guard.trigger()
    executor.spin_once(timeout_sec=TIMEOUT)
    executor.spin_once(timeout_sec=0)
    assert calls == [True]


def test_a_trigger_from_another_thread_wakes_the_executor(node, executor):
    calls = []
    guard = node.create_guard_condition(lambda: calls.append(True))
    threading.Timer(0.05, guard.trigger).start()
    executor.spin_once(timeout_sec=TIMEOUT)
    assert calls == [True]


def test_a_node_that_is_added_wakes_the_executor(node, executor, in_background):
    in_background(executor)
    called = threading.Event()
    other = rclpy.create_node('other')
    other.create_guard_condition(called.set).trigger()
    executor.add_node(other)
    assert called.wait(TIMEOUT)


def test_an_entity_that_is_created_wakes_the_executor(node, executor, in_background):
    in_background(executor)
    called = threading.Event()
    node.create_timer(0.01, called.set)
    assert called.wait(TIMEOUT)


def test_a_node_that_was_removed_is_not_served(node, executor):
    calls = []
    guards(node, [lambda: calls.append(True)], None)
    executor.remove_node(node)
    executor.spin_once(timeout_sec=0.05)
    assert calls == []


def test_a_node_has_one_executor(node, executor):
    with SingleThreadedExecutor() as other:
        assert other.add_node(node)
        assert (node.executor, executor.get_nodes()) == (other, [])


def test_adding_a_node_twice_returns_false(node, executor):
    assert not executor.add_node(node)


def test_a_task_is_run_and_its_result_is_that_of_the_function(executor):
    task = executor.create_task(lambda a, b: a + b, 1, b=2)
    executor.spin_until_future_complete(task, TIMEOUT)
    assert task.result() == 3


def test_a_coroutine_goes_on_when_another_thread_ends_what_it_waits_for(executor):
    future = Future()

    async def wait():
        return await future

    task = executor.create_task(wait)
    threading.Timer(0.05, future.set_result, ['here']).start()
    executor.spin_until_future_complete(task, TIMEOUT)
    assert task.result() == 'here'


def test_a_coroutine_in_a_pool_misses_no_end_of_what_it_waits_for(node, executor):
    executor.shutdown()

    async def wait_often():
        for _ in range(200):
            future = Future()
            setter = threading.Thread(target=future.set_result, args=[None])
            setter.start()
            await future
        return True

    with MultiThreadedExecutor(4) as threaded:
        tasks = [threaded.create_task(wait_often) for _ in range(4)]
        for task in tasks:
            threaded.spin_until_future_complete(task, TIMEOUT)
    assert [task.result() for task in tasks] == [True] * 4


def test_tasks_that_always_go_on_do_not_starve_entities(node, executor):
    called = Future()

    class Step:
        def __await__(self):
            yield

    async def forever():
        while not called.done():
            await Step()

    executor.create_task(forever)
    guards(node, [lambda: called.set_result(True)], None)
    executor.spin_until_future_complete(called, TIMEOUT)
    assert called.done()


def test_spin_until_future_complete_ends_with_the_time(executor):
    future = Future()
    executor.spin_until_future_complete(future, 0.05)
    assert not future.done()


def test_spin_until_future_complete_ends_when_another_thread_cancels(executor):
    future = Future()
    threading.Timer(0.05, future.cancel).start()
    start = time.monotonic()
    executor.spin_until_future_complete(future, TIMEOUT)
    assert future.cancelled()
    assert time.monotonic() - start < TIMEOUT / 2


def test_a_done_callback_runs_in_the_thread_that_spins(executor):
    threads = []
    future = executor.create_future()
    future.add_done_callback(lambda ended: threads.append(threading.get_ident()))
    setter = threading.Thread(target=future.set_result, args=[None])
    setter.start()
    setter.join()
    executor.spin_once(timeout_sec=TIMEOUT)
    assert threads == [threading.get_ident()]


def test_spinning_ends_when_another_thread_shuts_the_executor_down(executor):
    threading.Timer(0.05, executor.shutdown).start()
    executor.spin()


def test_spinning_ends_with_an_error_when_the_context_is_shut_down(executor):
    context = rclpy.get_default_context()
    threading.Timer(0.05, context.shutdown).start()
    with pytest.raises(ExternalShutdownException):
        executor.spin()


def test_a_callback_may_shut_the_context_down(node, executor):
    guards(node, [rclpy.shutdown], None)
    executor.spin()
    assert not rclpy.ok()


def test_shutdown_waits_for_the_callback_that_runs(node, executor, in_background):
    entered, leave, left = threading.Event(), threading.Event(), []

    def callback():
        entered.set()
        leave.wait(TIMEOUT)
        left.append(True)

    guards(node, [callback], None)
    in_background(executor)
    assert entered.wait(TIMEOUT)
    in_time = executor.shutdown(0.05)
    leave.set()
    assert (in_time, executor.shutdown(TIMEOUT), left) == (False, True, [True])


def test_a_custom_executor_gets_its_work_from_wait_for_ready_callbacks(node, executor):
    calls = []
    guards(node, [lambda: calls.append(True)], None)
    task, entity, owner = executor.wait_for_ready_callbacks(TIMEOUT)
    task()
    assert (owner, entity in list(node.guards), calls) == (node, True, [True])


def test_the_reasons_for_no_work_are_told_apart(executor):
    with pytest.raises(TimeoutException):
        executor.wait_for_ready_callbacks(0)
    with pytest.raises(ConditionReachedException):
        executor.wait_for_ready_callbacks(None, None, lambda: True)
    executor.shutdown()
    with pytest.raises(ShutdownException):
        executor.wait_for_ready_callbacks(0)


def test_callbacks_of_a_reentrant_group_run_at_the_same_time(node, executor, in_background):
    executor.shutdown()
    both = threading.Barrier(2)
    met = []

    def meet():
        both.wait(TIMEOUT)
        met.append(True)

    with MultiThreadedExecutor(2) as threaded:
        threaded.add_node(node)
        guards(node, [meet, meet], ReentrantCallbackGroup())
        while len(met) < 2:
            threaded.spin_once(timeout_sec=0.1)


def test_callbacks_of_an_exclusive_group_run_one_at_a_time(node, executor):
    executor.shutdown()
    inside, most, left = [], [], []

    def callback():
        inside.append(True)
        most.append(len(inside))
        time.sleep(0.002)
        inside.pop()
        left.append(True)

    with MultiThreadedExecutor(4) as threaded:
        threaded.add_node(node)
        guards(node, [callback] * 20, MutuallyExclusiveCallbackGroup())
        end = time.monotonic() + TIMEOUT
        while len(left) < 20 and time.monotonic() < end:
            threaded.spin_once(timeout_sec=0.1)
    assert (len(left), max(most)) == (20, 1)


def test_a_coroutine_holds_its_exclusive_group_while_it_waits(node, executor):
    future, order = Future(), []

    async def first():
        order.append('first begins')
        await future
        order.append('first ends')

    guards(node, [first, lambda: order.append('second')], MutuallyExclusiveCallbackGroup())
    executor.spin_once(timeout_sec=TIMEOUT)
    executor.spin_once(timeout_sec=0.05)
    future.set_result(None)
    executor.spin_once(timeout_sec=TIMEOUT)
    executor.spin_once(timeout_sec=TIMEOUT)
    assert order == ['first begins', 'first ends', 'second']


def test_idle_spinning_takes_no_time_of_the_processor(executor, in_background):
    in_background(executor)
    time.sleep(0.2)
    before = time.process_time()
    time.sleep(1.0)
    assert time.process_time() - before < 0.05
