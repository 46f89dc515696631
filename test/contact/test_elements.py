from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cfplan_core.contact.elements import ElementalContact, parse_contact
from cfplan_core.errors import CfplanError

contacts = st.builds(
    ElementalContact,
    body=st.sampled_from(['palm.0', 'palm.12', 'left.link_1', 'índice.falange']),
    object_vertex=st.booleans(),
    vertex=st.integers(0, 1000),
    edge=st.integers(0, 1000),
)


def test_vertex_of_the_object_is_named_first() -> None:
    assert str(ElementalContact('left.link_1', True, 3, 0)) == 'object.v3|left.link_1.e0'


def test_edge_of_the_object_is_named_first() -> None:
    assert str(ElementalContact('palm.0', False, 2, 1)) == 'object.e1|palm.0.v2'


@given(contacts)
def test_name_is_read_back(contact: ElementalContact) -> None:
    assert parse_contact(str(contact)) == contact


@pytest.mark.parametrize(
    'name',
    [
        '',
        'object.v0|palm.0.v1',
        'object.e0|palm.0.e1',
        'palm.0.e1|object.v0',
        'object.v0|palm.0',
        'object.v0|.e1',
        'object.v-1|palm.0.e1',
        'object.v01|palm.0.e1',
        'object.v0|palm.0.e1 ',
        'object.v0|palm.0.e1\n',
        'object.v0|a|b.e1',
    ],
)
def test_other_names_are_refused(name: str) -> None:
    with pytest.raises(CfplanError, match=r'expected object\.vK\|BODY\.eJ'):
        parse_contact(name)
