"""A refined object in Drake."""

import xml.etree.ElementTree as ET
from collections.abc import Mapping
from typing import Any

import numpy as np

from asset2sim.load.description import Description
from asset2sim.load.loaded import (
    GRAVITY,
    STOP_DAMPING,
    UNSET,
    Contact,
    Loaded,
    Root,
    copied_urdf,
    engine_module,
    free_name,
    three_numbers,
)
from asset2sim.load.shapes import LoadError


class DrakeObject(Loaded):
    """The object from Drake's URDF parser. It has no joint friction: a drive at rest whose effort is bounded, solved
    implicitly by a discrete plant, is one. Springs are force elements, armature is the drive's rotor inertia.
    ``plant``, ``instance``, ``diagram``, ``simulator`` are Drake's; in a world of yours call ``finish()`` after
    ``Finalize()``, and give it the ``simulator`` that you made: ``item.simulator = …``."""

    engine = "drake"
    takes = "(builder, plant)", "__getitem__"

    def __init__(self, about: Description, root: Root, into: Any, timestep_s: float) -> None:
        super().__init__(about, root)
        drake, mu, diagram, simulator = engine_module("pydrake.all"), about.contact_friction, UNSET, UNSET
        builder, plant = into or (drake.DiagramBuilder(), None)
        if plant is None:
            config = drake.MultibodyPlantConfig(time_step=timestep_s, discrete_contact_approximation="sap")
            plant, scene = drake.AddMultibodyPlant(config, builder)
            soft = {"compliance_type": "compliant", "hydroelastic_modulus": 1e8}  # else shapes touch at single points
            scene.set_config(
                drake.SceneGraphConfig(default_proximity_properties=drake.DefaultProximityProperties(**soft))
            )
            plant.mutable_gravity_field().set_gravity_vector(GRAVITY)
            floor, below = drake.Box(20.0, 20.0, 1.0), drake.RigidTransform([0.0, 0.0, -0.5])
            plant.RegisterCollisionGeometry(plant.world_body(), below, floor, "floor", drake.CoulombFriction(mu, mu))
        self.name = free_name(root, about, plant.HasModelInstanceNamed)
        about.urdf.set("name", self.name)
        with copied_urdf(drake_urdf(about.urdf, mu)) as path:
            (instance,) = drake.Parser(plant).AddModels(path)
        base, turned = plant.GetBodyByName(about.root, instance), drake.Quaternion(root.wxyz)
        pose = drake.RigidTransform(turned, root.position)
        if root.fixed:
            plant.WeldFrames(plant.world_frame(), base.body_frame(), pose)
        else:
            plant.SetDefaultFloatingBaseBodyPose(base, pose)
        made = {joint.name: plant.GetJointByName(joint.name, instance) for joint in about.joints}
        for joint in about.joints:
            made[joint.name].set_default_positions([joint.initial_position])
            made[joint.name].set_default_damping_vector([joint.damping])
            drive = plant.AddJointActuator(f"{joint.name}_friction", made[joint.name], max(joint.friction, 1e-12))
            drive.set_controller_gains(drake.PdControllerGains(p=0.0, d=STOP_DAMPING))
            drive.set_default_rotor_inertia(joint.armature)
            if joint.stiffness > 0.0:
                spring = drake.PrismaticSpring if joint.unit == "m" else drake.RevoluteSpring
                plant.AddForceElement(spring(made[joint.name], joint.spring_reference, joint.stiffness))
        self.drake, self.builder, self.plant, self.instance, self.made = drake, builder, plant, instance, made
        self.diagram, self.simulator = diagram, simulator
        if into is None:
            plant.Finalize()
            self.finish()
            self.diagram = builder.Build()
            self.simulator = drake.Simulator(self.diagram)
            self.simulator.Initialize()

    def finish(self) -> None:
        """Connect what is dry friction, once the plant is finalized."""
        port = self.plant.get_desired_state_input_port(self.instance)
        source = self.builder.AddSystem(self.drake.ConstantVectorSource(np.zeros(port.size())))
        self.builder.Connect(source.get_output_port(), port)

    @property
    def timestep_s(self) -> float:
        return float(self.plant.time_step())

    @property
    def context(self) -> Any:
        """The plant's context. Raises LoadError where there is no simulator yet."""
        if self.simulator is None:
            raise LoadError(f"'{self.name}' is in no simulator yet: set item.simulator to the one that you made")
        return self.plant.GetMyMutableContextFromRoot(self.simulator.get_mutable_context())

    def read(self) -> tuple[Any, Any]:
        both, joints = self.plant.GetPositionsAndVelocities(self.context), self.made.values()
        first = self.plant.num_positions()
        return [both[j.position_start()] for j in joints], [both[first + j.velocity_start()] for j in joints]

    def write(self, positions: Mapping[str, float]) -> None:
        both = self.plant.GetPositionsAndVelocities(self.context).copy()
        for name, value in positions.items():
            both[self.made[name].position_start()] = value
            both[self.plant.num_positions() + self.made[name].velocity_start()] = 0.0
        self.plant.SetPositionsAndVelocities(self.context, both)

    def place(self) -> None:
        if not self.root.fixed:
            base = self.plant.GetBodyByName(self.about.root, self.instance)
            turned = self.drake.Quaternion(self.root.wxyz)
            self.plant.SetFreeBodyPose(self.context, base, self.drake.RigidTransform(turned, self.root.position))
            both, first = (
                self.plant.GetPositionsAndVelocities(self.context).copy(),
                base.floating_velocities_start_in_v(),
            )
            both[self.plant.num_positions() + first :][:6] = 0.0
            self.plant.SetPositionsAndVelocities(self.context, both)

    def advance(self) -> object:
        steps = round(self.simulator.get_context().get_time() / self.timestep_s)
        return self.simulator.AdvanceTo((steps + 1) * self.timestep_s)

    def push(self, efforts: Mapping[str, float]) -> None:
        port = self.plant.get_applied_generalized_force_input_port()
        forces = (
            port.Eval(self.context).copy() if port.HasValue(self.context) else np.zeros(self.plant.num_velocities())
        )
        for name, joint in self.made.items():
            forces[joint.velocity_start()] = efforts.get(name, 0.0)
        port.FixValue(self.context, forces)

    def link_poses(self) -> dict[str, np.ndarray]:
        bodies = {name: self.plant.GetBodyByName(name, self.instance) for name in self.about.links}
        return {n: self.plant.EvalBodyPoseInWorld(self.context, b).GetAsMatrix4() for n, b in bodies.items()}

    def contacts(self) -> list[Contact]:
        results = self.plant.get_contact_results_output_port().Eval(self.context)
        inspector, found = self.plant.get_geometry_query_input_port().Eval(self.context).inspector(), []
        pairs = []
        for number in range(results.num_point_pair_contacts()):
            info = results.point_pair_contact_info(number)
            bodies = [self.plant.get_body(index) for index in (info.bodyA_index(), info.bodyB_index())]
            pairs.append((bodies, info.contact_point(), info.contact_force()))
        for number in range(results.num_hydroelastic_contacts()):
            patch = results.hydroelastic_contact_info(number)
            surface = patch.contact_surface()
            frames = [inspector.GetFrameId(shape) for shape in (surface.id_M(), surface.id_N())]
            bodies = [self.plant.GetBodyFromFrameId(frame) for frame in frames]
            pairs.append((bodies, surface.centroid(), patch.F_Ac_W().translational()))
        for bodies, where, force in pairs:
            for one, other in (bodies, reversed(bodies)):
                if one.model_instance() == self.instance:
                    found.append(Contact(one.name(), other.name(), three_numbers(where), float(np.linalg.norm(force))))
        return found


def drake_urdf(urdf: ET.Element, mu: float) -> ET.Element:
    """The tree with contact friction and pairs that pass each other as Drake reads them, without names of shapes, which
    datasets repeat and Drake refuses."""
    urdf.set("xmlns:drake", "http://drake.mit.edu")
    for number, pair in enumerate(urdf.findall("disable_collisions")):
        group = ET.SubElement(urdf, "drake:collision_filter_group", name=f"pass_{number}")
        for key in ("link1", "link2"):
            ET.SubElement(group, "drake:member", link=str(pair.get(key)))
        ET.SubElement(group, "drake:ignored_collision_filter_group", name=f"pass_{number}")
    for shape in (*urdf.iter("visual"), *urdf.iter("collision")):
        shape.attrib.pop("name", None)
        contact = ET.SubElement(shape, "drake:proximity_properties")
        ET.SubElement(contact, "drake:mu_static", value=repr(mu))
        ET.SubElement(contact, "drake:mu_dynamic", value=repr(mu))
    return urdf
