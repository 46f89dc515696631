"""Cyclone's domains: one for a domain id and process, shared by its participants."""

from __future__ import annotations

import os
import threading
from dataclasses import dataclass

from ros_standalone.middleware import library
from ros_standalone.middleware.discovery_range import discovery_configuration
from ros_standalone.middleware.errors import ConfigurationError


@dataclass
class _Domain:
    handle: int
    configuration: str
    users: int = 0


_domains: dict[int, _Domain] = {}
_lock = threading.Lock()


def enter_domain(domain_id: int) -> None:
    """Make the domain, or take part in the one that this process has already.

    Raises:
        ConfigurationError: Cyclone does not accept its settings, or the environment asks for
            others than those of the domain that is open.
    """
    ours = discovery_configuration(os.environ, domain_id)
    configuration = os.environ.get('CYCLONEDDS_URI', '') if ours is None else ours
    with _lock:
        domain = _domains.get(domain_id)
        if domain is None:
            handle = library.create_domain(domain_id, configuration.encode())
            if handle < 0:
                source = 'CYCLONEDDS_URI' if ours is None else 'ROS_STATIC_PEERS'
                raise ConfigurationError(
                    f'Cyclone DDS cannot open domain {domain_id} with the settings of {source}: '
                    f'{configuration}'
                )
            domain = _domains[domain_id] = _Domain(handle, configuration)
        elif domain.configuration != configuration:
            raise ConfigurationError(
                f'domain {domain_id} is open in this process with other discovery settings; '
                'close its participants before you change the environment'
            )
        domain.users += 1


def leave_domain(domain_id: int) -> None:
    """Give up a participation; the last one closes the domain."""
    with _lock:
        domain = _domains[domain_id]
        domain.users -= 1
        if not domain.users:
            del _domains[domain_id]
            library.delete(domain.handle)
