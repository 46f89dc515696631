"""The functions of Cyclone DDS's C library that are used, called through ctypes.

The Python wrapper's own read and write functions hold the interpreter's lock while they wait for
a slow reader or for a lock of a discovery thread. ctypes releases it around every call, so no
thread of a program stops because another one waits in DDS.
"""

from __future__ import annotations

import ctypes
from typing import Any

from cyclonedds.internal import DDS

from ros_standalone.middleware.errors import MiddlewareError

ANY_STATE = 3 | 12 | 112
"""Sample, view and instance states of a read condition: everything there is."""
ALIVE = 16
"""Instance state of a builtin sample whose entity exists."""
INFINITE = (1 << 63) - 1
"""Nanoseconds that mean forever."""
BUILTIN_PARTICIPANTS = 0x7FFF0001
BUILTIN_PUBLICATIONS = 0x7FFF0003
BUILTIN_SUBSCRIPTIONS = 0x7FFF0004

_TIMEOUT = -10


class Sample(ctypes.Structure):
    """What the Python wrapper's type support reads from and writes to: serialized bytes."""

    _fields_ = (('data', ctypes.c_void_p), ('size', ctypes.c_size_t))


class SampleInfo(ctypes.Structure):
    """dds_sample_info_t: what DDS says about a sample."""

    _fields_ = (
        ('sample_state', ctypes.c_uint),
        ('view_state', ctypes.c_uint),
        ('instance_state', ctypes.c_uint),
        ('valid_data', ctypes.c_bool),
        ('source_timestamp', ctypes.c_int64),
        ('instance_handle', ctypes.c_uint64),
        ('publication_handle', ctypes.c_uint64),
        ('disposed_generation_count', ctypes.c_uint32),
        ('no_writers_generation_count', ctypes.c_uint32),
        ('sample_rank', ctypes.c_uint32),
        ('generation_rank', ctypes.c_uint32),
        ('absolute_generation_rank', ctypes.c_uint32),
    )


class Guid(ctypes.Structure):
    """dds_guid_t: participant prefix and entity id in network order."""

    _fields_ = (('bytes', ctypes.c_uint8 * 16),)


class BuiltinParticipant(ctypes.Structure):
    """dds_builtintopic_participant: a sample of the builtin topic of participants."""

    _fields_ = (('key', Guid), ('qos', ctypes.c_void_p))


class BuiltinEndpoint(ctypes.Structure):
    """dds_builtintopic_endpoint: a sample of the builtin topics of writers and readers."""

    _fields_ = (
        ('key', Guid),
        ('participant_key', Guid),
        ('participant_instance_handle', ctypes.c_uint64),
        ('topic_name', ctypes.c_char_p),
        ('type_name', ctypes.c_char_p),
        ('qos', ctypes.c_void_p),
    )


class IncompatibleQosStatus(ctypes.Structure):
    """dds_offered_incompatible_qos_status and its requested counterpart."""

    _fields_ = (
        ('total_count', ctypes.c_uint32),
        ('total_count_change', ctypes.c_int32),
        ('last_policy_id', ctypes.c_uint32),
    )


_library = ctypes.CDLL(DDS._dll_handle._name)

_entity = ctypes.c_int32
_result = ctypes.c_int32
_duration = ctypes.c_int64
_handle = ctypes.c_uint64
_pointer = ctypes.c_void_p


def _function(name: str, result: Any, *arguments: Any) -> Any:
    function = getattr(_library, name)
    function.restype = result
    function.argtypes = arguments
    return function


create_domain = _function('dds_create_domain', _entity, ctypes.c_uint32, ctypes.c_char_p)
create_participant = _function(
    'dds_create_participant', _entity, ctypes.c_uint32, _pointer, _pointer
)
create_writer = _function('dds_create_writer', _entity, _entity, _entity, _pointer, _pointer)
create_reader = _function('dds_create_reader', _entity, _entity, _entity, _pointer, _pointer)
create_read_condition = _function('dds_create_readcondition', _entity, _entity, ctypes.c_uint32)
create_guard_condition = _function('dds_create_guardcondition', _entity, _entity)
create_waitset = _function('dds_create_waitset', _entity, _entity)
delete = _function('dds_delete', _result, _entity)
get_guid = _function('dds_get_guid', _result, _entity, ctypes.POINTER(Guid))

write = _function('dds_write', _result, _entity, ctypes.POINTER(Sample))
take_next = _function(
    'dds_take_next',
    _result,
    _entity,
    ctypes.POINTER(ctypes.POINTER(Sample)),
    ctypes.POINTER(SampleInfo),
)
take = _function(
    'dds_take',
    _result,
    _entity,
    ctypes.POINTER(ctypes.c_void_p),
    ctypes.POINTER(SampleInfo),
    ctypes.c_size_t,
    ctypes.c_uint32,
)
return_loan = _function(
    'dds_return_loan', _result, _entity, ctypes.POINTER(ctypes.c_void_p), ctypes.c_int32
)
free = _function('dds_free', None, _pointer)
wait_for_acks = _function('dds_wait_for_acks', _result, _entity, _duration)
assert_liveliness = _function('dds_assert_liveliness', _result, _entity)

get_matched_subscriptions = _function(
    'dds_get_matched_subscriptions', _result, _entity, ctypes.POINTER(_handle), ctypes.c_size_t
)
get_matched_publications = _function(
    'dds_get_matched_publications', _result, _entity, ctypes.POINTER(_handle), ctypes.c_size_t
)
get_matched_subscription_data = _function(
    'dds_get_matched_subscription_data', ctypes.POINTER(BuiltinEndpoint), _entity, _handle
)
get_matched_publication_data = _function(
    'dds_get_matched_publication_data', ctypes.POINTER(BuiltinEndpoint), _entity, _handle
)
free_endpoint = _function('dds_builtintopic_free_endpoint', None, ctypes.POINTER(BuiltinEndpoint))
get_offered_incompatible_qos_status = _function(
    'dds_get_offered_incompatible_qos_status',
    _result,
    _entity,
    ctypes.POINTER(IncompatibleQosStatus),
)
get_requested_incompatible_qos_status = _function(
    'dds_get_requested_incompatible_qos_status',
    _result,
    _entity,
    ctypes.POINTER(IncompatibleQosStatus),
)

set_guard_condition = _function('dds_set_guardcondition', _result, _entity, ctypes.c_bool)
take_guard_condition = _function(
    'dds_take_guardcondition', _result, _entity, ctypes.POINTER(ctypes.c_bool)
)
waitset_attach = _function('dds_waitset_attach', _result, _entity, _entity, ctypes.c_ssize_t)
waitset_detach = _function('dds_waitset_detach', _result, _entity, _entity)
waitset_wait = _function(
    'dds_waitset_wait',
    _result,
    _entity,
    ctypes.POINTER(ctypes.c_ssize_t),
    ctypes.c_size_t,
    _duration,
)

create_qos = _function('dds_create_qos', _pointer)
delete_qos = _function('dds_delete_qos', None, _pointer)
set_user_data = _function('dds_qset_userdata', None, _pointer, _pointer, ctypes.c_size_t)
set_history = _function('dds_qset_history', None, _pointer, ctypes.c_int, ctypes.c_int32)
set_reliability = _function('dds_qset_reliability', None, _pointer, ctypes.c_int, _duration)
set_durability = _function('dds_qset_durability', None, _pointer, ctypes.c_int)
set_durability_service = _function(
    'dds_qset_durability_service',
    None,
    _pointer,
    _duration,
    ctypes.c_int,
    ctypes.c_int32,
    ctypes.c_int32,
    ctypes.c_int32,
    ctypes.c_int32,
)
set_deadline = _function('dds_qset_deadline', None, _pointer, _duration)
set_lifespan = _function('dds_qset_lifespan', None, _pointer, _duration)
set_liveliness = _function('dds_qset_liveliness', None, _pointer, ctypes.c_int, _duration)
set_ignore_local = _function('dds_qset_ignorelocal', None, _pointer, ctypes.c_int)
set_writer_data_lifecycle = _function(
    'dds_qset_writer_data_lifecycle', None, _pointer, ctypes.c_bool
)
set_data_representation = _function(
    'dds_qset_data_representation',
    None,
    _pointer,
    ctypes.c_uint32,
    ctypes.POINTER(ctypes.c_int16),
)
_int = ctypes.POINTER(ctypes.c_int)
_int32 = ctypes.POINTER(ctypes.c_int32)
_nanoseconds = ctypes.POINTER(_duration)
get_user_data = _function(
    'dds_qget_userdata',
    ctypes.c_bool,
    _pointer,
    ctypes.POINTER(ctypes.c_void_p),
    ctypes.POINTER(ctypes.c_size_t),
)
get_history = _function('dds_qget_history', ctypes.c_bool, _pointer, _int, _int32)
get_reliability = _function('dds_qget_reliability', ctypes.c_bool, _pointer, _int, _nanoseconds)
get_durability = _function('dds_qget_durability', ctypes.c_bool, _pointer, _int)
get_deadline = _function('dds_qget_deadline', ctypes.c_bool, _pointer, _nanoseconds)
get_lifespan = _function('dds_qget_lifespan', ctypes.c_bool, _pointer, _nanoseconds)
get_liveliness = _function('dds_qget_liveliness', ctypes.c_bool, _pointer, _int, _nanoseconds)

_describe = _function('dds_strretcode', ctypes.c_char_p, _result)


def check(result: int, doing: str) -> int:
    """Return a non-negative result, or raise what a negative one means.

    Args:
        result: What a function of the library returned.
        doing: What was tried, to complete 'cannot ...'.

    Raises:
        MiddlewareError: The result is negative.
    """
    if result < 0:
        reason = _describe(result).decode('ascii', 'replace')
        raise MiddlewareError(f'Cyclone DDS cannot {doing}: {reason} ({result})')
    return result


def is_timeout(result: int) -> bool:
    """Whether a call gave up because its time was over."""
    return result == _TIMEOUT


def guid_of(entity: int) -> bytes:
    """The globally unique identifier of an entity, 16 bytes."""
    guid = Guid()
    check(get_guid(entity, ctypes.byref(guid)), 'tell the identifier of an entity')
    return bytes(guid.bytes)
