"""Nothing leaves the machine by default: seen at the sockets of a participant that talks."""

from __future__ import annotations

import ipaddress
import os
import socket
import sys
from pathlib import Path

import pytest

from ros_standalone.middleware import WaitSet

STRING = 'std_msgs/msg/String'
PAYLOAD = bytes((0, 1, 0, 0)) + b'text'

pytestmark = pytest.mark.skipif(
    sys.platform != 'linux', reason='reads the sockets of a process where Linux lists them'
)


def own_sockets():
    """Local address and port of each UDP and TCP socket of this process."""
    links = (Path(f'/proc/self/fd/{name}') for name in os.listdir('/proc/self/fd'))
    inodes = {os.readlink(link)[8:-1] for link in links if is_socket(link)}
    found = []
    for table in ('udp', 'udp6', 'tcp', 'tcp6'):
        for line in Path(f'/proc/self/net/{table}').read_text().splitlines()[1:]:
            fields = line.split()
            if fields[9] in inodes:
                address, port = fields[1].split(':')
                raw = b''.join(
                    bytes.fromhex(address[i : i + 8])[::-1] for i in range(0, len(address), 8)
                )
                found.append((table, ipaddress.ip_address(raw), int(port, 16)))
    return found


def is_socket(link):
    try:
        return os.readlink(link).startswith('socket:')
    except FileNotFoundError:
        return False


@pytest.fixture
def sockets(make_participant, volatile):
    """The sockets while two participants of this process exchange a message by DDS."""
    before = set(own_sockets())
    here, there = make_participant(), make_participant()
    writer = here.create_writer(here.add_node('a', '/'), '/words', STRING, '', volatile)
    reader = there.create_reader(there.add_node('b', '/'), '/words', STRING, '', volatile)
    assert here.graph.wait_until(lambda: writer.matched_count() == 1, 10.0)
    writer.publish(PAYLOAD)
    assert WaitSet(there).wait([reader], 10.0)
    return sorted(set(own_sockets()) - before)


def test_participant_sends_from_the_loopback_address(sockets, domain):
    # Cyclone binds what it receives with to every interface, on the two ports that DDS computes
    # from the domain; it sends with a socket of its own, bound to the chosen interface.
    receiving = [entry for entry in sockets if entry[1] == ipaddress.ip_address('0.0.0.0')]
    sending = [entry for entry in sockets if entry not in receiving]
    base = 7400 + 250 * domain
    assert receiving
    assert all(base + 10 <= port < base + 250 for _, _, port in receiving)
    assert [(table, address.is_loopback) for table, address, _ in sending] == [('udp', True)]


def test_socket_bound_to_loopback_cannot_send_to_the_network():
    # Why the address that a participant sends from is enough: the system itself refuses.
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.bind(('127.0.0.1', 0))
        with pytest.raises(OSError, match=r'Invalid argument|unreachable'):
            sender.sendto(b'x', ('192.0.2.1', 9))


def test_participant_joins_no_multicast_group(make_participant):
    def spdp_groups():
        # 239.255.0.1, on which DDS announces participants, in the byte order of the table.
        return Path('/proc/self/net/igmp').read_text().upper().count('0100FFEF')

    before = spdp_groups()
    make_participant()
    assert spdp_groups() == before
