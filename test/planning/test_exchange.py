from __future__ import annotations

from collections import deque

import numpy as np
import pytest

from cfplan_core.contact.system import BoolArray
from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.planning.exchange import Exchange, Place

NOWHERE = np.empty((0, 3))


def free() -> Place:
    return Place(np.zeros(1), frozenset(), NOWHERE)


def touching(contact: int) -> Place:
    """A place with one contact, whose number stands where its gradient would."""
    return Place(np.zeros(1), frozenset({contact}), np.full((1, 3), float(contact)))


def at_least_two(gradients: FloatArray) -> bool:
    return len(gradients) >= 2


def anywhere(places: list[list[Place]]) -> Exchange:
    def apart(one: int, two: int) -> BoolArray:
        return np.ones((len(places[one]), len(places[two])), dtype=bool)

    return Exchange(places, NOWHERE, apart, at_least_two)


def test_nothing_moves_where_all_is_as_it_shall_be() -> None:
    assert anywhere([[touching(0), free()]] * 3).moves((1, 1, 1)) == []


def test_new_contacts_are_made_before_old_ones_are_broken() -> None:
    places = [[touching(k), free()] for k in (0, 1)] + [[free(), touching(k)] for k in (2, 3)]
    moves = anywhere(places).moves((0, 0, 0, 0))
    assert moves is not None
    assert {finger for finger, _ in moves[:2]} == {2, 3}
    assert len(moves) == 4


def test_two_fingers_that_hold_the_object_cannot_change_places() -> None:
    places = [[touching(0), touching(2)], [touching(1), touching(3)]]
    assert anywhere(places).moves((0, 0)) is None


def test_third_finger_helps_them_and_goes_back() -> None:
    helper = [free(), free(), touching(4)]
    places = [[touching(0), touching(2)], [touching(1), touching(3)], helper]
    moves = anywhere(places).moves((0, 0, 1))
    assert moves is not None
    assert moves[0] == (2, 2)
    assert moves[-1] == (2, 1)
    assert sorted(moves[1:-1]) == [(0, 1), (1, 1)]


def test_fingers_that_keep_their_contacts_may_slide_to_another_place() -> None:
    places = [[touching(0), touching(0)], [touching(1), touching(1)]]
    moves = anywhere(places).moves((0, 0))
    assert moves is not None
    assert sorted(moves) == [(0, 1), (1, 1)]


def test_blocked_move_is_gone_around() -> None:
    places = [[free(), free(), free()], [touching(0), touching(0)], [touching(1), touching(1)]]
    exchange = anywhere(places)
    assert exchange.moves((0, 1, 1)) == [(0, 1)]
    exchange.blocked.add(((0, 1, 1), 0, 1))
    assert exchange.moves((0, 1, 1)) == [(0, 2), (0, 1)]


@pytest.mark.parametrize('seed', range(12))
def test_moves_are_as_few_as_a_plain_search_finds(seed: int) -> None:
    rng = np.random.default_rng(seed)
    counts = (4, 3, 5)
    places = [
        [touching(10 * f + k) if rng.random() < 0.7 else free() for k in range(count)]
        for f, count in enumerate(counts)
    ]
    room = {
        (one, two): rng.random((counts[one], counts[two])) < 0.75
        for one in range(3)
        for two in range(one + 1, 3)
    }
    for table in room.values():
        table[0, 0] = table[1, 1] = True
    exchange = Exchange(places, NOWHERE, lambda one, two: room[one, two], at_least_two)

    def admitted(state: tuple[int, ...]) -> bool:
        return all(table[state[one], state[two]] for (one, two), table in room.items())

    def neighbours(state: tuple[int, ...]) -> list[tuple[int, ...]]:
        found = []
        for finger, at in enumerate(state):
            others = sum(bool(places[f][k].pairs) for f, k in enumerate(state) if f != finger)
            for place in range(counts[finger]):
                after = (*state[:finger], place, *state[finger + 1 :])
                same = places[finger][at].pairs == places[finger][place].pairs != frozenset()
                if place != at and admitted(after) and (others >= 2 or same):
                    found.append(after)
        return found

    distance = {(0, 0, 0): 0}
    waiting = deque([(0, 0, 0)])
    while waiting:
        state = waiting.popleft()
        for after in neighbours(state):
            if after not in distance:
                distance[after] = distance[state] + 1
                waiting.append(after)
    moves = exchange.moves((0, 0, 0))
    assert (None if moves is None else len(moves)) == distance.get((1, 1, 1))
    state = (0, 0, 0)
    for finger, place in moves or []:
        after = (*state[:finger], place, *state[finger + 1 :])
        assert after in neighbours(state)
        state = after
