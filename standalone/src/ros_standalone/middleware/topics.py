"""DDS topics of a participant, shared by the endpoints that use them."""

from __future__ import annotations

import functools
import re
import threading
from typing import Any

from cyclonedds._clayer import ddspy_topic_create  # type: ignore[import-not-found,unused-ignore]
from cyclonedds.idl import make_idl_struct, types

from ros_standalone.middleware import library


class Topics:
    """The topics of one participant, by name and type, made at first use."""

    def __init__(self, participant: int) -> None:
        self._participant = participant
        self._lock = threading.Lock()
        self._entities: dict[tuple[str, str], tuple[int, int]] = {}

    def acquire(self, name: str, type_name: str) -> int:
        """The entity of a topic (DDS name and type); `release` it when its endpoint is gone.

        Raises:
            MiddlewareError: DDS refuses it.
        """
        with self._lock:
            entity, users = self._entities.get((name, type_name), (0, 0))
            if not entity:
                entity = int(
                    ddspy_topic_create(
                        self._participant, name, _type_support(type_name), None, None
                    )
                )
                library.check(entity, f'create topic {name} of type {type_name}')
            self._entities[name, type_name] = entity, users + 1
            return entity

    def release(self, name: str, type_name: str) -> None:
        """Undo one `acquire`; the last one deletes the topic."""
        with self._lock:
            entity, users = self._entities[name, type_name]
            if users > 1:
                self._entities[name, type_name] = entity, users - 1
            else:
                del self._entities[name, type_name]
                library.delete(entity)


@functools.cache
def _type_support(type_name: str) -> Any:
    # Payloads are serialized elsewhere, so what the structure holds does not matter to a ROS
    # process, which compares names of types; only every payload must have its one byte. Two of
    # our processes compare structures: the field's name keeps different types apart.
    field = re.sub(r'\W', '_', type_name)
    data_type: Any = make_idl_struct('Payload', type_name, {field: types.uint8})
    data_type.__idl__.populate()
    data_type.__idl__.fill_type_data()
    return data_type
