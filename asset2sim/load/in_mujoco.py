"""A refined object in MuJoCo, and its specification, which Genesis and Newton read too."""

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from typing import Any

import numpy as np

from asset2sim.load.description import Description
from asset2sim.load.loaded import (
    GRAVITY,
    UNSET,
    Contact,
    Loaded,
    Root,
    copied_urdf,
    engine_module,
    free_name,
    pose_matrix,
    three_numbers,
)
from asset2sim.load.shapes import LoadError

WORLD = ("timestep", "gravity", "integrator", "cone", "impratio", "iterations", "tolerance")


class MuJoCoObject(Loaded):
    """The object compiled with a floor; or attached to a specification of yours, names beginning with ``name/``:
    impratio 100 and elliptic cones keep what stands there from creeping. ``spec`` is an ``MjSpec``, ``model`` and
    ``data`` are there once it is compiled: ``finish(model, data)``."""

    engine = "mujoco"
    takes = "an MjSpec", "worldbody"

    def __init__(self, about: Description, root: Root, into: Any, timestep_s: float) -> None:
        super().__init__(about, root)
        self.mujoco, spec = engine_module("mujoco"), object_spec(about, root, timestep_s)
        self.spec, self.model, self.data, self.prefix = spec if into is None else into, UNSET, UNSET, ""
        self.top = spec.worldbody.first_body().name  # the root, but where that is a link "world", which MuJoCo drops
        if into is not None:
            self.name = free_name(root, about, lambda name: into.body(f"{name}/{self.top}") is not None)
            self.prefix = f"{self.name}/"
            for option in WORLD:  # MuJoCo warns of each that differs, and keeps the world's
                setattr(spec.option, option, getattr(into.option, option))
            into.attach(spec, prefix=self.prefix, frame=into.worldbody.add_frame())
        else:
            spec.worldbody.add_geom(name="floor", type=self.mujoco.mjtGeom.mjGEOM_PLANE, size=(0.0, 0.0, 0.05))
            spec.worldbody.add_light(pos=(0.0, 0.0, 4.0), dir=(0.0, 0.0, -1.0))
            model = spec.compile()
            self.finish(model, self.mujoco.MjData(model))

    def finish(self, model: Any = UNSET, data: Any = UNSET) -> None:
        """Bind it to the model compiled of ``spec`` and its data, and put it into its state there."""
        if model is None or data is None:
            raise LoadError("MuJoCo: finish(model, data) takes what you compiled of the specification")
        self.model, self.data = model, data
        self.write({joint.name: joint.initial_position for joint in self.about.joints})

    @property
    def timestep_s(self) -> float:
        return float(self.bound.model.opt.timestep)

    @property
    def bound(self) -> "MuJoCoObject":
        """This object. Raises LoadError where ``finish`` was not called yet."""
        if self.data is None:
            raise LoadError(f"'{self.name}' is of no compiled model yet: call finish(model, data)")
        return self

    def read(self) -> tuple[Any, Any]:
        joints = [self.bound.data.joint(self.prefix + name) for name in self.joint_names]
        return [joint.qpos[0] for joint in joints], [joint.qvel[0] for joint in joints]

    def write(self, positions: Mapping[str, float]) -> None:
        for name, value in positions.items():
            joint = self.bound.data.joint(self.prefix + name)
            joint.qpos[0], joint.qvel[0], joint.qacc_warmstart[0] = value, 0.0, 0.0
        self.mujoco.mj_forward(self.model, self.data)

    def place(self) -> None:
        first = int(self.bound.model.body(self.prefix + self.top).jntadr[0])
        if first >= 0 and self.model.jnt_type[first] == self.mujoco.mjtJoint.mjJNT_FREE:
            place, dof = self.model.jnt_qposadr[first], self.model.jnt_dofadr[first]
            self.data.qpos[place : place + 7] = (*self.root.position, *self.root.wxyz)
            self.data.qvel[dof : dof + 6] = self.data.qacc_warmstart[dof : dof + 6] = 0.0

    def advance(self) -> object:
        return self.mujoco.mj_step(self.bound.model, self.data)

    def push(self, efforts: Mapping[str, float]) -> None:
        for name in self.joint_names:
            self.bound.data.joint(self.prefix + name).qfrc_applied[0] = efforts.get(name, 0.0)

    def link_poses(self) -> dict[str, np.ndarray]:
        self.mujoco.mj_kinematics(self.bound.model, self.data)  # else of the state before the step
        names = {name: self.top if name == self.about.root else name for name in map(str, self.about.links)}
        bodies = {name: self.data.body(self.prefix + own) for name, own in names.items()}
        return {name: pose_matrix(body.xpos, body.xquat) for name, body in bodies.items()}

    def contacts(self) -> list[Contact]:
        return contacts_of(self.mujoco, self.bound.model, self.data, self.prefix, self.about)


def contacts_of(mujoco: Any, model: Any, data: Any, prefix: str, about: Description) -> list[Contact]:
    """The contacts in MuJoCo's data that bear a force on links whose bodies' names begin so."""
    mine, found, force = {prefix + name for name in about.links}, [], np.zeros(6)
    for number, contact in enumerate(data.contact[: data.ncon]):
        bodies = [model.body(int(model.geom_bodyid[geom])).name for geom in contact.geom]
        mujoco.mj_contactForce(model, data, number, force)
        for one, other in ((0, 1), (1, 0)):
            if bodies[one] in mine and force[0] > 0.0:
                name = bodies[other].removeprefix(prefix) if bodies[other] in mine else bodies[other]
                name = model.geom(int(contact.geom[other])).name or name if name == "world" else name
                found.append(
                    Contact(bodies[one].removeprefix(prefix), name, three_numbers(contact.pos), float(force[0]))
                )
    return found


def object_spec(about: Description, root: Root, timestep_s: float) -> Any:
    """The object as an ``MjSpec``, its root placed, held or free: the exported ``mobility.xml``, or where there is none
    the URDF without its looks, with the joints' terms and the options that the export has."""
    mujoco, exported = engine_module("mujoco"), about.folder / "mobility.xml"
    if exported.is_file():
        spec = mujoco.MjSpec.from_file(str(exported))
        for file in (one for one in (*spec.meshes, *spec.textures) if one.file):
            file.file = str(about.folder / file.file)  # wherever it is attached
    else:
        settings = {"strippath": "false", "fusestatic": "false", "discardvisual": "false", "balanceinertia": "false"}
        ET.SubElement(ET.SubElement(about.urdf, "mujoco"), "compiler", settings)
        with copied_urdf(about.urdf, visuals=False) as path:
            spec = mujoco.MjSpec.from_file(path)
        give_terms(mujoco, spec, about, timestep_s)
    spec.option.timestep = timestep_s
    for left in (*spec.keys, *spec.actuators):  # keys are of a root held or free; ``drive`` does what mechanisms do
        spec.delete(left)
    body = spec.worldbody.first_body()
    body.pos, body.quat = root.position, root.wxyz
    free = [joint for joint in body.joints if joint.type == mujoco.mjtJoint.mjJNT_FREE]
    for joint in free if root.fixed else ():
        spec.delete(joint)
    if not free and not root.fixed:
        body.add_freejoint(name=f"{about.root}_free")
    return spec


def give_terms(mujoco: Any, spec: Any, about: Description, timestep_s: float) -> None:
    """Set what MuJoCo's URDF reader leaves out: the joints' terms, and options under which objects rest."""
    stiff, time, option = (0.9999, 0.9999, 1.0, 0.5, 2.0), (3.0 * timestep_s, 1.0), spec.option
    spec.compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE
    option.gravity, option.impratio, option.iterations, option.tolerance = GRAVITY, 100.0, 100, 1e-10
    option.integrator, option.cone = mujoco.mjtIntegrator.mjINT_IMPLICITFAST, mujoco.mjtCone.mjCONE_ELLIPTIC
    for term in about.joints:
        joint = spec.joint(term.name)
        joint.damping, joint.stiffness = [term.damping, 0.0, 0.0], [term.stiffness, 0.0, 0.0]
        joint.frictionloss, joint.springref, joint.armature = term.friction, term.spring_reference, term.armature
        joint.solref_friction, joint.solref_limit, joint.solimp_friction = time, time, stiff
        joint.solimp_limit = stiff if term.armature > 0.0 else (0.99, 0.99, 1.0, 0.5, 2.0)
        if term.lower is not None and term.lower == term.upper:  # MuJoCo reads this as no limit
            joint.range, joint.limited = (term.lower, term.lower + 1e-6), mujoco.mjtLimited.mjLIMITED_TRUE
    for geom in spec.geoms:
        geom.solref, geom.solimp, geom.priority = time, (0.95, 0.99, 1e-3, 0.5, 2.0), 1
        geom.friction = (about.contact_friction, 5e-3, about.rolling_friction_m or 1e-4)
        geom.condim = 6 if about.rolling_friction_m else 3
    groups: tuple[list[str], ...] = ([], [], [])  # welded to the root, one joint away, further
    waiting = [(spec.worldbody.first_body(), 0)]
    for body, away in waiting:
        groups[min(away, 2)].append(body.name)
        waiting.extend((child, away + len(child.joints)) for child in body.bodies)
    for held in groups[0]:  # contacts that MuJoCo filters, but not where the root is held to the world
        for other in groups[1]:
            spec.add_exclude(bodyname1=held, bodyname2=other)
    for pair in about.passing:
        spec.add_exclude(bodyname1=pair[0], bodyname2=pair[1])
