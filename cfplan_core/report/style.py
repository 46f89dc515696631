"""Colours and sizes of every picture: a body looks the same wherever it appears.

Body colours are from the palette of Okabe and Ito, which people with any common form of colour
blindness tell apart; stability classes are told apart by grey level and by words.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from cfplan_core.model import Hand

INK = '#1A1A1A'
MUTED = '#6E6E6E'
FAINT = '#B5B5B5'
PAPER = '#FFFFFF'

OBJECT = '#F0E442'
PALM = '#A6A6A6'
FINGERS = ('#0072B2', '#D55E00', '#009E73', '#CC79A7', '#56B4E9', '#E69F00')

FONT_SIZE = 9.0
SMALL_FONT_SIZE = 8.0
DPI = 200


@dataclass(frozen=True)
class StabilityStyle:
    """How a stability class is written and shaded.

    Attributes:
        label: In words.
        fill: Colour of tree nodes.
        text: Colour of text on the fill.
        tint: Colour of stretches of time.
        width: Line width of trajectories, points.
    """

    label: str
    fill: str
    text: str
    tint: str
    width: float


STABILITY: Mapping[str, StabilityStyle] = MappingProxyType(
    {
        'form_closure': StabilityStyle('form closure', '#4D4D4D', PAPER, '#D2D2D2', 3.2),
        'force_closure': StabilityStyle('force closure', '#D2D2D2', INK, '#F2F2F2', 1.6),
        'second_order': StabilityStyle('second order', PAPER, INK, PAPER, 0.8),
    }
)
INSTANT = StabilityStyle('passed in an instant', PAPER, INK, PAPER, 0.8)


def stability_style(stability: str) -> StabilityStyle:
    """Style of a stability class; `INSTANT` for anything that a plan cannot rest in."""
    return STABILITY.get(stability, INSTANT)


def finger_colours(hand: Hand) -> dict[str, str]:
    """Finger name to colour, in the hand's order; more than six fingers repeat colours."""
    return {finger.name: FINGERS[k % len(FINGERS)] for k, finger in enumerate(hand.fingers)}


def body_colours(hand: Hand) -> dict[str, str]:
    """Colour of the object and of every body of the hand, by the body's name in contacts."""
    colours = {'object': OBJECT}
    colours |= {f'palm.{k}': PALM for k in range(len(hand.palm))}
    by_finger = finger_colours(hand)
    colours |= {
        f'{f.name}.{link.name}': by_finger[f.name] for f in hand.fingers for link in f.links
    }
    return colours


def joint_colours(hand: Hand) -> dict[str, str]:
    """Joint name to the colour of its finger."""
    by_finger = finger_colours(hand)
    return {joint.name: by_finger[f.name] for f in hand.fingers for joint in f.joints}
