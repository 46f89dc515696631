"""Elemental contacts and their names: a vertex of one body on an edge of the other."""

from __future__ import annotations

import re
from dataclasses import dataclass

from cfplan_core.errors import CfplanError

_PATTERN = re.compile(r'object\.([ve])(0|[1-9]\d*)\|([^\s|]+)\.([ve])(0|[1-9]\d*)')


@dataclass(frozen=True, order=True)
class ElementalContact:
    """A vertex of the object on an edge of the hand, or the other way round.

    Attributes:
        body: Hand body, ``palm.N`` or ``finger.link``.
        object_vertex: True if the vertex is the object's.
        vertex: Index of the vertex in its polygon.
        edge: Index of the edge in its polygon; edge k runs from vertex k to k + 1.
    """

    body: str
    object_vertex: bool
    vertex: int
    edge: int

    def __str__(self) -> str:
        if self.object_vertex:
            return f'object.v{self.vertex}|{self.body}.e{self.edge}'
        return f'object.e{self.edge}|{self.body}.v{self.vertex}'


def parse_contact(name: str) -> ElementalContact:
    """Read a contact's name, e.g. ``object.v3|left.link_1.e0``.

    Raises:
        CfplanError: The name does not have this form.
    """
    match = _PATTERN.fullmatch(name)
    if match is None or match[1] == match[4]:
        raise CfplanError(
            f'contact {name!r}: expected object.vK|BODY.eJ or object.eK|BODY.vJ, object first'
        )
    first, second = int(match[2]), int(match[5])
    if match[1] == 'v':
        return ElementalContact(match[3], True, first, second)
    return ElementalContact(match[3], False, second, first)
