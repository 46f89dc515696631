"""Checks of where bodies are: what touches, what does not, what overlaps."""

from __future__ import annotations

import math
from collections.abc import Collection
from itertools import combinations

from cfplan_core.verification.checks import APART
from cfplan_core.verification.mechanism import Mechanism, Scene
from cfplan_core.verification.overlap import link_pairs, overlap_depth
from cfplan_core.verification.report import Recorder
from cfplan_core.verification.structure import Stretch
from cfplan_core.verification.touching import locate, touching_pairs


def check_overlaps(mechanism: Mechanism, frame: int, scene: Scene, record: Recorder) -> None:
    """Check that no bodies overlap which may not."""
    for body, outline in scene.outlines.items():
        depth = overlap_depth(scene.object, outline)
        record.measure('penetration', depth, frame, f'depth of the object in {body}')
    for first, second in link_pairs(mechanism):
        depth = overlap_depth(scene.outlines[first], scene.outlines[second])
        record.measure('link_overlap', depth, frame, f'overlap of {first} and {second}')


def check_named_contacts(stretch: Stretch, frame: int, scene: Scene, record: Recorder) -> None:
    """Check that every contact of a segment touches, from outside."""
    for pair in stretch.contacts:
        touch = locate(pair, scene)
        what = f'gap of {pair.name} in segment {stretch.number}'
        if record.measure('contact_gap', touch.distance, frame, what):
            depth = touch.depth if touch.salient else math.inf
            notch = '' if touch.salient else ', which is not convex,'
            what = f'depth beside the vertex of {pair.name}{notch}'
            record.measure('contact_side', depth, frame, what)


def check_inside_contacts(
    mechanism: Mechanism,
    stretch: Stretch,
    frame: int,
    scene: Scene,
    events: Collection[str],
    record: Recorder,
) -> None:
    """Check, inside a segment, that nothing else touches and that no two contacts coincide.

    Args:
        mechanism: The problem.
        stretch: The segment.
        frame: Index of the frame.
        scene: The configuration.
        events: Contacts that touch at a neighbouring frame which ends the segment. They may be
            nearer than 1e-6 m here, where they are about to be made or have just been lost, but
            not than 1e-8 m.
        record: Where to.
    """
    named = {pair.name for pair in stretch.contacts}
    others = [
        f'{name} ({touch.distance:.2g} m)'
        for name, (_, touch) in touching_pairs(mechanism, scene).items()
        if name not in named and not (name in events and touch.distance > APART)
    ]
    record.require(
        'unnamed_contact',
        not others,
        frame,
        f'segment {stretch.number} does not name {", ".join(others)}, expected all that touches',
    )
    points = [(pair, locate(pair, scene).point) for pair in stretch.contacts]
    for (one, p), (other, q) in combinations(points, 2):
        if one.body == other.body:
            what = f'distance of {one.name} and {other.name}'
            record.measure('coincidence', abs(p - q), frame, what)


def check_ends_alone(
    stretch: Stretch, first: Collection[str], last: Collection[str], record: Recorder
) -> None:
    """Check, for a segment without frames inside, that nothing else touches at both its ends.

    Args:
        stretch: The segment.
        first: Contacts that touch at its first frame.
        last: Contacts that touch at its last frame.
        record: Where to.
    """
    named = {pair.name for pair in stretch.contacts}
    others = sorted(set(first) & set(last) - named)
    record.require(
        'unnamed_contact',
        not others,
        stretch.last,
        f'segment {stretch.number} does not name {", ".join(others)}, which touches at both its '
        'ends, expected all that touches',
    )
