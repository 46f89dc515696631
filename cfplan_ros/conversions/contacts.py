"""Elemental contacts and formations as messages."""

from __future__ import annotations

from collections.abc import Iterable

from cfplan_msgs.msg import ContactFormation, ElementalContact

_OBJECT = 'object.'


def contact_message(name: str) -> ElementalContact:
    """Split a contact's name, e.g. ``object.v3|left.link_1.e0``."""
    on_object, on_hand = name.split('|')
    body, _, element = on_hand.rpartition('.')
    return ElementalContact(
        object_element=on_object.removeprefix(_OBJECT), hand_body=body, hand_element=element
    )


def contact_name(message: ElementalContact) -> str:
    """Join the parts of a contact's name; what is no contact gives what is no name of one."""
    return f'{_OBJECT}{message.object_element}|{message.hand_body}.{message.hand_element}'


def formation_message(names: Iterable[str]) -> ContactFormation:
    """Return a contact formation, its contacts in the order given."""
    return ContactFormation(contacts=[contact_message(name) for name in names])


def contact_names(message: ContactFormation) -> tuple[str, ...]:
    """Return the names of a formation's contacts, in its order."""
    return tuple(contact_name(contact) for contact in message.contacts)
