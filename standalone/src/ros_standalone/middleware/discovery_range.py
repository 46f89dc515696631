"""Which other processes a participant finds: the environment's variables as Cyclone's settings.

By default nothing leaves the machine: the participant sends through the loopback interface alone,
sends no multicast, and asks the ports of 127.0.0.1 for others. A static peer on another machine
opens the interface that leads there, still without multicast.
"""

from __future__ import annotations

import ipaddress
import os
from collections.abc import Mapping
from xml.sax.saxutils import quoteattr

from ros_standalone.middleware.errors import ConfigurationError

LARGEST_DOMAIN_ID = 232
"""Beyond it the ports that DDS computes from the domain would not be ports."""

_RANGES = ('LOCALHOST', 'SUBNET', 'OFF', 'SYSTEM_DEFAULT')
_LOOPBACK = '<NetworkInterface address="127.0.0.1"/>'
_PARTICIPANTS_ASKED_FOR = 32
_LARGEST_PORT = 65535
_PORT_BASE, _PORTS_PER_DOMAIN, _PORTS_PER_PARTICIPANT, _LAST_OFFSET = 7400, 250, 2, 11


def domain_id_from(environment: Mapping[str, str]) -> int:
    """The domain that ROS_DOMAIN_ID names, 0 where it is not set.

    Raises:
        ConfigurationError: It is not a whole number in 0..232.
    """
    text = environment.get('ROS_DOMAIN_ID', '').strip()
    if not text:
        return 0
    try:
        return checked_domain_id(int(text))
    except (ValueError, ConfigurationError):
        raise ConfigurationError(
            f'ROS_DOMAIN_ID must be a whole number in 0..{LARGEST_DOMAIN_ID}, got {text!r}'
        ) from None


def checked_domain_id(domain_id: int) -> int:
    """The same domain, if it is one.

    Raises:
        ConfigurationError: It is not in 0..232.
    """
    if not 0 <= domain_id <= LARGEST_DOMAIN_ID:
        raise ConfigurationError(f'a domain id must be in 0..{LARGEST_DOMAIN_ID}, got {domain_id}')
    return domain_id


def discovery_configuration(environment: Mapping[str, str], domain_id: int = 0) -> str | None:
    """Cyclone's settings (XML) that the environment asks for.

    Args:
        environment: Read are ROS_AUTOMATIC_DISCOVERY_RANGE (LOCALHOST, which is the default,
            SUBNET, OFF, SYSTEM_DEFAULT), ROS_STATIC_PEERS (addresses separated by semicolons)
            and CYCLONEDDS_URI.
        domain_id: The domain, whose ports limit how many participants a machine can hold.

    Returns:
        The settings; None where Cyclone's own are left alone, that is for SYSTEM_DEFAULT and
        where the user's CYCLONEDDS_URI decides.

    Raises:
        ConfigurationError: The range is not one of the four.
    """
    if environment.get('CYCLONEDDS_URI', '').strip():
        return None
    chosen = environment.get('ROS_AUTOMATIC_DISCOVERY_RANGE', '').strip() or 'LOCALHOST'
    if chosen not in _RANGES:
        raise ConfigurationError(
            f'ROS_AUTOMATIC_DISCOVERY_RANGE must be one of {", ".join(_RANGES)}, got {chosen!r}'
        )
    peers = [peer.strip() for peer in environment.get('ROS_STATIC_PEERS', '').split(';')]
    peers = [peer for peer in peers if peer]
    if chosen == 'SYSTEM_DEFAULT':
        return None
    if chosen == 'OFF':
        return _document(
            _general(_LOOPBACK),
            f'<ParticipantIndex>none</ParticipantIndex><Tag>ros_discovery_off_{os.getpid()}</Tag>',
        )
    if chosen == 'SUBNET':
        return _document('', _ports(_PARTICIPANTS_ASKED_FOR) + _peers(peers))
    peers = ['127.0.0.1', *peers]
    if all(_is_loopback(peer) for peer in peers):
        room = _participants_of_a_machine(domain_id)
        return _document(_general(_LOOPBACK), _ports(room) + _peers(peers))
    # The loopback interface does not lead to a peer elsewhere.
    return _document(_general(''), _ports(_PARTICIPANTS_ASKED_FOR) + _peers(peers))


def _document(general: str, discovery: str) -> str:
    return f'<CycloneDDS><Domain>{general}<Discovery>{discovery}</Discovery></Domain></CycloneDDS>'


def _general(interfaces: str) -> str:
    chosen = f'<Interfaces>{interfaces}</Interfaces>' if interfaces else ''
    return f'<General>{chosen}<AllowMulticast>false</AllowMulticast></General>'


def _participants_of_a_machine(domain_id: int) -> int:
    # Every participant listens on two ports of its own. More than fit between the ports of this
    # domain and those of the next would meet the next domain's participants.
    base = _PORT_BASE + _PORTS_PER_DOMAIN * domain_id
    room = min(_PORTS_PER_DOMAIN - 1, _LARGEST_PORT - base) - _LAST_OFFSET
    return room // _PORTS_PER_PARTICIPANT


def _ports(largest_index: int) -> str:
    return (
        '<ParticipantIndex>auto</ParticipantIndex>'
        f'<MaxAutoParticipantIndex>{largest_index}</MaxAutoParticipantIndex>'
    )


def _peers(addresses: list[str]) -> str:
    items = ''.join(f'<Peer Address={quoteattr(address)}/>' for address in addresses)
    return f'<Peers>{items}</Peers>' if items else ''


def _is_loopback(peer: str) -> bool:
    if peer == 'localhost':
        return True
    try:
        return ipaddress.ip_address(peer).is_loopback
    except ValueError:
        return False
