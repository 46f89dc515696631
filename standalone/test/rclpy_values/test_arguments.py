import pytest

from rclpy import _log_output
from rclpy._arguments import apply_log_levels, parse, remove_ros_args
from rclpy._rclpy_pybind11 import RCLInvalidROSArgsError, UnknownROSArgsError
from rclpy.logging import LoggingSeverity


def ros(*arguments):
    return parse(['program', '--ros-args', *arguments])


def test_other_arguments_stay_in_their_order():
    arguments = ['a', '--ros-args', '-r', 'x:=y', '--', 'b', '--ros-args', '-p', 'c:=1']
    assert parse(arguments).unparsed == ('a', 'b')
    assert remove_ros_args(arguments) == ['a', 'b']


def test_rules_outside_ros_args_are_not_ros_arguments():
    arguments = parse(['program', '-r', 'a:=b'])
    assert arguments.remappings == ()
    assert arguments.unparsed == ('program', '-r', 'a:=b')


def test_an_end_without_ros_args_is_an_argument():
    assert parse(['program', '--', 'x']).unparsed == ('program', '--', 'x')


@pytest.mark.parametrize('flag', ['-p', '--param'])
def test_a_parameter_counts_for_every_node(flag):
    arguments = ros(flag, 'limits.speed:=1.5')
    assert arguments.parameter_overrides('/hand/golden') == {'limits.speed': 1.5}


def test_a_parameter_for_one_node_counts_for_it_alone():
    arguments = ros('-p', 'golden:depth:=3')
    assert arguments.parameter_overrides('/hand/golden') == {'depth': 3}
    assert arguments.parameter_overrides('/hand/silver') == {}


def test_the_later_parameter_wins():
    assert ros('-p', 'a:=1', '-p', 'a:=2').parameter_overrides('/n') == {'a': 2}


def test_a_parameter_after_a_file_wins_over_it(tmp_path):
    path = tmp_path / 'p.yaml'
    path.write_text('/**:\n  ros__parameters: {a: 1, b: 1}\nn:\n  ros__parameters: {a: 3}\n')
    arguments = ros('--params-file', str(path), '-p', 'a:=2')
    assert arguments.parameter_overrides('/n') == {'a': 2, 'b': 1}


def test_a_value_may_hold_the_separator():
    assert ros('-p', "a:='x:=y'").parameter_overrides('/n') == {'a': 'x:=y'}


def test_log_levels_are_read_for_all_and_for_one():
    arguments = ros('--log-level', 'warn', '--log-level', 'hand.golden:=DEBUG')
    assert arguments.log_level is LoggingSeverity.WARN
    assert arguments.logger_levels == {'hand.golden': LoggingSeverity.DEBUG}


def test_log_levels_reach_the_loggers():
    try:
        apply_log_levels(ros('--log-level', 'warn', '--log-level', 'a.b:=debug'))
        assert _log_output.effective_level('a') is LoggingSeverity.WARN
        assert _log_output.effective_level('a.b.c') is LoggingSeverity.DEBUG
    finally:
        _log_output.reset()


@pytest.mark.parametrize('output', ['stdout', 'rosout', 'external_lib'])
def test_log_outputs_are_switched(output):
    flag = f'{output.replace("_", "-")}-logs'
    assert getattr(ros(), f'{output}_logs') is True
    assert getattr(ros(f'--disable-{flag}'), f'{output}_logs') is False
    assert getattr(ros(f'--disable-{flag}', f'--enable-{flag}'), f'{output}_logs') is True


@pytest.mark.parametrize('flag', ['-e', '--enclave'])
def test_the_enclave_is_read(flag):
    assert ros(flag, '/lab').enclave == '/lab'


def test_unknown_ros_arguments_are_named():
    with pytest.raises(UnknownROSArgsError, match=r"\['--bogus', 'x'\]"):
        ros('--bogus', '-r', 'a:=b', 'x')


@pytest.mark.parametrize(
    ('arguments', 'message'),
    [
        (['-r'], "Couldn't parse trailing -r flag. No remap rule found."),
        (['-r', 'a'], "Couldn't parse remap rule: '-r a'. Error: "),
        (['-p'], "Couldn't parse trailing -p flag. No parameter override rule found."),
        (['--param', 'a'], "Couldn't parse parameter override rule: '--param a'. Error: "),
        (['-p', ':=1'], "expected a parameter's name before ':='"),
        (['-p', 'a:=[1, x]'], 'Sequence should be of same type, got int and str'),
        (['-p', 'a:={b: 1}'], 'expected a value or a list of values'),
        (['-p', 'a:='], 'No value'),
        (['-p', 'a:=[1'], "'[1' is not YAML"),
        (['--params-file'], "Couldn't parse trailing --params-file flag. No file path provided."),
        (['--params-file', '/nowhere.yaml'], "'/nowhere.yaml': No such file or directory"),
        (['--log-level', 'loud'], "got 'loud'"),
        (['--log-level', ':=info'], 'without a logger'),
        (['-e', 'lab'], "must be absolute, it must lead with a '/'"),
        (['--log-config-file', 'x'], 'writes no log files'),
    ],
)
def test_a_malformed_argument_says_what_is_wrong(arguments, message):
    with pytest.raises(RCLInvalidROSArgsError) as refusal:
        ros(*arguments)
    assert message in str(refusal.value)


def test_a_missing_value_is_not_taken_from_beyond_the_end():
    with pytest.raises(RCLInvalidROSArgsError, match='trailing -r flag'):
        parse(['program', '--ros-args', '-r', '--', 'a:=b'])
