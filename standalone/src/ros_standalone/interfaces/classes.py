"""Message and service classes, made from their definitions when they are first asked for.

They behave as the Python classes that rosidl generates in ROS 2 Jazzy, with its field checks
always on.
"""

from __future__ import annotations

import array
import functools
import threading
from collections.abc import Callable
from operator import attrgetter
from typing import Any

from ros_standalone.interfaces.catalog import definition, split_type_name
from ros_standalone.interfaces.definitions import (
    Field,
    FieldType,
    MessageDefinition,
    ServiceDefinition,
)
from ros_standalone.interfaces.field_checks import (
    IDL_NAMES,
    TYPE_CODES,
    check_for,
    converter_for,
    python_type,
)

_lock = threading.RLock()


def load(type_name: str) -> type[Any]:
    """The class of an interface; always the same one for the same name.

    Args:
        type_name: Such as ``std_msgs/msg/String``, ``std_srvs/srv/Trigger`` or
            ``std_srvs/srv/Trigger_Request``.

    Raises:
        InterfaceNotFoundError: There is no such interface.
        InterfaceFormatError: Its file cannot be read.
    """
    with _lock:
        return _load(type_name)


@functools.cache
def _load(type_name: str) -> type[Any]:
    found = definition(type_name)
    if isinstance(found, ServiceDefinition):
        return _service_class(found)
    return _message_class(found)


class Message:
    """What all message classes share.

    A message takes its fields as keyword arguments; those left out have their default values.
    """

    __slots__: tuple[str, ...] = ()

    _definition: MessageDefinition
    _fields_and_field_types: dict[str, str]
    _defaults: tuple[tuple[str, Callable[[Any, Any], None], Callable[[], Any]], ...]
    _converters: dict[str, Callable[[Any], Any]]

    def __init__(self, **kwargs: Any) -> None:
        if not kwargs:
            for _, store, default in self._defaults:
                store(self, default())
            return
        kwargs.pop('check_fields', None)  # ROS 2's switch for the checks, which are always on here
        unknown = sorted(kwargs.keys() - self._fields_and_field_types.keys())
        if unknown:
            raise AssertionError(f'Invalid arguments passed to constructor: {", ".join(unknown)}')
        for name, store, default in self._defaults:
            if name not in kwargs:
                store(self, default())
                continue
            value = kwargs[name]
            converter = self._converters.get(name)
            setattr(self, name, value if converter is None else converter(value))

    @classmethod
    def get_fields_and_field_types(cls) -> dict[str, str]:
        """Names of the fields with their IDL types, such as ``sequence<double>``."""
        return dict(cls._fields_and_field_types)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, self.__class__):
            return False
        for slot in self.__slots__:
            unequal = getattr(self, slot) != getattr(other, slot)
            if unequal if isinstance(unequal, bool) else unequal.any():
                return False
        return True

    __hash__ = None  # type: ignore[assignment]

    def __repr__(self) -> str:
        package = self.__class__.__module__
        arguments = (f'{s[1:]}={_field_repr(getattr(self, s))}' for s in self.__slots__)
        return f'{package}.{self.__class__.__name__}({", ".join(arguments)})'


class Service:
    """What all service classes share."""

    _definition: ServiceDefinition
    Request: type[Message]
    Response: type[Message]
    Event: type[Message]

    def __init__(self) -> None:
        raise NotImplementedError('Service classes can not be instantiated')


def _field_repr(value: Any) -> str:
    if isinstance(value, array.array):
        return repr(value.tolist())
    return repr(value)


def _message_class(found: MessageDefinition) -> type[Message]:
    package, kind, name = split_type_name(found.type_name)
    namespace: dict[str, Any] = {
        '__module__': f'{package}.{kind}',
        '__qualname__': name,
        '__doc__': _docstring(found),
        '__slots__': tuple(f'_{field.name}' for field in found.fields),
        '_definition': found,
        '_fields_and_field_types': {field.name: _idl_name(field.type) for field in found.fields},
    }
    for constant in found.constants:
        namespace[constant.name] = constant.value
    for field in found.fields:
        if field.default is not None:
            namespace[f'{field.name.upper()}__DEFAULT'] = _default_of(field, None)()
    cls: type[Message] = type(name, (Message,), namespace)
    defaults = []
    converters = {}
    for field in found.fields:
        slot = cls.__dict__[f'_{field.name}']
        nested = load(field.type.base) if field.type.is_message else None
        check = check_for(field.name, field.type, nested)
        setattr(cls, field.name, _property(field.name, slot.__set__, check))
        defaults.append((field.name, slot.__set__, _default_of(field, nested)))
        converter = converter_for(field.name, field.type)
        if converter is not None:
            converters[field.name] = converter
    cls._defaults = tuple(defaults)
    cls._converters = converters
    return cls


def _property(
    name: str, store: Callable[[Any, Any], None], check: Callable[[Any], Any]
) -> property:
    def fset(self: Any, value: Any) -> None:
        store(self, check(value))

    return property(attrgetter(f'_{name}'), fset, doc=f"Message field '{name}'.")


def _service_class(found: ServiceDefinition) -> type[Service]:
    package, kind, name = split_type_name(found.type_name)
    namespace = {
        '__module__': f'{package}.{kind}',
        '__qualname__': name,
        '__doc__': f"Service class '{name}'.",
        '_definition': found,
        'Request': load(found.request.type_name),
        'Response': load(found.response.type_name),
        'Event': load(found.event.type_name),
    }
    return type(name, (Service,), namespace)


def _docstring(found: MessageDefinition) -> str:
    text = f"Message class '{found.type_name.rsplit('/', 1)[1]}'."
    if found.constants:
        text += '\n\nConstants:\n  ' + '\n  '.join(constant.name for constant in found.constants)
    return text


def _default_of(field: Field, nested: type[Any] | None) -> Callable[[], Any]:
    """What makes a field's default value anew each time."""
    kind, given = field.type, field.default
    if kind.is_single:
        if given is not None:
            return lambda: given
        if kind.base == 'byte':
            return lambda: b'\x00'
        return nested or python_type(kind.base)
    if kind.base in TYPE_CODES:
        if kind.is_array:
            return lambda: _numpy_array(given or [0] * (kind.size or 0), kind.base)
        code = TYPE_CODES[kind.base]
        return lambda: array.array(code, given or ())
    if given is not None:
        return lambda: list(given)
    if kind.is_array:
        make = _default_of(Field(field.name, FieldType(kind.base)), nested)
        return lambda: [make() for _ in range(kind.size or 0)]
    return list


def _numpy_array(values: list[Any], dtype: str) -> Any:
    import numpy as np

    return np.array(values, dtype=dtype)


def _idl_name(kind: FieldType) -> str:
    """A type as ``get_fields_and_field_types`` names it, such as ``sequence<double, 3>``."""
    if kind.is_message:
        package, _, name = kind.base.split('/')
        element = f'{package}/{name}'
    else:
        element = IDL_NAMES.get(kind.base, kind.base)
        if kind.string_bound is not None:
            element += f'<{kind.string_bound}>'
    if kind.is_array:
        return f'{element}[{kind.size}]'
    if kind.is_sequence:
        return f'sequence<{element}>' if kind.size is None else f'sequence<{element}, {kind.size}>'
    return element
