"""ROS 2's wire protocol on Cyclone DDS: serialized messages in, serialized messages out.

Names are fully qualified ROS names ('/hand/trajectory'), types are 'package/msg/Name' and
payloads are CDR bytes with their 4-byte header.
"""

from ros_standalone.middleware.discovery_range import discovery_configuration, domain_id_from
from ros_standalone.middleware.endpoints import MessageInfo, Reader, Writer
from ros_standalone.middleware.errors import ClosedError, ConfigurationError, MiddlewareError
from ros_standalone.middleware.graph import EndpointRecord, Graph
from ros_standalone.middleware.participant import NodeHandle, Participant
from ros_standalone.middleware.services import Client, RequestId, Server
from ros_standalone.middleware.waiting import GuardCondition, WaitSet

__all__ = [
    'Client',
    'ClosedError',
    'ConfigurationError',
    'EndpointRecord',
    'Graph',
    'GuardCondition',
    'MessageInfo',
    'MiddlewareError',
    'NodeHandle',
    'Participant',
    'Reader',
    'RequestId',
    'Server',
    'WaitSet',
    'Writer',
    'discovery_configuration',
    'domain_id_from',
]
