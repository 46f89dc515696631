from __future__ import annotations

import pytest

import rclpy
from rclpy.context import Context
from rclpy.exceptions import InvalidHandle, NotInitializedException, RCLError
from rclpy.executors import SingleThreadedExecutor


def test_a_context_is_ok_from_init_to_shutdown():
    context = Context()
    states = [context.ok()]
    context.init(args=[])
    states.append(context.ok())
    context.shutdown()
    assert [*states, context.ok()] == [False, True, False]


def test_a_context_is_initialised_once():
    context = Context()
    context.init(args=[])
    with pytest.raises(RuntimeError, match=r'Context\.init\(\) must only be called once'):
        context.init(args=[])
    context.shutdown()


def test_a_second_shutdown_is_an_error():
    context = Context()
    context.init(args=[])
    context.shutdown()
    with pytest.raises(RCLError, match='rcl_shutdown already called'):
        context.shutdown()


def test_a_second_try_shutdown_is_none():
    context = Context()
    context.init(args=[])
    context.try_shutdown()
    context.try_shutdown()
    assert not context.ok()


def test_shutdown_before_init_is_an_error():
    with pytest.raises(RuntimeError, match='must be initialized before it can be shutdown'):
        Context().shutdown()


def test_a_negative_domain_is_refused():
    with pytest.raises(RuntimeError, match=r'Domain id \(-1\) should not be lower than zero'):
        Context().init(args=[], domain_id=-1)


def test_the_domain_given_wins_over_the_environment(domain):
    context = Context()
    context.init(args=[], domain_id=domain + 1)
    assert context.get_domain_id() == domain + 1
    context.shutdown()


def test_the_domain_comes_from_the_environment(ros, domain):
    assert rclpy.get_default_context().get_domain_id() == domain


def test_a_with_block_shuts_the_context_down():
    context = Context()
    context.init(args=[])
    with context:
        assert context.ok()
    assert not context.ok()


def test_a_with_block_on_init_shuts_down_and_lets_init_follow():
    for _ in range(2):
        with rclpy.init(args=[]) as initialised:
            assert initialised.context.ok()
        assert not rclpy.ok()


def test_shutdown_calls_each_callback_once():
    context = Context()
    context.init(args=[])
    calls = []
    context.on_shutdown(lambda: calls.append('first'))
    context.on_shutdown(lambda: calls.append('second'))
    context.shutdown()
    assert calls == ['first', 'second']


def test_a_callback_that_comes_after_shutdown_is_called_at_once():
    context = Context()
    context.init(args=[])
    context.shutdown()
    calls = []
    context.on_shutdown(lambda: calls.append(True))
    assert calls == [True]


def test_shutdown_destroys_the_nodes(ros):
    node = rclpy.create_node('doomed')
    rclpy.shutdown()
    with pytest.raises(InvalidHandle):
        node.create_guard_condition(None)


def test_a_node_needs_init():
    with pytest.raises(
        NotInitializedException, match=r'rclpy\.init\(\) has not been called.*cannot create node'
    ):
        rclpy.create_node('early')


def test_an_executor_needs_init():
    with pytest.raises(NotInitializedException):
        SingleThreadedExecutor()


def test_two_contexts_in_one_process_see_each_other(ros):
    other = Context()
    other.init(args=[])
    with other:
        rclpy.create_node('there', context=other)
        assert rclpy.create_node('here').wait_for_node('/there', 10.0)
