"""A refined object in Newton."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from asset2sim.load.description import Description
from asset2sim.load.in_mujoco import object_spec
from asset2sim.load.loaded import UNSET, Contact, Loaded, Root, engine_module, pose_matrix
from asset2sim.load.shapes import LoadError


class NewtonObject(Loaded):
    """The object from Newton's MJCF importer, and its MuJoCo solver, which takes all terms; on the CPU that is MuJoCo
    itself. ``builder``, ``model``, ``solver``, ``states`` and ``control`` are Newton's; in a builder of yours use
    ``SolverMuJoCo``, and call ``finish(model, solver, states, control)``."""

    engine = "newton"
    takes = "a ModelBuilder", "add_mjcf"

    def __init__(self, about: Description, root: Root, into: Any, timestep_s: float) -> None:
        super().__init__(about, root)
        self.newton, _, spec = (
            engine_module("newton"),
            engine_module("mujoco_warp"),
            object_spec(about, root, timestep_s),
        )
        builder = self.newton.ModelBuilder() if into is None else into
        self.newton.solvers.SolverMuJoCo.register_custom_attributes(builder)
        self.builder, self.model, self.solver, self.states, self.control = builder, UNSET, UNSET, UNSET, UNSET
        first_joint, first_body, self.step_s = len(builder.joint_label), len(builder.body_label), timestep_s
        spec.compile()
        builder.add_mjcf(spec.to_xml())
        labels = [str(label).rpartition("/")[2] for label in builder.joint_label]
        numbers = [labels.index(name, first_joint) for name in self.joint_names]
        self.places = [builder.joint_q_start[number] for number in numbers]
        self.speeds = [builder.joint_qd_start[number] for number in numbers]
        bodies = [str(label).rpartition("/")[2] for label in builder.body_label]
        self.bodies = {name: bodies.index(name, first_body) for name in about.links}
        for joint, place in zip(about.joints, self.places, strict=True):
            builder.joint_q[place] = joint.initial_position
        if into is None:
            builder.add_ground_plane()
            model = builder.finalize()
            solver = self.newton.solvers.SolverMuJoCo(model, use_mujoco_cpu=not model.device.is_cuda)
            states = [model.state(), model.state()]
            self.newton.eval_fk(model, model.joint_q, model.joint_qd, states[0])
            self.finish(model, solver, states, model.control())

    def finish(self, model: Any = UNSET, solver: Any = UNSET, states: Any = UNSET, control: Any = UNSET) -> None:
        """Bind it to what you made of the builder: ``states`` is a list whose first is the current one."""
        self.model, self.solver, self.states, self.control = model, solver, states, control
        first = self.builder.joint_q_start
        root = self.bodies[self.about.root]
        free = next((n for n, child in enumerate(self.builder.joint_child) if child == root), None)
        self.free = None if self.root.fixed or free is None else (first[free], self.builder.joint_qd_start[free])

    @property
    def timestep_s(self) -> float:
        return self.step_s

    def read(self) -> tuple[Any, Any]:
        state = self.states[0]
        return state.joint_q.numpy()[self.places], state.joint_qd.numpy()[self.speeds]

    def write(self, positions: Mapping[str, float]) -> None:
        at = [self.joint_names.index(name) for name in positions]
        self.put([self.places[k] for k in at], list(positions.values()), [self.speeds[k] for k in at])

    def put(self, places: Any, values: Any, speeds: Any) -> None:
        """Set these coordinates, and these velocities to zero, and the bodies' poses by them."""
        state = self.states[0]
        for array, where, numbers in ((state.joint_q, places, values), (state.joint_qd, speeds, 0.0)):
            copy = array.numpy()
            copy[where] = numbers
            array.assign(copy)
        self.newton.eval_fk(self.model, state.joint_q, state.joint_qd, state)

    def place(self) -> None:
        if self.free is not None:
            place, speed = self.free
            pose = (*self.root.position, *self.root.wxyz[1:], self.root.wxyz[0])
            self.put(list(range(place, place + 7)), pose, list(range(speed, speed + 6)))

    def advance(self) -> object:
        self.solver.step(*self.states, self.control, None, self.step_s)
        return self.states.reverse()

    def push(self, efforts: Mapping[str, float]) -> None:
        forces = self.control.joint_f.numpy()
        forces[self.speeds] = [efforts.get(name, 0.0) for name in self.joint_names]
        self.control.joint_f.assign(forces)

    def link_poses(self) -> dict[str, np.ndarray]:
        poses = self.states[0].body_q.numpy()
        return {name: pose_matrix(poses[k][:3], np.roll(poses[k][3:], 1)) for name, k in self.bodies.items()}

    def contacts(self) -> list[Contact]:
        raise LoadError("contacts by link are not read from Newton; item.solver has them")
