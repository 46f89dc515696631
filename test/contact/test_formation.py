from __future__ import annotations

from cfplan_core.contact.formation import Formation


def test_formations_of_the_same_contacts_are_the_same() -> None:
    assert len({Formation((1, 5)), Formation((1, 5)), Formation((1, 6))}) == 2


def test_formation_indexes_arrays() -> None:
    assert Formation((1, 5)).array.tolist() == [1, 5]


def test_empty_formation_indexes_nothing() -> None:
    assert Formation(()).array.tolist() == []
    assert Formation(()).array.dtype.kind == 'i'


def test_formation_knows_its_contacts() -> None:
    formation = Formation((1, 5))
    assert (len(formation), 5 in formation, 2 in formation) == (2, True, False)
