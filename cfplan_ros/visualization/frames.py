"""The frames of hand and object, as tf2 transforms.

The world frame is the hand's plane: x to the right, y up, z out of the plane. A finger's base is
fixed in it, the first link turns in the base and every other link at the end of the one before.
The object's frame lies in the world.

    palm ── left_base ── left/link_1 ── left/link_2 ── ...
         └─ object
"""

from __future__ import annotations

import numpy as np
from builtin_interfaces.msg import Time
from geometry_msgs.msg import Transform, TransformStamped, Vector3
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from cfplan_core.geometry.polygon import FloatArray
from cfplan_core.model import Grasp, Hand
from cfplan_ros.conversions.poses import pose_message

WORLD_FRAME = 'palm'
OBJECT_FRAME = 'object'


def base_frame(finger: str) -> str:
    """Name of the frame in a finger's first joint, fixed in the world."""
    return f'{finger}_base'


def link_frame(finger: str, link: str) -> str:
    """Name of a link's frame: origin at its joint, x along the link."""
    return f'{finger}/{link}'


def static_transforms(hand: Hand, world_frame: str, stamp: Time) -> TFMessage:
    """Where the fingers' bases are, for ``/tf_static``."""
    return TFMessage(
        transforms=[
            _transform(
                world_frame,
                base_frame(finger.name),
                stamp,
                np.append(finger.base, finger.base_angle),
            )
            for finger in hand.fingers
        ]
    )


def moving_transforms(hand: Hand, grasp: Grasp, world_frame: str, stamp: Time) -> TFMessage:
    """Where links and object are in a grasp, for ``/tf``."""
    transforms = []
    angles = iter(grasp.joints.tolist())
    for finger in hand.fingers:
        parent, along = base_frame(finger.name), 0.0
        for link in finger.links:
            child = link_frame(finger.name, link.name)
            place = np.array([along, 0.0, next(angles)])
            transforms.append(_transform(parent, child, stamp, place))
            parent, along = child, link.length
    transforms.append(_transform(world_frame, OBJECT_FRAME, stamp, grasp.object_pose))
    return TFMessage(transforms=transforms)


def _transform(parent: str, child: str, stamp: Time, place: FloatArray) -> TransformStamped:
    """Transform from a frame to one that lies in it at a place (x, y, φ)."""
    pose = pose_message(place)
    at = pose.position
    return TransformStamped(
        header=Header(stamp=stamp, frame_id=parent),
        child_frame_id=child,
        transform=Transform(
            translation=Vector3(x=at.x, y=at.y, z=at.z), rotation=pose.orientation
        ),
    )
