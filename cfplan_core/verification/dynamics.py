"""Checks of acceleration, from the frames' times and places alone.

Over three frames at t0 < t1 < t2 a coordinate x has the mean acceleration

    2 ((x2 - x1) / (t2 - t1) - (x1 - x0) / (t1 - t0)) / (t2 - t0),

which every smooth motion through them has somewhere in between. Of one that starts or ends at rest
the same holds for 2 (x1 - x0) / (t1 - t0)² over its first or last step. What these exceed, no way
to join the frames can keep.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cfplan_core.trajectory.plan_result import PlanResult
from cfplan_core.verification.mechanism import FloatArray, Mechanism, Scene
from cfplan_core.verification.report import Recorder

QUASI_STATIC = 0.05
"""Share of the weight up to which inertial forces do not matter."""


def check_acceleration(mechanism: Mechanism, result: PlanResult, record: Recorder) -> None:
    """Check the acceleration of joints for which the problem limits it."""
    found = mean_accelerations(result.times, result.joints)
    for column, joint in enumerate(mechanism.problem.hand.joints):
        if joint.acceleration_limit is None:
            continue
        for frame, value in enumerate(np.abs(found[:, column]).tolist()):
            what = f'acceleration of {joint.name}, {value:.6g} rad/s², divided by its limit,'
            record.measure('joint_acceleration', value / joint.acceleration_limit, frame, what)


def check_inertia(
    mechanism: Mechanism,
    result: PlanResult,
    scenes: Sequence[Scene],
    share: float,
    record: Recorder,
) -> None:
    """Check that the inertia of the object and of heavy links is small beside their weight."""
    problem = mechanism.problem
    thing = problem.object
    bodies = [
        (
            'the object',
            thing.mass,
            thing.vertices - thing.center_of_mass,
            np.array([scene.center for scene in scenes]),
            result.object_poses[:, 2],
        )
    ]
    for k, (body, _) in enumerate(scenes[0].masses):
        centers = np.array([scene.masses[k][1] for scene in scenes])
        outline = np.column_stack([body.outline.real, body.outline.imag])
        shape = outline - [body.centroid.real, body.centroid.imag]
        angle = result.joints[:, list(body.chain)].sum(axis=1)
        bodies.append((body.name, body.mass, shape, centers, angle))
    gravity = float(np.hypot(*problem.gravity))
    for name, mass, shape, centers, angle in bodies:
        weight = mass * gravity if gravity > 0.0 else 1.0
        size = float(np.abs(np.subtract.outer(*[_complex(shape)] * 2)).max())
        straight = np.column_stack([centers.real, centers.imag])
        force = mass * np.hypot(*mean_accelerations(result.times, straight).T)
        turned = mean_accelerations(result.times, angle[:, None])[:, 0]
        moment = mass * _mean_square(shape) * np.abs(turned)
        for frame, (pushed, twisted) in enumerate(
            zip((force / weight).tolist(), (moment / (weight * size)).tolist(), strict=True)
        ):
            what = f'inertial force of {name}, {pushed:.4g} of its weight, divided by {share:g},'
            record.measure('inertia', pushed / share, frame, what)
            what = f'inertial moment of {name}, {twisted:.4g} of weight and size, over {share:g},'
            record.measure('inertia', twisted / share, frame, what)


def mean_accelerations(times: FloatArray, places: FloatArray) -> FloatArray:
    """Mean acceleration about each frame of a motion from rest to rest.

    Args:
        times: Shape (f,), s.
        places: Shape (f, m).

    Returns:
        Shape (f, m).
    """
    if len(times) < 2:
        return np.zeros_like(places)
    steps = np.diff(times)[:, None]
    still = np.zeros((1, places.shape[1]))
    rates = np.concatenate([still, np.diff(places, axis=0) / steps, still])
    # A step of rest before and after takes no time: what is left is half of the step beside it.
    spans = np.concatenate([[[0.0]], steps, [[0.0]]])
    return np.asarray(2.0 * np.diff(rates, axis=0) / (spans[1:] + spans[:-1]))


def _mean_square(shape: FloatArray) -> float:
    """Mean squared distance of a polygon's area from the origin."""
    z = _complex(shape)
    after = np.roll(z, -1)
    doubled = (np.conj(z) * after).imag
    middle = (z + after) / 2.0
    # Exact for squares: three points on the sides of each triangle with the origin.
    squares = (np.abs(middle) ** 2 + np.abs(z / 2.0) ** 2 + np.abs(after / 2.0) ** 2) / 3.0
    return float(squares @ doubled / doubled.sum())


def _complex(points: FloatArray) -> np.ndarray[tuple[int], np.dtype[np.complex128]]:
    return np.asarray(points[:, 0] + 1j * points[:, 1])
