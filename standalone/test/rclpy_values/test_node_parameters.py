import pytest

from rcl_interfaces.msg import (
    FloatingPointRange,
    IntegerRange,
    ParameterDescriptor,
    ParameterValue,
    SetParametersResult,
)
from rclpy._node_parameters import NodeParameters
from rclpy.exceptions import (
    InvalidParameterException,
    InvalidParameterTypeException,
    InvalidParameterValueException,
    ParameterAlreadyDeclaredException,
    ParameterImmutableException,
    ParameterNotDeclaredException,
    ParameterUninitializedException,
)
from rclpy.parameter import Parameter
from rclpy.time import Time

Type = Parameter.Type
OK = SetParametersResult(successful=True)


class Recorded(NodeParameters):
    """Parameters whose events are kept in a list."""

    def __init__(self, **options):
        self.events = []
        super().__init__('/hand/golden', self.events.append, lambda: Time(seconds=5), **options)

    def set(self, name, value):
        return self.set_parameters([Parameter(name, value=value)])[0]

    def value(self, name):
        return self.get_parameter(name).value


def overridden(**values):
    return Recorded(overrides={name: Parameter(name, value=v) for name, v in values.items()})


def floats(low, high, step=0.0):
    return ParameterDescriptor(
        floating_point_range=[FloatingPointRange(from_value=low, to_value=high, step=step)]
    )


def integers(low, high, step=0):
    return ParameterDescriptor(
        integer_range=[IntegerRange(from_value=low, to_value=high, step=step)]
    )


# The texts of the next test are those that a real Jazzy gave for the same node.
@pytest.mark.parametrize(
    ('name', 'value', 'reason'),
    [
        ('budget', 3.5, ''),
        ('budget', 99.0, 'Parameter budget out of range Min: 0.0, Max: 60.0, value: 99.0'),
        ('directory', 'x', 'Trying to set a read-only parameter: directory.'),
        (
            'depth',
            4,
            'The parameter value for depth is not a valid step. Min: 1, max: 9, value: 4, step: 2',
        ),
        ('depth', 5, 'five is not allowed'),
    ],
)
def test_refusals_read_as_in_ros(name, value, reason):
    parameters = Recorded()
    parameters.declare_parameter('budget', 2.5, floats(0.0, 60.0))
    parameters.declare_parameter('directory', 'runs', ParameterDescriptor(read_only=True))
    parameters.declare_parameter('depth', 3, integers(1, 9, 2))
    parameters.add_on_set_parameters_callback(
        lambda ps: SetParametersResult(
            successful=all(p.value != 5 for p in ps), reason='five is not allowed'
        )
    )
    result = parameters.set(name, value)
    assert result.successful == (reason == '')
    assert result.reason == reason


def test_an_undeclared_parameter_cannot_be_set():
    with pytest.raises(ParameterNotDeclaredException) as refusal:
        Recorded().set('nope', 1)
    assert str(refusal.value) == 'Invalid access to undeclared parameter(s): []'


def test_an_undeclared_parameter_cannot_be_read():
    with pytest.raises(ParameterNotDeclaredException, match=r'parameter\(s\): nope'):
        Recorded().get_parameter('nope')


def test_a_parameter_keeps_its_type():
    parameters = Recorded()
    parameters.declare_parameter('rate', 1.0)
    result = parameters.set('rate', 'fast')
    assert result.reason == "Wrong parameter type, expected 'Type.DOUBLE' got 'Type.STRING'"


def test_an_integer_is_not_a_double():
    parameters = Recorded()
    parameters.declare_parameter('rate', 1.0)
    assert not parameters.set('rate', 2).successful


def test_a_dynamically_typed_parameter_changes_its_type():
    parameters = Recorded()
    parameters.declare_parameter('any', 1.0, ParameterDescriptor(dynamic_typing=True))
    assert parameters.set('any', 'text').successful
    assert parameters.describe_parameter('any').type == Type.STRING.value


def test_a_type_without_value_is_uninitialised_until_set():
    parameters = Recorded()
    parameters.declare_parameter('rate', Type.DOUBLE)
    with pytest.raises(ParameterUninitializedException, match="'rate' is not initialized"):
        parameters.get_parameter('rate')
    assert parameters.get_parameter_or('rate', Parameter('rate', value=7.0)).value == 7.0
    parameters.set('rate', 2.0)
    assert parameters.value('rate') == 2.0


def test_a_name_alone_is_declared_dynamically_with_a_warning():
    parameters = Recorded()
    with pytest.warns(UserWarning, match='only providing its name is deprecated'):
        parameters.declare_parameter('x')
    assert parameters.value('x') is None


def test_a_static_parameter_needs_a_value_or_type():
    with pytest.raises(ValueError, match='Cannot declare a statically typed parameter'):
        Recorded().declare_parameter('x', None, ParameterDescriptor())


def test_a_type_and_dynamic_typing_exclude_each_other():
    with pytest.raises(ValueError, match='`dynamic_typing=True` is not allowed'):
        Recorded().declare_parameter('x', Type.DOUBLE, ParameterDescriptor(dynamic_typing=True))


def test_a_static_parameter_cannot_be_undeclared_by_setting():
    parameters = Recorded()
    parameters.declare_parameter('x', 1)
    assert parameters.set('x', None).reason == 'Static parameter cannot be undeclared'


def test_a_dynamic_parameter_is_deleted_by_setting_nothing():
    parameters = Recorded()
    parameters.declare_parameter('x', 1, ParameterDescriptor(dynamic_typing=True))
    parameters.set('x', None)
    assert not parameters.has_parameter('x')
    assert [p.name for p in parameters.events[-1].deleted_parameters] == ['x']


def test_a_second_declaration_is_refused():
    parameters = Recorded()
    parameters.declare_parameter('x', 1)
    with pytest.raises(ParameterAlreadyDeclaredException, match=r"already declared: \['x'\]"):
        parameters.declare_parameter('x', 1)


def test_an_empty_name_is_refused():
    with pytest.raises(InvalidParameterException, match='Invalid parameter name'):
        Recorded().declare_parameter('', 1)


def test_a_default_out_of_range_is_refused():
    with pytest.raises(InvalidParameterValueException, match='out of range'):
        Recorded().declare_parameter('x', 11, integers(0, 10))


@pytest.mark.parametrize(
    ('entry', 'message'),
    [
        ((), 'Invalid parameter tuple length at index 0'),
        (('a', 1, ParameterDescriptor(), 4), 'Invalid parameter tuple length at index 0'),
        ((3, 1), 'First element 3 at index 0'),
        (('a', 1, 'text'), 'Third element text at index 0'),
    ],
)
def test_malformed_declarations_are_refused(entry, message):
    with pytest.raises(TypeError, match=message):
        Recorded().declare_parameters('', [entry])


def test_a_namespace_stands_before_the_names():
    parameters = Recorded()
    parameters.declare_parameters('ns', [('a', 1), ('b', 2)])
    assert parameters.get_parameters_by_prefix('ns').keys() == {'a', 'b'}


def test_an_override_wins_over_the_default():
    parameters = overridden(x=5)
    assert parameters.declare_parameter('x', 1).value == 5


def test_an_override_can_be_ignored():
    assert overridden(x=5).declare_parameter('x', 1, ignore_override=True).value == 1


def test_an_override_sets_even_a_read_only_parameter():
    descriptor = ParameterDescriptor(read_only=True)
    assert overridden(x=5).declare_parameter('x', 1, descriptor).value == 5


def test_an_override_of_another_type_is_refused():
    with pytest.raises(InvalidParameterTypeException) as refusal:
        overridden(x='five').declare_parameter('x', 1.0)
    assert str(refusal.value) == (
        "Trying to set parameter 'x' to 'five' of type 'STRING', expecting type 'DOUBLE': x"
    )


def test_an_override_out_of_range_is_refused():
    with pytest.raises(InvalidParameterValueException) as refusal:
        overridden(x=99.0).declare_parameter('x', 1.0, floats(0.0, 60.0))
    assert str(refusal.value) == (
        'Invalid parameter value (99.0) for parameter. Reason: '
        'Parameter x out of range Min: 0.0, Max: 60.0, value: 99.0: x'
    )


def test_overrides_can_be_declared_all_at_once():
    parameters = overridden(x=5, y='z')
    parameters.declare_overrides()
    assert (parameters.value('x'), parameters.value('y')) == (5, 'z')


@pytest.mark.parametrize('value', [0, 10, 3, 6, 9])
def test_both_ends_and_the_steps_of_an_integer_range_are_good(value):
    parameters = Recorded()
    parameters.declare_parameter('x', 0, integers(0, 10, 3))
    assert parameters.set('x', value).successful


@pytest.mark.parametrize('value', [-1, 11, 1, 8])
def test_what_is_beside_an_integer_range_or_its_steps_is_not(value):
    parameters = Recorded()
    parameters.declare_parameter('x', 0, integers(0, 10, 3))
    assert not parameters.set('x', value).successful


@pytest.mark.parametrize('value', [0.0, 0.1, 0.3, 1.0, 0.7 + 1e-9])
def test_float_steps_allow_for_rounding(value):
    parameters = Recorded()
    parameters.declare_parameter('x', 0.0, floats(0.0, 1.0, 0.1))
    assert parameters.set('x', value).successful


def test_a_float_off_the_steps_is_refused():
    parameters = Recorded()
    parameters.declare_parameter('x', 0.0, floats(0.0, 1.0, 0.1))
    assert parameters.set('x', 0.15).reason == (
        'The parameter value for x is not close enough to a valid step. '
        'Min: 0.0, max: 1.0, value: 0.15, step: 0.1'
    )


def test_an_atomic_set_sets_all_or_none():
    parameters = Recorded()
    parameters.declare_parameters('', [('a', 1), ('b', 1, integers(0, 5))])
    wanted = [Parameter('a', value=2), Parameter('b', value=9)]
    assert not parameters.set_parameters_atomically(wanted).successful
    assert parameters.value('a') == 1
    wanted[1] = Parameter('b', value=3)
    assert parameters.set_parameters_atomically(wanted).successful
    assert (parameters.value('a'), parameters.value('b')) == (2, 3)


def test_events_tell_new_and_changed_parameters_with_node_and_time():
    parameters = Recorded()
    parameters.declare_parameter('a', 1)
    parameters.set('a', 2)
    first, second = parameters.events
    assert [p.name for p in first.new_parameters] == ['a']
    assert [p.value.integer_value for p in second.changed_parameters] == [2]
    assert (second.node, second.stamp.sec) == ('/hand/golden', 5)


def test_a_refused_set_makes_no_event():
    parameters = Recorded()
    parameters.declare_parameter('a', 1)
    parameters.set('a', 'x')
    assert len(parameters.events) == 1


def test_callbacks_are_called_in_order_and_the_newest_first():
    parameters, calls = Recorded(), []
    parameters.declare_parameter('a', 1)

    def noted(name, result):
        def callback(ps):
            calls.append((name, parameters.value('a')))
            return ps if result is None else result

        return callback

    parameters.add_pre_set_parameters_callback(noted('pre', None))
    parameters.add_on_set_parameters_callback(noted('on 1', OK))
    parameters.add_on_set_parameters_callback(noted('on 2', OK))
    parameters.add_post_set_parameters_callback(noted('post', None))
    parameters.set('a', 2)
    assert calls == [('pre', 1), ('on 2', 1), ('on 1', 1), ('post', 2)]


def test_a_removed_callback_is_not_called():
    parameters = Recorded()
    parameters.declare_parameter('a', 1)

    def refuse(ps):
        return SetParametersResult(successful=False, reason='no')

    parameters.add_on_set_parameters_callback(refuse)
    parameters.remove_on_set_parameters_callback(refuse)
    assert parameters.set('a', 2).successful


def test_a_callback_that_returns_no_result_refuses():
    parameters = Recorded()
    parameters.declare_parameter('a', 1)
    parameters.add_on_set_parameters_callback(lambda ps: None)
    with pytest.warns(UserWarning, match='invalid type'):
        assert not parameters.set('a', 2).successful


def test_a_callback_must_be_callable():
    with pytest.raises(TypeError, match='Callback must be callable'):
        Recorded().add_on_set_parameters_callback(3)


def test_a_pre_set_callback_changes_what_is_set():
    parameters = Recorded()
    parameters.declare_parameters('', [('a', 1), ('twice', 2)])
    parameters.add_pre_set_parameters_callback(
        lambda ps: [*ps, *(Parameter('twice', value=2 * p.value) for p in ps)]
    )
    parameters.set('a', 4)
    assert parameters.value('twice') == 8


def test_a_pre_set_callback_that_leaves_nothing_refuses():
    parameters = Recorded()
    parameters.declare_parameter('a', 1)
    parameters.add_pre_set_parameters_callback(lambda ps: [])
    assert parameters.set('a', 2).reason.startswith('parameter list cannot be empty')


def test_undeclaring_takes_away():
    parameters = Recorded()
    parameters.declare_parameter('a', 1)
    parameters.undeclare_parameter('a')
    assert not parameters.has_parameter('a')


def test_a_read_only_parameter_stays():
    parameters = Recorded()
    parameters.declare_parameter('a', 1, ParameterDescriptor(read_only=True))
    with pytest.raises(ParameterImmutableException, match='read-only parameter: a'):
        parameters.undeclare_parameter('a')


def test_undeclared_parameters_may_be_allowed():
    parameters = Recorded(allow_undeclared=True)
    assert parameters.get_parameter('a').type_ is Type.NOT_SET
    parameters.set('a', 1)
    parameters.set('a', 'now text')
    assert parameters.value('a') == 'now text'


def test_a_new_descriptor_may_bring_its_value():
    parameters = Recorded()
    parameters.declare_parameter('a', 1)
    descriptor = integers(5, 9)
    descriptor.type = Type.INTEGER.value
    value = parameters.set_descriptor('a', descriptor, ParameterValue(type=2, integer_value=6))
    assert value.integer_value == 6
    assert not parameters.set('a', 1).successful


def test_a_new_descriptor_that_refuses_every_value_is_refused():
    parameters = Recorded()
    parameters.declare_parameter('a', 1)
    descriptor = integers(5, 9)
    descriptor.type = Type.INTEGER.value
    with pytest.raises(InvalidParameterValueException, match='out of range'):
        parameters.set_descriptor('a', descriptor)
    assert parameters.value('a') == 1


@pytest.mark.parametrize(
    ('prefixes', 'depth', 'names'),
    [
        ([], 0, ['top', 'a.x', 'a.b.y', 'ab.z']),
        ([], 1, ['top']),
        ([], 2, ['top', 'a.x', 'ab.z']),
        (['a'], 0, ['a.x', 'a.b.y']),
        (['a'], 1, ['a.x']),
        (['a.b'], 1, ['a.b.y']),
        (['top'], 1, ['top']),
        (['nothing'], 0, []),
    ],
)
def test_names_are_listed_by_prefix_and_depth(prefixes, depth, names):
    parameters = Recorded()
    parameters.declare_parameters('', [(n, 1) for n in ('top', 'a.x', 'a.b.y', 'ab.z')])
    assert parameters.list_parameters(prefixes, depth).names == names


def test_listing_tells_the_prefixes():
    parameters = Recorded()
    parameters.declare_parameters('', [(n, 1) for n in ('top', 'a.x', 'a.b.y', 'a.b.z')])
    assert parameters.list_parameters([], 0).prefixes == ['a', 'a.b']
