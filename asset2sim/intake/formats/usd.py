"""USD (UsdPhysics) to URDF: rigid bodies become links, joints the tree between them, and their shapes are written anew.

A link's axes are its body's, its origin is the joint that turns it; the root's axes are the world's, with z up.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

import numpy as np
from lxml import etree
from lxml.etree import _Element as Element

from asset2sim.assets.urdf.base import unused
from asset2sim.assets.urdf.edit import short_numbers
from asset2sim.assets.urdf.references import ANYWHERE, AllowedFolders
from asset2sim.intake.formats.format import (
    Converted,
    Format,
    add_child,
    add_contact,
    add_inertial,
    add_joint,
    add_origin,
    outermost_files,
    settle_free,
    world_name,
    write_obj,
)
from asset2sim.intake.formats.tree_loops import Closing, close_loops, spanning
from asset2sim.intake.formats.usd_joints import Step, UsdJoint, one_after_another, pass_each_other, read_joints
from asset2sim.intake.formats.usd_mass import WeighedForm, mass_of
from asset2sim.intake.formats.usd_places import as_it_stands
from asset2sim.intake.formats.usd_shapes import (
    BOUNDS,
    SHAPES,
    Form,
    bounds,
    collision,
    is_shown,
    painted,
    picture_file,
    read_form,
)
from asset2sim.intake.formats.usd_stage import SUFFIXES, UsdStage, opened
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import apply

if TYPE_CHECKING:
    from pxr import Usd

WORLD = ""
"""Path that stands for the world in joints, and names of the link for what stands still in it: the first that no body
has."""


def urdf_of_usd(file: Path, work: Path, reach: AllowedFolders = ANYWHERE) -> Converted:
    """The URDF of the one object on a USD stage; its meshes are written into ``work``. Raises AssetError
    (unreadable_asset) for what cannot be read, lies outside ``reach``, or no URDF can say."""
    with opened(file, reach) as stage:
        return _Object(stage, work, reach).converted()


class _Object:
    """One stage being converted. Bodies and joints go by their paths."""

    def __init__(self, stage: UsdStage, work: Path, reach: AllowedFolders) -> None:
        from pxr import Usd, UsdGeom, UsdPhysics

        self.stage, self.work, self.reach = stage, work, reach
        default, everything = stage.stage.GetDefaultPrim(), stage.stage.GetPseudoRoot()
        self.bodies: dict[str, Usd.Prim] = {}
        self.shapes: dict[str, list[Usd.Prim]] = {WORLD: []}
        grounds = set[Usd.Prim]()
        """What holds an endless plane, and with it the sheet that is drawn in its place."""
        for top in (default, everything) if default else (everything,):
            for prim in stage.prims(top):
                if prim.HasAPI(UsdPhysics.RigidBodyAPI) and self.body_of(prim) == prim:
                    self.bodies[str(prim.GetPath())] = prim
                if prim.GetTypeName() in SHAPES:
                    body = self.body_of(prim)
                    self.shapes.setdefault(WORLD if body is None else str(body.GetPath()), []).append(prim)
                elif prim.IsA(UsdGeom.Gprim):
                    stage.notes.append(f"{prim.GetPath()} is left out: a URDF has no {prim.GetTypeName()}")
                    if prim.IsA(UsdGeom.Plane) and prim.GetParent() != top:
                        grounds.add(prim.GetParent())
            if self.bodies or self.shapes[WORLD]:
                break
        self.shapes[WORLD] = [prim for prim in self.shapes[WORLD] if prim.GetParent() not in grounds]
        read = (joint for joint in read_joints(stage, self.body_of) if {*joint.bodies} - {WORLD} <= self.bodies.keys())
        joints = (as_it_stands(stage, joint, self.bodies) for joint in one_after_another(list(read)))
        self.joints = sorted(joints, key=lambda joint: joint.spare)
        self.names = unique_names(self.bodies)
        self.names[WORLD] = world_name(set(self.names.values()))
        self.taken = set(self.names.values())
        for joint in self.joints:
            body, _, number = joint.bodies[1].rpartition("/")
            if joint.bodies[1] not in self.names:
                self.names[joint.bodies[1]] = unused(f"{self.names[body]}_{number}", self.taken)
        self.joint_names = unique_names({joint.path: stage.stage.GetPrimAtPath(joint.path) for joint in self.joints})
        self.taken_joints = set(self.joint_names.values())
        self.free: list[str] = []
        """Bodies that nothing holds, of several objects."""
        self.closing: list[UsdJoint] = []
        """Joints that would close a loop of the tree."""
        self.in_body: dict[str, Array] = {}
        """Body → its link's (4, 4) frame in it."""

    def body_of(self, prim: "Usd.Prim") -> "Usd.Prim | None":
        """The rigid body of which a prim is a part; None for what stands still in the world."""
        from pxr import UsdPhysics

        while prim and not prim.IsPseudoRoot():
            api = UsdPhysics.RigidBodyAPI(prim)
            if prim.HasAPI(UsdPhysics.RigidBodyAPI) and api.GetRigidBodyEnabledAttr().Get(self.stage.time) is not False:
                return prim
            prim = prim.GetParent()
        return None

    def converted(self) -> Converted:
        """The object as a URDF."""
        stage = self.stage
        top = stage.stage.GetDefaultPrim()
        robot = etree.Element("robot", name=str(top.GetDisplayName() or top.GetName()) if top else stage.file.stem)
        if not self.bodies:
            if not self.shapes[WORLD]:
                raise stage.refused("usd_empty", "it has no rigid body and no geometry: is it a part of another file?")
            stage.notes.append("it states no physics: it is one rigid link")
        root, tree = self.tree()
        world, free = self.names[WORLD] if root == WORLD else "", tuple(self.names[path] for path in self.free)
        self.in_body[root] = np.eye(4)
        if root != WORLD:
            self.in_body[root][:3, :3] = stage.rigid(self.bodies[root])[:3, :3].T
        self.add_link(robot, root)
        for joint, turned in tree:
            self.add_chain(robot, joint, turned)
        self.add_mimics(robot, [joint for joint, _ in tree])
        stage.notes += close_loops(robot, [self.loop(joint) for joint in self.closing])
        for one, other in pass_each_other(self.bodies):
            add_child(robot, "disable_collisions", link1=self.names[one], link2=self.names[other], reason="Never")
        stage.notes += settle_free(robot, world, free) if world else ()
        notes = tuple(dict.fromkeys(stage.notes))
        on_world = any(WORLD in joint.bodies and joint.steps[0].kind == "fixed" for joint in self.joints)
        still = root != WORLD and (on_world or self.is_still(root))
        held = "its file joins it to the world" if on_world else "its file has a program alone move its root"
        if root == WORLD:
            still, held = bool(self.shapes[WORLD]) and not free, "its file has shapes in the world itself"
        held = held if still else ""
        return Converted(robot, stage.layers, notes, metric=stage.states_metres, world=world, free=free, held=held)

    def tree(self) -> tuple[str, list[tuple[UsdJoint, bool]]]:
        """The root, and the joints from it on, parents first, each with whether it is turned round: its second body is
        the parent. Those that are spare are the first of which a loop is left open."""
        stage, still = self.stage, bool(self.shapes[WORLD])
        held = [joint for joint in self.joints if WORLD in joint.bodies]
        between = {end for joint in self.joints for end in joint.bodies} - self.bodies.keys() - {WORLD}
        firsts, seconds = ({joint.bodies[side] for joint in self.joints} for side in (0, 1))
        order = sorted(self.bodies, key=lambda path: (*self.order(path), path in seconds, path not in firsts))
        first = [WORLD] if held or not self.bodies else []
        tree = spanning([*first, *order, *sorted(between)], [joint.bodies for joint in self.joints])
        self.closing = [self.joints[number] for number in tree.loops]
        root, found = tree.roots[0], [(self.joints[number], turned) for number, turned in tree.ways]
        if len(tree.roots) > 1:
            found = [(self.stands(path), False) for path in tree.roots if path != WORLD] + found
            root = WORLD
        elif root == WORLD and self.bodies and not still and len(held) == 1 and held[0].steps[0].kind == "fixed":
            root = next(body for body in held[0].bodies if body != WORLD)
            found = found[1:]
            stage.notes.append(f"link '{self.names[root]}' is fixed to the world")
        if root != WORLD and still:
            names = ", ".join(str(prim.GetPath()) for prim in self.shapes[WORLD][:5])
            stage.notes.append(f"what stands beside the object is left out: {names}")
        return root, found

    def order(self, path: str) -> tuple[bool, bool]:
        """Key by which the root of a tree is the least of its bodies: what is held still, else the articulation's own
        root."""
        from pxr import UsdPhysics

        return not self.is_still(path), not self.bodies[path].HasAPI(UsdPhysics.ArticulationRootAPI)

    def is_still(self, path: str) -> bool:
        """Whether a body is moved by nothing but a program."""
        from pxr import UsdPhysics

        return UsdPhysics.RigidBodyAPI(self.bodies[path]).GetKinematicEnabledAttr().Get(self.stage.time) is True

    def stands(self, path: str) -> UsdJoint:
        """A joint that fixes a body to the world where it stands, as one object of several."""
        if not self.is_still(path):
            self.free.append(path)
        at = f"{path}/stands"
        self.joint_names[at] = f"{self.names[path]}_stands"
        step = Step("fixed", np.array([1.0, 0.0, 0.0]), {}, {})
        frames = self.stage.rigid(self.bodies[path]), np.eye(4)
        return UsdJoint(self.joint_names[at], at, (WORLD, path), frames, frames, (step,), None, False)

    def add_chain(self, robot: Element, joint: UsdJoint, turned: bool) -> None:
        """The link that a joint moves, and the joint, or one after the other its degrees of freedom."""
        parent, child = joint.bodies[::-1] if turned else joint.bodies
        in_parent, in_child = joint.frames[::-1] if turned else joint.frames
        steps = joint.steps[::-1] if turned else joint.steps
        here = np.eye(4)
        if any(step.kind in ("revolute", "continuous") for step in steps):
            here[:3, 3] = in_child[:3, 3]
        self.in_body[child] = here
        to_child = np.linalg.inv(in_child) @ here
        pose = np.linalg.inv(self.in_body[parent]) @ in_parent @ to_child
        above = self.names[parent]
        for number, step in enumerate(steps):
            last = number == len(steps) - 1
            below = self.names[child] if last else unused(f"{self.names[child]}_{number + 1}", self.taken)
            name = self.joint_names[joint.path]
            name = name if last else unused(f"{name}_{number + 1}", self.taken_joints)
            if last:
                self.add_link(robot, child)
            else:
                add_child(robot, "link", name=below)
            element = add_joint(robot, name, step.kind, above, below, pose)
            add_step(element, step, to_child[:3, :3].T @ step.axis * (-1.0 if turned else 1.0))
            above, pose = below, np.eye(4)

    def loop(self, joint: UsdJoint) -> Closing:
        """A joint that would close a loop of the tree."""
        pose = np.linalg.inv(self.in_body.get(joint.bodies[0], np.eye(4))) @ joint.frames[0]
        kind, axis = (joint.steps[0].kind, joint.steps[0].axis) if len(joint.steps) == 1 else ("", np.zeros(3))
        first, second = (self.names[body] for body in joint.bodies)
        return Closing(joint.path, kind, (first, second), pose, axis)

    def add_link(self, robot: Element, body: str) -> None:
        """A body's link with its mass, visuals and collisions; nothing of one between joints that follow each other."""
        link = add_child(robot, "link", name=self.names[body])
        if body not in (*self.bodies, WORLD):
            return
        to_link: Array = np.asarray(np.linalg.inv(self.in_body[body]), dtype=float)
        frame = np.eye(4) if body == WORLD else self.stage.rigid(self.bodies[body])
        weighed, unweighed = list[WeighedForm](), list[Form]()
        for prim in self.shapes.get(body, ()):
            to_body = np.linalg.inv(frame) @ self.stage.world(prim)
            shown, api = is_shown(self.stage, prim), collision(self.stage, prim)
            form = read_form(self.stage, prim, to_body) if shown or api is not None else None
            if form is None:
                continue
            if shown:
                self.add_visuals(link, prim, form, to_link)
            if api is not None:
                kind = str(api.GetAttribute("physics:approximation").Get() or "")
                form = bounds(form, to_body, kind) if kind in BOUNDS else form
                weighed.append(WeighedForm.of(self.stage, prim, form))
                self.add_shape(link, "collision", str(prim.GetPath()), form, to_link)
            elif shown:
                unweighed.append(form)
        if body != WORLD:
            found = mass_of(self.stage, self.bodies[body], weighed, unweighed)
            if found is not None:
                mass, pose, inertia = found
                add_inertial(link, mass, to_link @ pose, inertia)
        friction = [item.friction for item in weighed if item.friction > 0.0]
        bounce = max((item.restitution for item in weighed), default=0.0)
        add_contact(link, friction, bounce or None)

    def add_visuals(self, link: Element, prim: "Usd.Prim", form: Form, to_link: Array) -> None:
        """A piece of geometry as visuals, one for each of its paints."""
        for index, (piece, paint) in enumerate(painted(self.stage, prim, form)):
            item = self.add_shape(link, "visual", f"{prim.GetPath()}_{index}", piece, to_link)
            if paint is not None:
                material = add_child(item, "material", name=f"{link.get('name')}_{len(link)}")
                add_child(material, "color", rgba=short_numbers(paint.color))
                if picture := picture_file(paint.picture, self.work, self.reach):
                    add_child(material, "texture", filename=picture)

    def add_shape(self, link: Element, role: str, name: str, form: Form, to_link: Array) -> Element:
        """A visual or collision; a mesh is written in its link's frame, under the path of its prim."""
        element = add_child(link, role)
        if form.kind == "mesh":
            file = write_obj(self.work, f"{role}{name}", apply(to_link, form.vertices), form.faces, form.uv)
            add_child(add_child(element, "geometry"), "mesh", filename=file)
        else:
            add_origin(element, to_link @ form.pose)
            add_child(
                add_child(element, "geometry"),
                form.kind,
                **{key: short_numbers(value) for key, value in form.size.items()},
            )
        return element

    def add_mimics(self, robot: Element, joints: Sequence[UsdJoint]) -> None:
        """Joints that follow others, as mimics."""
        elements = {str(item.get("name")): item for item in robot.findall("joint")}
        single = {joint.path for joint in joints if len(joint.steps) == 1}
        for joint in joints:
            if joint.mimic is None:
                continue
            leader, multiplier, offset = joint.mimic
            if leader not in single:
                self.stage.notes.append(f"{joint.path} follows {leader}, which is no hinge or slider: it moves freely")
                continue
            add_child(elements[self.joint_names[joint.path]], "mimic", joint=self.joint_names[leader],
                multiplier=short_numbers([multiplier]), offset=short_numbers([offset]))  # fmt: skip


def add_step(element: Element, step: Step, axis: Array) -> None:
    """State the axis, limits and dynamics of one degree of freedom."""
    if step.kind == "fixed":
        return
    add_child(element, "axis", xyz=short_numbers(axis))
    for tag, numbers in (("limit", step.limit), ("dynamics", step.dynamics)):
        if numbers:
            add_child(element, tag, **{key: short_numbers([value]) for key, value in numbers.items()})


def unique_names(prims: Mapping[str, "Usd.Prim"]) -> dict[str, str]:
    """Path → the name that its prim shows, with the names above it where another has it."""
    found, used = dict[str, str](), set[str]()
    for path, prim in prims.items():
        parts = path.strip("/").split("/")
        longer = ("_".join(parts[-count:]) for count in range(2, len(parts) + 1))
        name = str(prim.GetDisplayName() or prim.GetName())
        found[path] = next(item for item in (name, *longer, path) if item not in used)
        used.add(found[path])
    return found


def whole(texts: Mapping[str, str]) -> list[str]:
    """The file that is named for its folder, or those of which no other is composed; binary files do not tell."""
    found = outermost_files(texts)
    return [file for file in found if PurePosixPath(file).stem == PurePosixPath(file).parent.name] or found


FORMAT = Format("USD", SUFFIXES[0], 4, urdf_of_usd, further=SUFFIXES[1:], of_several=whole)
