from __future__ import annotations

from cfplan_msgs.msg import ElementalContact
from hypothesis import given
from hypothesis import strategies as st

from cfplan_ros.conversions.contacts import contact_message, contact_names, formation_message

NAMES = st.text('abcz_09é-', min_size=1)
BODIES = st.one_of(st.integers(0, 99).map('palm.{}'.format), st.tuples(NAMES, NAMES).map('.'.join))
ELEMENTS = st.integers(0, 9999)
CONTACTS = st.one_of(
    st.builds('object.v{}|{}.e{}'.format, ELEMENTS, BODIES, ELEMENTS),
    st.builds('object.e{}|{}.v{}'.format, ELEMENTS, BODIES, ELEMENTS),
)


def test_a_contact_has_the_parts_that_the_message_names() -> None:
    expected = ElementalContact(object_element='v3', hand_body='left.link_1', hand_element='e0')
    assert contact_message('object.v3|left.link_1.e0') == expected


@given(st.lists(CONTACTS, unique=True, max_size=6))
def test_the_contacts_of_a_formation_survive_in_their_order(names: list[str]) -> None:
    assert contact_names(formation_message(names)) == tuple(names)
