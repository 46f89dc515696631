"""Run a plan in the engine: drives follow the reference, and what happens is recorded."""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

from cfplan_core.contact.system import IntArray
from cfplan_core.execution.reference import Reference
from cfplan_core.execution.scene import Scene, import_mujoco
from cfplan_core.geometry.polygon import FloatArray

# Time constant of the object's motion while it is put into the start grasp, s, and how long.
_SETTLING_CONSTANT = 0.02
_SETTLING_TIME = 0.3


@dataclass(frozen=True, eq=False)
class Gains:
    """Gains of the joints' drives, each of shape (n,).

    Attributes:
        stiffness: Of a joint that is held in position, N·m/rad.
        compliance: Stiffness of a joint that is controlled in torque, N·m/rad.
        damping: N·m·s/rad.
    """

    stiffness: FloatArray
    compliance: FloatArray
    damping: FloatArray


@dataclass(frozen=True, eq=False)
class Run:
    """What was measured in an execution at m instants.

    Attributes:
        times: Shape (m,), s from the plan's start.
        rows: Shape (m,), the reference's instants.
        object_poses: Shape (m, 3), of the object's frame: m, m, rad.
        joints: Shape (m, n), rad.
        joint_velocities: Shape (m, n), rad/s.
        torques: Shape (m, n), of the drives, N·m.
        forces: Shape (m, v, b), N: between vertex v and body b, as `ContactSystem` counts them.
    """

    times: FloatArray
    rows: IntArray
    object_poses: FloatArray
    joints: FloatArray
    joint_velocities: FloatArray
    torques: FloatArray
    forces: FloatArray


def simulate(
    scene: Scene,
    reference: Reference,
    gains: Gains,
    joint_errors: FloatArray,
    every: int,
) -> Run:
    """Execute a reference.

    First the object is put into the grasp at the reference's start: it settles under strong
    damping while the drives hold. Then the plan's clock runs, one instant each step.

    Args:
        scene: With the time step of the reference.
        reference: What the drives shall do.
        gains: Of the drives.
        joint_errors: Shape (n,), rad: what each joint's sensor says above its angle.
        every: Steps from one measurement to the next.
    """
    mujoco = import_mujoco()
    model, n = scene.model, len(joint_errors)
    data = mujoco.MjData(model)
    data.qpos[:3] = reference.object_poses[0]
    data.qpos[3:] = reference.joints[0] - joint_errors
    stiffness = np.where(reference.stiff, gains.stiffness, gains.compliance)
    commands = reference.torques + stiffness * (reference.joints - joint_errors)
    commands += gains.damping * reference.velocities
    changes = np.flatnonzero((np.diff(stiffness, axis=0) != 0.0).any(axis=1)) + 1
    switching = set(changes.tolist())

    def switch(row: int) -> None:
        model.actuator_biasprm[:, 1] = -stiffness[row]
        model.actuator_biasprm[:, 2] = -gains.damping

    switch(0)
    data.ctrl[:] = commands[0]
    _settle(mujoco, model, data)

    rows: IntArray = np.arange(0, len(reference.times), every)
    count = len(rows)
    recorder = _Recorder(scene, count, n)
    for row in range(len(reference.times)):
        if row in switching:
            switch(row)
        data.ctrl[:] = commands[row]
        measured = row % every == 0
        if measured:
            recorder.note_state(data)
        mujoco.mj_step(model, data)
        if measured:
            recorder.note_forces(data)
    return Run(
        reference.times[rows],
        rows,
        recorder.poses,
        recorder.joints,
        recorder.velocities,
        recorder.torques,
        recorder.forces,
    )


def _settle(mujoco: ModuleType, model: Any, data: Any) -> None:
    inertia = np.array([model.body_mass[1], model.body_mass[1], model.body_inertia[1, 2]])
    before = model.dof_damping[:3].copy()
    model.dof_damping[:3] = inertia / _SETTLING_CONSTANT
    for _ in range(int(np.ceil(_SETTLING_TIME / model.opt.timestep))):
        mujoco.mj_step(model, data)
    model.dof_damping[:3] = before


class _Recorder:
    def __init__(self, scene: Scene, count: int, n: int) -> None:
        vertices = int(scene.vertex_of_geom.max()) + 1
        self.scene = scene
        self.poses = np.empty((count, 3))
        self.joints = np.empty((count, n))
        self.velocities = np.empty((count, n))
        self.torques = np.empty((count, n))
        self.forces = np.zeros((count, vertices, int(scene.body_of_geom.max()) + 1))
        self.next = 0

    def note_state(self, data: Any) -> None:
        """Note where everything is, before a step."""
        self.poses[self.next] = data.qpos[:3]
        self.joints[self.next] = data.qpos[3:]
        self.velocities[self.next] = data.qvel[3:]

    def note_forces(self, data: Any) -> None:
        """Note the forces that a step began with, after it."""
        k, scene = self.next, self.scene
        self.next += 1
        self.torques[k] = data.actuator_force
        contact = data.contact
        if not len(contact.dist):
            return
        first, second = contact.geom.T
        address = contact.efc_address
        pressing = address >= 0
        vertex = np.maximum(scene.vertex_of_geom[first], scene.vertex_of_geom[second])[pressing]
        body = np.maximum(scene.body_of_geom[first], scene.body_of_geom[second])[pressing]
        np.add.at(self.forces[k], (vertex, body), data.efc_force[address[pressing]])
