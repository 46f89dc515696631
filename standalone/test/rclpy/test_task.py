from __future__ import annotations

import gc

import pytest

from rclpy.task import Future, Task


def test_a_result_ends_a_future():
    future = Future()
    states = [future.done()]
    future.set_result(3)
    assert [*states, future.done(), future.result()] == [False, True, 3]


def test_an_exception_is_raised_by_the_result():
    future = Future()
    future.set_exception(ValueError('wrong'))
    with pytest.raises(ValueError, match='wrong'):
        future.result()


def test_a_cancelled_future_is_not_done():
    future = Future()
    future.cancel()
    assert (future.cancelled(), future.done()) == (True, False)


def test_a_future_with_a_result_is_not_cancelled_any_more():
    future = Future()
    future.set_result(1)
    future.cancel()
    assert (future.cancelled(), future.result()) == (False, 1)


def test_done_callbacks_are_called_at_the_end_and_after_it():
    future, calls = Future(), []
    future.add_done_callback(lambda ended: calls.append(('before', ended.result())))
    future.set_result(5)
    future.add_done_callback(lambda ended: calls.append(('after', ended.result())))
    assert calls == [('before', 5), ('after', 5)]


def test_an_error_in_a_done_callback_does_not_keep_the_next_from_its_call():
    future, calls = Future(), []
    future.add_done_callback(lambda ended: 1 / 0)
    future.add_done_callback(calls.append)
    with pytest.warns(UserWarning, match='Unhandled exception in done callback: division by zero'):
        future.set_result(None)
    assert calls == [future]


def test_an_exception_that_nobody_asked_for_is_reported(capsys):
    future = Future()
    future.set_exception(ValueError('lost'))
    del future
    gc.collect()
    assert capsys.readouterr().err == ('The following exception was never retrieved: lost\n')


def test_an_exception_that_was_asked_for_is_not_reported(capsys):
    future = Future()
    future.set_exception(ValueError('seen'))
    future.exception()
    del future
    gc.collect()
    assert capsys.readouterr().err == ''


def test_a_task_runs_a_function_with_its_arguments():
    task = Task(lambda a, b: a - b, (7,), {'b': 2})
    task()
    assert task.result() == 5


def test_a_task_runs_a_coroutine_over_several_calls():
    future = Future()

    async def add_one():
        return await future + 1

    task = Task(add_one)
    task()
    assert not task.done()
    future.set_result(1)
    task()
    assert task.result() == 2


def test_a_task_that_has_ended_does_not_run_again():
    calls = []
    task = Task(lambda: calls.append(True))
    task()
    task()
    assert calls == [True]


def test_what_is_not_an_exception_passes_through_a_task_and_ends_it():
    def interrupt():
        raise KeyboardInterrupt

    task = Task(interrupt)
    with pytest.raises(KeyboardInterrupt):
        task()
    assert task.cancelled()
