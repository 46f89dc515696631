"""Faults that a schema cannot express: polygons, names, joint ranges, names of contacts."""

from __future__ import annotations

import re
from collections.abc import Iterator

import numpy as np

from cfplan_core.geometry.polygon import (
    FloatArray,
    first_self_intersection,
    is_flat,
    repeated_vertices,
    signed_area,
)
from cfplan_core.model.faults import Document, Fault, Path, path_text, shown
from cfplan_core.model.schema import nearest

ROUNDING = 1e-9
"""How far a joint angle may lie outside its limits, rad: files are rounded to nine decimals."""

SMALLEST_BODY = 1e-6
"""Smaller polygons than this, m, are degenerate: at this distance bodies count as touching."""

_CONTACT = re.compile(
    r'object\.(?P<object_kind>[ve])(?P<object_index>[0-9]+)\|'
    r'(?P<body>.*)\.(?P<kind>[ve])(?P<index>[0-9]+)'
)


def content_faults(document: Document) -> Iterator[Fault]:
    """Check what a problem says, as far as its form is sound.

    Args:
        document: A problem with the faults of its form.
    """
    yield from _polygon_faults(document)
    yield from _hand_faults(document)
    yield from _angle_faults(document)
    yield from _contact_faults(document)
    yield from _goal_faults(document)


def polygon_paths(document: Document) -> list[Path]:
    """Return the path of every polygon of a problem: palm, links, object."""
    links = [
        ('hand', 'fingers', i, 'links', k)
        for i in document.indices('hand', 'fingers')
        for k in document.indices('hand', 'fingers', i, 'links')
    ]
    palm = [('hand', 'palm', k) for k in document.indices('hand', 'palm')]
    return [(*body, 'vertices') for body in [*palm, *links, ('object',)]]


def _polygon_faults(document: Document) -> Iterator[Fault]:
    for path in polygon_paths(document):
        values = document.get(*path)
        if values is not None:
            yield from _shape_faults(path, np.array(values, dtype=np.float64))


def _shape_faults(path: Path, vertices: FloatArray) -> Iterator[Fault]:
    repeated = repeated_vertices(vertices)
    width = float(np.ptp(vertices, axis=0).max())
    if width < SMALLEST_BODY:
        yield Fault(
            path,
            f'a polygon of width {width:.3g} m',
            f'at least {SMALLEST_BODY:g} m, the distance that counts as touching',
        )
    elif is_flat(vertices):
        yield Fault(path, 'vertices on one straight line', 'a polygon with an area, m²')
    elif len(repeated):
        for k in repeated[:10]:
            before = (int(k) - 1) % len(vertices)
            advice = ': leave it out, a polygon closes itself' if k == 0 else ''
            last = before if k == 0 else int(k)
            other = int(k) if k == 0 else before
            yield Fault(
                (*path, last),
                shown(vertices[last].tolist()),
                f'a vertex apart from vertex {other}, m{advice}',
            )
    elif (edges := first_self_intersection(vertices)) is not None:
        yield Fault(
            path,
            f'edges {edges[0]} and {edges[1]} that meet (edge k runs from vertex k to k+1)',
            'a simple polygon: edges that meet only where they follow each other',
        )
    elif (area := signed_area(vertices)) < 0.0:
        yield Fault(
            path,
            f'clockwise vertices (area {area:.6g} m²)',
            'counter-clockwise vertices: the same in reverse order',
        )


def _hand_faults(document: Document) -> Iterator[Fault]:
    fingers: list[Path] = [('hand', 'fingers', i) for i in document.indices('hand', 'fingers')]
    links: list[list[Path]] = [
        [(*finger, 'links', k) for k in document.indices(*finger, 'links')] for finger in fingers
    ]
    joints: list[Path] = [
        (*finger, 'joints', k) for finger in fingers for k in document.indices(*finger, 'joints')
    ]
    yield from _name_faults(document, fingers, 'finger of the hand')
    yield from _name_faults(document, joints, 'joint of the hand')
    for finger, finger_links in zip(fingers, links, strict=True):
        yield from _name_faults(document, finger_links, 'link of the finger')
        joint_count = len(document.indices(*finger, 'joints'))
        if finger_links and joint_count and len(finger_links) != joint_count:
            yield Fault(
                (*finger, 'links'),
                f'{len(finger_links)} links',
                f'{joint_count}: as many links as joints',
            )
    for joint in joints:
        limits = document.get(*joint, 'limits')
        if limits is not None and not limits[0] < limits[1]:
            yield Fault(
                (*joint, 'limits'), shown(limits), '[lower, upper] in rad, lower below upper'
            )


def _name_faults(document: Document, owners: list[Path], kind: str) -> Iterator[Fault]:
    first: dict[str, Path] = {}
    for owner in owners:
        name = document.get(*owner, 'name')
        if name in first:
            yield Fault(
                (*owner, 'name'),
                shown(name),
                f'a name of its own: {path_text(first[name])}, another {kind}, has this one',
            )
        elif name is not None:
            first[name] = owner


def _joint_paths(document: Document) -> dict[str, Path] | None:
    """Return name to path of all joints; None if a name is missing or not unique."""
    paths: dict[str, Path] = {}
    for i in document.indices('hand', 'fingers'):
        joints = document.indices('hand', 'fingers', i, 'joints')
        for k in joints:
            path: Path = ('hand', 'fingers', i, 'joints', k)
            name = document.get(*path, 'name')
            if name is None or name in paths:
                return None
            paths[name] = path
        if not joints:
            return None
    return paths or None


def _angle_faults(document: Document) -> Iterator[Fault]:
    joints = _joint_paths(document)
    if joints is None:
        return
    for grasp in ('start', 'goal'):
        for name in document.keys(grasp, 'joints'):
            path = (grasp, 'joints', name)
            angle = document.get(*path)
            if name not in joints:
                yield Fault(
                    path,
                    f'{shown(angle)} for an unknown joint',
                    f'{nearest(name, list(joints))} as the joint',
                    usable=True,
                )
                continue
            limits = document.get(*joints[name], 'limits')
            if angle is None or limits is None or limits[0] >= limits[1]:
                continue
            slack = ROUNDING
            if grasp == 'goal':
                slack = max(slack, document.get('goal', 'tolerance', 'joints') or 0.0)
            if not limits[0] - slack <= angle <= limits[1] + slack:
                yield Fault(
                    path,
                    shown(angle),
                    f"from {limits[0]} to {limits[1]} rad, the joint's limits",
                    usable=True,
                )
    given = document.keys('start', 'joints')
    for name in joints:
        if given and name not in given:
            yield Fault(('start', 'joints', name), 'nothing', 'the angle of this joint in rad')


def _contact_faults(document: Document) -> Iterator[Fault]:
    counts, complete = _vertex_counts(document)
    for k in document.indices('goal', 'contacts'):
        path = ('goal', 'contacts', k)
        name = document.get(*path)
        match = _CONTACT.fullmatch(name or '')
        if match is None:
            continue
        elements = [
            ('object', match['object_kind'], match['object_index']),
            (match['body'], match['kind'], match['index']),
        ]
        for body, kind, index in elements:
            count = counts.get(body)
            if body not in counts and complete:
                bodies = [other for other in counts if other != 'object']
                yield Fault(path, shown(name), f'{nearest(body, bodies)} as the body')
            elif count is not None and not _below(index, count):
                yield Fault(
                    path,
                    shown(name),
                    f'an element of {body} from {kind}0 to {kind}{count - 1}, not {kind}{index}',
                )


def _goal_faults(document: Document) -> Iterator[Fault]:
    """Parts of a goal that are given twice, or that say nothing without another."""
    for key in ('position', 'orientation'):
        if document.has('goal', 'object_pose') and document.has('goal', key):
            yield Fault(
                ('goal', key),
                f'{shown(document.get("goal", key))} beside object_pose',
                'one of them: a pose has both position and orientation',
                usable=True,
            )
    if document.get('goal', 'exact_contacts') and not document.has('goal', 'contacts'):
        yield Fault(
            ('goal', 'exact_contacts'),
            'true without contacts',
            'contacts that it is about',
            usable=True,
        )


def _vertex_counts(document: Document) -> tuple[dict[str, int | None], bool]:
    """Return body name to number of vertices (None: not known), and if all bodies are there."""
    counts: dict[str, int | None] = {}
    complete = document.has('hand', 'palm') and all(
        document.has('hand', 'fingers', i, 'links') for i in document.indices('hand', 'fingers')
    )
    for path in polygon_paths(document):
        vertices = document.get(*path)
        count = None if vertices is None else len(vertices)
        if path[0] == 'object':
            counts['object'] = count
        elif path[1] == 'palm':
            counts[f'palm.{path[2]}'] = count
        else:
            finger, link = document.get(*path[:3], 'name'), document.get(*path[:5], 'name')
            complete = complete and finger is not None and link is not None
            counts[f'{finger}.{link}'] = count
    return counts, complete


def _below(digits: str, count: int) -> bool:
    return digits == str(int(digits[:9])) and int(digits) < count
