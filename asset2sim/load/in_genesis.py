"""A refined object in Genesis."""

import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping
from contextlib import suppress
from typing import Any

import numpy as np

from asset2sim.load.description import Description
from asset2sim.load.in_mujoco import object_spec
from asset2sim.load.loaded import GRAVITY, Contact, Loaded, Root, engine_module, pose_matrix, three_numbers


class GenesisObject(Loaded):
    """The object from Genesis' MJCF reader: its poses add to the file's; its springs pull to zero, so drives pull to
    the reference. ``scene`` and ``entity`` are Genesis'; in a scene of yours call ``finish()`` after
    ``scene.build()``."""

    engine = "genesis"
    takes = "a Scene", "add_entity"

    def __init__(self, about: Description, root: Root, into: Any, timestep_s: float) -> None:
        super().__init__(about, root)
        genesis, scene = engine_module("genesis"), into
        spec = object_spec(about, root._replace(position=(0.0, 0.0, 0.0), wxyz=(1.0, 0.0, 0.0, 0.0)), timestep_s)
        if scene is None:
            with suppress(genesis.GenesisException):  # it is initialised already
                genesis.init(backend=genesis.cpu, logging_level="error", precision="64")
            rigid = genesis.options.RigidOptions(integrator=genesis.integrator.implicitfast)
            sim = genesis.options.SimOptions(dt=timestep_s, gravity=GRAVITY)
            scene = genesis.Scene(sim_options=sim, rigid_options=rigid, show_viewer=False)
            scene.add_entity(genesis.morphs.Plane())
        for joint in spec.joints:  # Genesis takes a limit's impedance for friction too: softer, a held lid creeps
            joint.solimp_limit = (0.9999, 0.9999, 1.0, 0.5, 2.0)
        spec.compile()
        placed = {"pos": root.position, "quat": root.wxyz, "default_armature": 0.0}
        morph = genesis.morphs.MJCF(file=ET.fromstring(spec.to_xml()), **placed)
        entity = scene.add_entity(morph, material=genesis.materials.Rigid(friction=about.contact_friction))
        self.scene, self.entity = scene, entity
        if into is None:
            scene.build()
            self.finish()

    def finish(self) -> None:
        """Put it into its state, and give it springs that pull to their references."""
        entity, joints = self.entity, self.about.joints
        self.dofs = [dof for name in self.joint_names for dof in entity.get_joint(name).dofs_idx_local]
        self.write({joint.name: joint.initial_position for joint in joints})
        entity.set_dofs_kp([joint.stiffness for joint in joints], self.dofs)
        for setting in (entity.set_dofs_stiffness, entity.set_dofs_kv):
            setting([0.0] * len(self.dofs), self.dofs)
        for dof in (one for joint, one in zip(joints, self.dofs, strict=True) if joint.stiffness > 0.0):
            entity.set_dofs_force_range([-math.inf], [math.inf], [dof])
        self.push({})

    @property
    def timestep_s(self) -> float:
        return float(self.scene.sim.dt)

    def read(self) -> tuple[Any, Any]:
        return self.entity.get_dofs_position(self.dofs), self.entity.get_dofs_velocity(self.dofs)

    def write(self, positions: Mapping[str, float]) -> None:
        dofs = [self.dofs[self.joint_names.index(name)] for name in positions]
        self.entity.set_dofs_position(list(positions.values()), dofs, zero_velocity=False)
        self.entity.set_dofs_velocity([0.0] * len(dofs), dofs)

    def place(self) -> None:
        if not self.root.fixed:
            self.entity.set_pos(self.root.position, zero_velocity=True)
            self.entity.set_quat(self.root.wxyz, zero_velocity=True)

    def advance(self) -> object:
        return self.scene.step()

    def push(self, efforts: Mapping[str, float]) -> None:
        for joint, dof in zip(self.about.joints, self.dofs, strict=True):
            effort = efforts.get(joint.name, 0.0)
            if joint.stiffness > 0.0:  # a drive either pulls to a position or exerts a force
                self.entity.control_dofs_position([joint.spring_reference + effort / joint.stiffness], [dof])
            else:
                self.entity.control_dofs_force([effort], [dof])

    def link_poses(self) -> dict[str, np.ndarray]:
        links = {name: self.entity.get_link(name) for name in self.about.links}
        return {
            n: pose_matrix(k.get_pos().flatten().tolist(), k.get_quat().flatten().tolist()) for n, k in links.items()
        }

    def contacts(self) -> list[Contact]:
        touched, found, every = self.entity.get_contacts(), [], self.scene.rigid_solver.links
        columns = (touched["link_a"], touched["link_b"], touched["position"], touched["force_a"])
        for first, second, where, force in zip(*(column.tolist() for column in columns), strict=True):
            for one, other in ((every[first], every[second]), (every[second], every[first])):
                if one.entity is self.entity:
                    found.append(Contact(one.name, other.name, three_numbers(where), float(np.linalg.norm(force))))
        return found
