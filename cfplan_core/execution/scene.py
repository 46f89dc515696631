"""A problem as a MuJoCo model.

The model is planar: its object slides along x and y and turns about z, its links turn about z.
Contact is possible exactly where the planner considers it, between a vertex of one body and the
edges of another. Bodies are polygons whose corners are rounded, by radii so small that no corner
moves by more than a few ten thousandths of the object's size; edges stay where they are. A body's
outline shrunk by a distance is collided with balls at the corners of the other, whose radii are
larger than these corners' by that distance: so a contact of the engine is one elemental contact,
and as nothing ever overlaps, its direction is right also where a vertex passes a vertex. Exact
corners would have to overlap there, and the engine would push them out through either edge.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

from cfplan_core.contact.system import ContactSystem, IntArray
from cfplan_core.errors import CfplanError
from cfplan_core.geometry.convex_pieces import convex_pieces, rounded, shrunk
from cfplan_core.geometry.polygon import FloatArray, centroid, second_moment
from cfplan_core.model import Problem

# Radius of the corners and half the thickness of the bodies, in sizes of the object.
_RADIUS = 5e-4
_HALF_THICKNESS = 0.25
# Inertia of a joint's drive, and mass of a link that the problem gives none, in those of the
# object: m L² and m.
_DRIVE_INERTIA = 1.0
_LINK_MASS = 1e-3
# Contacts push back with a time constant of so many steps, and are damped critically.
_STIFFNESS_STEPS = 10.0
_IMPEDANCE = (0.99, 0.999, 1e-4, 0.5, 2.0)


def import_mujoco() -> ModuleType:
    """Import the physics engine.

    Raises:
        CfplanError: It is not installed.
    """
    try:
        import mujoco
    except ImportError as error:
        raise CfplanError(
            f'execution needs the physics engine MuJoCo: {error}; '
            "install it with pip install 'cfplan_ros[mujoco]', or pip install mujoco"
        ) from error
    module: ModuleType = mujoco
    return module


@dataclass(frozen=True, eq=False)
class Scene:
    """A compiled MuJoCo model and what its parts stand for.

    The generalised positions are the pose of the object's frame (m, m, rad) and the joint angles
    (rad) in the hand's order; the actuators are the joints' in the same order.

    Attributes:
        problem: What was modelled.
        model: ``mujoco.MjModel``.
        vertex_of_geom: For each geom the vertex that its ball stands for, as `ContactSystem`
            counts them, or -1.
        body_of_geom: For each geom the body whose polygon it is part of, as `ContactSystem`
            counts them, or -1.
    """

    problem: Problem
    model: Any
    vertex_of_geom: IntArray
    body_of_geom: IntArray


def build_scene(problem: Problem, time_step: float, friction: float = 0.0) -> Scene:
    """Model a problem.

    Args:
        problem: Hand, object and gravity; its coefficient of friction is not regarded.
        time_step: Of the engine, s.
        friction: Coulomb coefficient of every contact.

    Raises:
        CfplanError: MuJoCo is not installed or refuses the model.
    """
    spec = build_spec(problem, time_step, friction)
    try:
        model = spec.compile()
    except ValueError as error:
        raise CfplanError(f'MuJoCo refuses the model of {problem.name}: {error}') from None
    vertex_of_geom = np.full(model.ngeom, -1, dtype=np.intp)
    body_of_geom = np.full(model.ngeom, -1, dtype=np.intp)
    for geom in range(model.ngeom):
        kind, _, number = model.geom(geom).name.partition(' ')
        if kind == 'vertex':
            vertex_of_geom[geom] = int(number)
        elif kind == 'body':
            body_of_geom[geom] = int(number.partition(' ')[0])
    return Scene(problem, model, vertex_of_geom, body_of_geom)


def build_spec(problem: Problem, time_step: float, friction: float) -> Any:
    """Model a problem as an editable ``mujoco.MjSpec``; arguments as of `build_scene`."""
    mujoco = import_mujoco()
    spec = mujoco.MjSpec()
    spec.modelname = problem.name
    spec.compiler.degree = False
    spec.compiler.balanceinertia = False
    spec.option.gravity = [*problem.gravity, 0.0]
    spec.option.timestep = time_step
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.iterations = 100
    spec.option.tolerance = 1e-12
    spec.option.ccd_tolerance = 1e-10
    builder = _Builder(mujoco, spec, problem)
    builder.add_bodies()
    builder.add_pairs(friction, _STIFFNESS_STEPS * time_step)
    return spec


class _Builder:
    """Fills a spec with the bodies of a problem."""

    def __init__(self, mujoco: ModuleType, spec: Any, problem: Problem) -> None:
        self.mujoco = mujoco
        self.spec = spec
        self.problem = problem
        self.system = ContactSystem(problem)
        self.size = problem.object.size
        self.radius = _RADIUS * self.size
        self.pieces: list[list[str]] = []

    def add_bodies(self) -> None:
        """Add object, palm and fingers, in the order of `ContactSystem.body_names`."""
        world = self.spec.worldbody
        thing = self.problem.object
        body = world.add_body(name='object')
        for name, axis in (('x', [1, 0, 0]), ('y', [0, 1, 0])):
            slide = self.mujoco.mjtJoint.mjJNT_SLIDE
            body.add_joint(name=f'object {name}', type=slide, axis=axis)
        hinge = self.mujoco.mjtJoint.mjJNT_HINGE
        body.add_joint(name='object angle', type=hinge, axis=[0, 0, 1])
        self._add_mass(body, thing.vertices, thing.mass, thing.center_of_mass)
        self._add_geoms(body, thing.vertices)
        for vertices in self.problem.hand.palm:
            self._add_geoms(world, vertices)
        for finger in self.problem.hand.fingers:
            parent, place, turn = world, finger.base, finger.base_angle
            for joint, link in zip(finger.joints, finger.links, strict=True):
                body = parent.add_body(
                    name=f'{finger.name}.{link.name}',
                    pos=[*place, 0.0],
                    quat=[np.cos(0.5 * turn), 0.0, 0.0, np.sin(0.5 * turn)],
                )
                body.add_joint(
                    name=joint.name,
                    type=hinge,
                    axis=[0, 0, 1],
                    armature=_DRIVE_INERTIA * thing.mass * self.size**2,
                )
                mass = link.mass or _LINK_MASS * thing.mass
                self._add_mass(body, link.vertices, mass, centroid(link.vertices))
                if not link.mass:
                    body.gravcomp = 1.0
                self._add_geoms(body, link.vertices)
                parent, place, turn = body, np.array([link.length, 0.0]), 0.0
        for joint in self.problem.hand.joints:
            self._add_actuator(joint.name, joint.effort_limit)

    def add_pairs(self, friction: float, time_constant: float) -> None:
        """Let every vertex collide with every body that the planner lets it touch."""
        system = self.system
        touched = system.body_of[system.pair_edge]
        vertex_bodies = dict.fromkeys(
            zip(system.pair_vertex.tolist(), touched.tolist(), strict=True)
        )
        for vertex, body in vertex_bodies:
            for piece in self.pieces[body]:
                self._add_pair(f'vertex {vertex}', piece, friction, time_constant)

    def _add_pair(self, first: str, second: str, friction: float, time_constant: float) -> None:
        self.spec.add_pair(
            geomname1=first,
            geomname2=second,
            condim=3 if friction else 1,
            friction=[friction, friction, 0.0, 0.0, 0.0],
            solref=[time_constant, 1.0],
            solimp=_IMPEDANCE,
        )

    def _add_mass(self, body: Any, vertices: FloatArray, mass: float, center: FloatArray) -> None:
        """Give a body its mass, with the inertia of a uniform plate of its outline."""
        inertia = mass * second_moment(vertices, center)
        body.explicitinertial = True
        body.mass = mass
        body.ipos = [*center, 0.0]
        body.inertia = [inertia, inertia, inertia]

    def _add_geoms(self, body: Any, vertices: FloatArray) -> None:
        """Add the outline's extruded pieces and the balls at its vertices."""
        number = len(self.pieces)
        first = int(self.system.first_vertex[number])
        names = []
        for k, piece in enumerate(convex_pieces(shrunk(vertices, self.radius))):
            name = f'body {number} {k}'
            self._add_piece(body, name, piece)
            names.append(name)
        self.pieces.append(names)
        centers, radii = rounded(vertices, self.radius)
        for k in np.flatnonzero(self.system.convex[first : first + len(vertices)]).tolist():
            body.add_geom(
                name=f'vertex {first + k}',
                type=self.mujoco.mjtGeom.mjGEOM_SPHERE,
                size=[radii[k] + self.radius, 0.0, 0.0],
                pos=[*centers[k], 0.0],
                contype=0,
                conaffinity=0,
            )

    def _add_piece(self, body: Any, name: str, piece: FloatArray) -> None:
        """Add a convex piece: a box if it is one, else a mesh."""
        half = _HALF_THICKNESS * self.size
        box = _as_box(piece)
        if box is not None:
            center, angle, (length, width) = box
            body.add_geom(
                name=name,
                type=self.mujoco.mjtGeom.mjGEOM_BOX,
                size=[0.5 * length, 0.5 * width, half],
                pos=[*center, 0.0],
                quat=[np.cos(0.5 * angle), 0.0, 0.0, np.sin(0.5 * angle)],
                contype=0,
                conaffinity=0,
            )
            return
        corners = [[x, y, z] for z in (-half, half) for x, y in piece]
        self.spec.add_mesh(name=name, uservert=np.ravel(corners))
        body.add_geom(
            name=name,
            type=self.mujoco.mjtGeom.mjGEOM_MESH,
            meshname=name,
            contype=0,
            conaffinity=0,
        )

    def _add_actuator(self, joint: str, effort_limit: float) -> None:
        """Add a drive whose torque is its control minus stiffness and damping times motion."""
        self.spec.add_actuator(
            name=joint,
            target=joint,
            trntype=self.mujoco.mjtTrn.mjTRN_JOINT,
            gaintype=self.mujoco.mjtGain.mjGAIN_FIXED,
            gainprm=[1.0, *[0.0] * 9],
            biastype=self.mujoco.mjtBias.mjBIAS_AFFINE,
            forcelimited=True,
            forcerange=[-effort_limit, effort_limit],
        )


def _as_box(piece: FloatArray) -> tuple[FloatArray, float, tuple[float, float]] | None:
    """Centre, angle and side lengths of a rectangle; None of any other polygon."""
    if len(piece) != 4:
        return None
    sides = np.roll(piece, -1, axis=0) - piece
    lengths = np.hypot(sides[:, 0], sides[:, 1])
    square = np.abs((sides * np.roll(sides, -1, axis=0)).sum(axis=1)).max()
    if square > 1e-12 * lengths.max() ** 2:
        return None
    angle = float(np.arctan2(sides[0, 1], sides[0, 0]))
    return piece.mean(axis=0), angle, (float(lengths[0]), float(lengths[1]))
