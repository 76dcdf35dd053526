"""MJCF to URDF by MuJoCo's own compiler: what the compiled model holds, written as links and joints.

Compiling resolves defaults, includes, angles and mesh scales. Meshes are written anew, as they stand in their link.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from lxml import etree
from lxml.etree import _Element as Element

from asset2sim.assets.urdf.edit import short_numbers
from asset2sim.assets.urdf.references import ANYWHERE, AllowedFolders
from asset2sim.intake.formats.format import (
    Converted,
    Format,
    add_child,
    add_contact,
    add_inertial,
    add_joint,
    pose_of,
    settle_free,
    stand_as_drawn,
    unconvertible_error,
    world_name,
)
from asset2sim.intake.formats.mjcf_compiled import compiled, states_mass
from asset2sim.intake.formats.mjcf_document import is_mjcf, models_of
from asset2sim.intake.formats.mjcf_geoms import MjcfGeoms, let_pass, masks_of, name_of
from asset2sim.intake.formats.mjcf_loops import loop_ties
from asset2sim.intake.formats.mjcf_scene import SCENE, beside, ground_of, is_sized
from asset2sim.intake.formats.mjcf_ties import driven_joints, led_by_mocap, read_ties, tie
from asset2sim.physics.arrays import Array
from schemas.errors import AssetError

MUJOCO_FRICTION = 1.0
"""Coefficient of geoms that state none."""


def urdf_of_mjcf(file: Path, work: Path, reach: AllowedFolders = ANYWHERE) -> Converted:
    """The URDF of an MJCF file; its meshes are written into ``work``. Raises AssetError as ``compiled`` does, and for
    joints that a URDF does not have."""
    mujoco, spec, model, notes = compiled(file, reach)
    return _MjcfAsset(file, work, mujoco, spec, model, notes).converted()


WHOLE_TURN_RAD = 6.0
"""Range of a hinge from which it says nothing where its file does not limit it by that."""
SEE_THROUGH = 0.5
"""Opacity of a geom up to which one sees through it."""
MOSTLY = 0.9
"""Share of a body's compiled mass from which what its geoms state is its mass; the rest is at the density of water."""


class _MjcfAsset:
    """One compiled model being converted."""

    def __init__(self, file: Path, work: Path, mujoco: Any, spec: Any, model: Any, notes: Sequence[str]) -> None:
        self.file, self.work = file, work
        self.mj, self.spec, self.model = mujoco, spec, model
        self.notes = list(notes)
        self.base = world_name({self.name("body", body) for body in range(1, model.nbody)})
        self.ground = ground_of(mujoco, model)
        self.led = led_by_mocap(mujoco, model)
        self.beside = beside(mujoco, model, self.ground, self.led)
        apart = "apart from all that moves"
        self.ground |= {item.geoms[0]: item.left_out(apart) for item in self.beside if item.kind == "geom"}
        self.shapes = MjcfGeoms(mujoco, spec, model, work)

    def converted(self) -> Converted:
        """The model as a URDF."""
        m = self.model
        robot = etree.Element("robot", name=self.file.stem)
        self.notes += filter(None, self.ground.values())
        # A program moves mocap bodies: markers, but also the objects that it places, which have joints.
        jointed = {int(m.body_rootid[body]) for body in range(1, m.nbody) if m.body_jntnum[body]}
        at_top = self.parts(0)
        tops = [body for body in at_top if m.body_mocapid[body] < 0 or body in jointed]
        if len(tops) < len(at_top):
            self.notes.append(f"its {len(at_top) - len(tops)} mocap bodies without joints are left out")
        self.notes += [f"'{self.name('body', top)}', which a mocap body leads, is left out" for top in sorted(self.led)]
        tops = [body for body in tops if body not in self.led]
        loose = [body for body in tops if self.is_free(body)]
        solid = self.geoms(0)
        if not tops and not solid:
            raise self.refused("mjcf_bodies", "it has no body")
        world, held, free = "", "", tuple[str, ...]()
        if len(tops) == 1 and not solid and (loose or not self.joint_types(tops[0])):
            self.add_body(robot, tops[0], None, np.eye(4))
            top = pose_of(m.body_pos[tops[0]], m.body_quat[tops[0]])
            stand_as_drawn(robot, self.name("body", tops[0]), top)
        else:
            world, base = self.base, add_child(robot, "link", name=self.base)
            free = tuple(self.name("body", body) for body in loose)
            self.add_geoms(base, solid, np.eye(4))
            for body in tops:
                self.add_body(robot, body, self.base, np.eye(4))
            self.notes += settle_free(robot, self.base, free)
            if solid:
                held = "its file has shapes in the world itself"
            elif all(not self.geoms(body) for body in range(1, m.nbody) if not m.body_weldid[body]):
                held = "its file hangs its joints on the world alone"
        links = {body: self.name("body", body) if body else self.base for body in range(m.nbody)}
        closed = loop_ties(self.mj, m, lambda joint: self.name("joint", joint))
        ties, untied, tendons = read_ties(self.mj, m, lambda joint: self.name("joint", joint), closed.said)
        self.notes += [*closed.notes, *untied, *tie(robot, [*ties, *closed.ties])]
        masks = masks_of(m, links, self.ground)
        apart = {(links[first], links[second]) for first, second in sorted(closed.apart)}
        for first, second in dict.fromkeys((*let_pass(self.mj, m, links, masks), *sorted(apart))):
            add_child(robot, "disable_collisions", link1=first, link2=second, reason="Never")
        driven = driven_joints(self.mj, m, lambda joint: self.name("joint", joint))
        left = {"tendons": m.ntendon - tendons, "actuators": m.nu, "sensors": m.nsensor}
        left |= {"further keyframes": max(m.nkey - 1, 0), "height fields": m.nhfield}
        told = [f"its {count} {what} are left out" for what, count in left.items() if count]
        files = tuple(
            sorted(
                path for path in self.file.parent.rglob("*") if path.suffix in (".xml", ".mjcf") and path != self.file
            )
        )
        sized = is_sized(self.mj, m)
        told += ["its corners are marked for a loader that scales it, so its lengths are not metres"] * sized
        notes = (*dict.fromkeys(self.notes), *told)
        on_table = any(SCENE in note for note in self.ground.values()) and len(loose) < len(tops)
        stood = "its file fixes it on a floor or table, which is left out" if on_table else ""
        still = tuple(item.name for item in self.beside if item.kind == "body")
        made = Converted(robot, files, notes, world=world, free=free, beside=still, held=held)
        return replace(made, masks=masks, driven=driven, stood=stood, sized=sized)

    def refused(self, code: str, problem: str) -> AssetError:
        """The error that names the file."""
        return unconvertible_error(self.file, code, problem)

    def name(self, kind: str, index: int) -> str:
        """The name of an item; see ``name_of``."""
        return name_of(self.mj, self.model, kind, index)

    def joints(self, body: int) -> list[int]:
        """The joints that move a body in its parent, the first outermost."""
        start = self.model.body_jntadr[body]
        return list(range(start, start + self.model.body_jntnum[body]))

    def joint_types(self, body: int) -> list[int]:
        """The types of a body's joints."""
        return [int(self.model.jnt_type[joint]) for joint in self.joints(body)]

    def is_free(self, body: int) -> bool:
        """Whether a body's joints let it go anywhere: a free joint, or three slides without limits along independent
        axes and three such hinges or a ball, as files write it that know no free joint."""
        m, kinds = self.model, self.mj.mjtJoint
        free, ball, slide, hinge = map(int, (kinds.mjJNT_FREE, kinds.mjJNT_BALL, kinds.mjJNT_SLIDE, kinds.mjJNT_HINGE))
        joints, types = self.joints(body), self.joint_types(body)
        if types == [free] or any(m.jnt_limited[joint] for joint in joints):
            return types == [free]
        axes = {kind: m.jnt_axis[[j for j in joints if m.jnt_type[j] == kind]] for kind in (slide, hinge)}
        spanned = {kind: len(axes[kind]) and np.linalg.matrix_rank(axes[kind], 1e-3) == 3 for kind in axes}
        return bool(spanned[slide] and (ball in types or spanned[hinge]))

    def key(self) -> int:
        """The keyframe in which the model starts: that named ``home``, else the first."""
        named = self.mj.mj_name2id(self.model, self.mj.mjtObj.mjOBJ_KEY, "home")
        return max(int(named), 0)

    def geoms(self, body: int) -> list[int]:
        """The geoms of a body but the scene's."""
        start, count = self.model.body_geomadr[body], self.model.body_geomnum[body]
        return [geom for geom in range(start, start + count) if geom not in self.ground]

    def add_body(self, robot: Element, body: int, parent: str | None, parent_to_link: Array) -> None:
        """A body and all that hangs from it; ``parent_to_link`` is the parent body's (4, 4) pose in its URDF link. Of
        several joints each but the last gets a link without geometry."""
        m, name = self.model, self.name("body", body)
        pose = parent_to_link @ pose_of(m.body_pos[body], m.body_quat[body])
        anchor = np.zeros(3)
        ball, free = self.mj.mjtJoint.mjJNT_BALL, self.mj.mjtJoint.mjJNT_FREE
        held = [] if m.body_parentid[body] == 0 and self.is_free(body) else self.joints(body)
        joints = [
            (joint, turn) for joint in held if m.jnt_type[joint] != free
            for turn in (range(3) if m.jnt_type[joint] == ball else [None])
        ]  # fmt: skip
        for number, (joint, turn) in enumerate(joints):
            last = number == len(joints) - 1
            child = name if last else f"{name}_{number}"
            step = np.eye(4)
            step[:3, 3] = m.jnt_pos[joint] - anchor
            anchor = m.jnt_pos[joint]
            if parent is None:
                raise self.refused("mjcf_joint", f"body '{name}' has joints beside a free one")
            self.add_joint(robot, joint, turn, parent, child, pose @ step)
            if not last:
                add_child(robot, "link", name=child)
            parent, pose = child, np.eye(4)
        if not joints and parent is not None:
            add_joint(robot, f"{name}_fixed", "fixed", parent, name, pose)
        link = add_child(robot, "link", name=name)
        body_to_link = np.eye(4)
        body_to_link[:3, 3] = -anchor
        if self.weighed(body):
            self.add_mass(link, body, body_to_link)
        self.add_geoms(link, self.geoms(body), body_to_link)
        solid = [geom for geom in self.geoms(body) if m.geom_contype[geom] or m.geom_conaffinity[geom]]
        add_contact(link, [float(m.geom_friction[geom][0]) for geom in solid], default=MUJOCO_FRICTION)
        for other in self.parts(body):
            self.add_body(robot, other, name, body_to_link)

    def add_geoms(self, link: Element, geoms: Iterable[int], body_to_link: Array) -> None:
        """The geoms of a body, at its pose in its link."""
        self.notes += filter(None, [self.shapes.add(link, geom, body_to_link) for geom in geoms])

    def parts(self, body: int) -> list[int]:
        """The bodies that hang from one, without the scene's and those that only mark a place: they and all below them
        have no joint, geom or mass of their own, or hang on the world and are all marks."""
        m = self.model
        below = [other for other in range(1, m.nbody) if m.body_parentid[other] == body]
        return [
            other for other in below
            if self.joints(other) or self.parts(other)
            or any(body or not self.is_mark(geom) for geom in self.geoms(other))
            or (self.spec.bodies[other].explicitinertial and not m.body_geomnum[other])
        ]  # fmt: skip

    def is_mark(self, geom: int) -> bool:
        """Whether a geom shows a place or a bound and is nothing itself: its file gives it no mass."""
        m = self.model
        touches = m.geom_contype[geom] or m.geom_conaffinity[geom]
        return not touches and self.spec.geoms[geom].mass == 0.0 and m.geom_rgba[geom][3] <= SEE_THROUGH

    def weighed(self, body: int) -> bool:
        """Whether a body's mass is stated: by itself, or by its geoms that weigh anything, each by a mass (one that
        states none has NaN) or the density of a material, be it that those without add little to it, as what is only
        seen."""
        (low, high), own = self.spec.compiler.inertiagrouprange, self.spec.bodies[body]
        counted = [geom for geom in own.geoms if low <= geom.group <= high and geom.density > 0.0 and geom.mass != 0.0]
        stated = [geom.mass for geom in counted if np.isfinite(geom.mass)]
        # Any share of a total that the file sets (settotalmass) is stated where every geom states its own.
        every = bool(counted) and all(map(states_mass, counted))
        return bool(own.explicitinertial or every or sum(stated) > MOSTLY * self.model.body_mass[body])

    def add_mass(self, link: Element, body: int, body_to_link: Array) -> None:
        """A body's stated inertial; one that MuJoCo makes of geoms at its default density is left out."""
        m, (x, y, z) = self.model, map(float, self.model.body_inertia[body])
        pose = body_to_link @ pose_of(m.body_ipos[body], m.body_iquat[body])
        add_inertial(link, float(m.body_mass[body]), pose, (x, 0.0, 0.0, y, 0.0, z))

    def add_joint(self, robot: Element, joint: int, turn: int | None, parent: str, child: str, pose: Array) -> None:
        """A hinge or slide, or one ``turn`` (0 to 2) of a ball, which a URDF has as three hinges; its zero is where the
        model is drawn."""
        m, name = self.model, self.name("joint", joint)
        if turn is not None:
            turned = name if turn == 2 else f"{name}_{turn}"
            element = add_joint(robot, turned, "continuous", parent, child, pose)
            add_child(element, "axis", xyz=short_numbers(np.eye(3)[turn]))
            add_child(element, "dynamics", damping=short_numbers([linear_term(m.dof_damping[m.jnt_dofadr[joint]])]))
            self.notes.append(f"ball joint '{name}' is three hinges")
            return
        hinge = m.jnt_type[joint] == self.mj.mjtJoint.mjJNT_HINGE
        dof, at = m.jnt_dofadr[joint], m.jnt_qposadr[joint]
        span = m.jnt_range[joint] * (
            math.pi / 180.0 if hinge and self.spec.compiler.degree and not m.jnt_limited[joint] else 1.0
        )
        unbound = not m.jnt_limited[joint] and 0.0 < span[1] - span[0] < (WHOLE_TURN_RAD if hinge else math.inf)
        if unbound:
            self.notes.append(f"joint '{name}' is not limited to the range that it states: that is taken all the same")
        limited = bool(m.jnt_limited[joint]) or unbound
        kind = ("revolute" if limited else "continuous") if hinge else "prismatic"
        element = add_joint(robot, name, kind, parent, child, pose)
        add_child(element, "axis", xyz=short_numbers(m.jnt_axis[joint]))
        zero = float(m.qpos0[at])
        if limited:
            lower, upper = (float(value) - zero for value in span)
            add_child(element, "limit", lower=short_numbers([lower]), upper=short_numbers([upper]))
        dynamics = {"damping": linear_term(m.dof_damping[dof]), "friction": float(m.dof_frictionloss[dof]),
                    "spring_stiffness": linear_term(m.jnt_stiffness[joint]),
                    "spring_reference": float(m.qpos_spring[at]) - zero}  # fmt: skip
        if (armature := float(m.dof_armature[dof])) > 0.0:
            dynamics["armature"] = armature
        if m.nkey:
            dynamics["start"] = float(m.key_qpos[self.key()][at]) - zero
        add_child(element, "dynamics", **{key: short_numbers([value]) for key, value in dynamics.items()})


def linear_term(value: object) -> float:
    """The number, or the linear term of a polynomial."""
    return float(np.ravel(np.asarray(value, dtype=float))[0])


FORMAT = Format(
    "MJCF", ".xml", 3, urdf_of_mjcf, preferred="model.xml", recognises=is_mjcf, of_several=models_of,
    not_models=("package.xml", "manifest.xml", "stack.xml"), further=(".mjcf",),
)  # fmt: skip
"""The other names are those of ROS packages' files."""
