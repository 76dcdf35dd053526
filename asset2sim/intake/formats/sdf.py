"""SDF (Gazebo) to URDF: one model of links and joints. What a URDF cannot say is refused or named.

Written here since no package for it is kept on PyPI: ROS's converter, sdformat_urdf, is a C++ plugin.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from lxml import etree
from lxml.etree import _Element as Element

from asset2sim.assets.urdf.base import unused
from asset2sim.assets.urdf.document import parse_xml
from asset2sim.assets.urdf.edit import short_numbers
from asset2sim.assets.urdf.references import AllowedFolders
from asset2sim.intake.formats.format import (
    Converted,
    Format,
    add_child,
    add_contact,
    add_inertial,
    add_joint,
    add_origin,
    settle_free,
    stand_as_drawn,
    unconvertible_error,
    world_name,
    write_obj,
)
from asset2sim.intake.formats.mjcf_ties import Tie, tie
from asset2sim.intake.formats.sdf_includes import included, newest, version_of
from asset2sim.intake.formats.sdf_model import CLOSING, SdfModel
from asset2sim.intake.formats.sdf_nested import SEPARATOR, flatten, name_nameless
from asset2sim.intake.formats.sdf_shapes import SOLIDS, mass_of, solid_of
from asset2sim.intake.formats.sdf_tree import Gearbox, Hinge, as_tree, gear_ties, limits_in_axes
from asset2sim.intake.formats.tree_loops import Closing, close_loops
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import origin_transform

SHAPES = {"box": ("size",), "sphere": ("radius",), "cylinder": ("radius", "length"), "capsule": ("radius", "length")}
JOINTS = ("revolute", "continuous", "prismatic", "fixed", "screw", "revolute2", "universal", "ball")
TURNS = ("1 0 0", "0 1 0", "0 0 1")
"""Axes of the hinges that stand for a ball joint."""
NO_INERTIA = (0.0,) * 6
"""Says of a stated mass that its inertia is not stated."""
FLATTEN = "flatten it with `gz sdf -p FILE`, or keep a URDF of it"
MISSING = "its <include> '{}' is not there: keep that model's folder beside its own, or " + FLATTEN


def urdf_of_sdf(file: Path, work: Path, reach: AllowedFolders, expanded: Path | None = None) -> Converted:
    """The URDF of the one model in an SDF file, or of all models of its one world; ``expanded`` is what was made of the
    file where it is xacro. Raises AssetError (unreadable_asset) for what is no SDF, and for joints and nesting that a
    URDF does not have."""
    document, recovered = parse_xml(expanded or file, "SDF")
    files, missing = included(document, file, reach) if document.find("include") is not None else ([], [])
    models, worlds = document.findall("model"), document.findall("world")
    if missing and not models and not worlds:
        raise unconvertible_error(file, "sdf_nested", MISSING.format(", ".join(missing)))
    if not models and len(worlds) == 1:
        files, missing = included(worlds[0], file, reach)
        models = [model for model in worlds[0].findall("model") if is_object(model)]
        if missing and models:
            recovered = (*recovered, f"what it includes is left out ({', '.join(missing)}): {FLATTEN}")
        if missing and not models:
            raise unconvertible_error(file, "sdf_nested", MISSING.format(", ".join(missing)))
        if len(models) > 1:
            taken = set[str]()
            for model in models:
                model.set("name", unused(str(model.get("name")), taken))
            whole = etree.Element("model", name=str(worlds[0].get("name") or file.stem))
            whole.extend([*models, *worlds[0].findall("frame"), *worlds[0].findall("joint")])
            return replace(
                _SdfAsset(file, work, whole, version_of(document), recovered).converted(), files=tuple(files)
            )
    if document.tag != "sdf" or len(models) != 1:
        problem = f"an SDF file of one <model> is needed; it has {len(models)} in <{document.tag}>; {FLATTEN}"
        raise unconvertible_error(file, "sdf_models", problem)
    inner, missing = included(models[0], file, reach)
    if missing:
        raise unconvertible_error(file, "sdf_nested", MISSING.format(", ".join(missing)))
    made = _SdfAsset(file, work, models[0], version_of(document), recovered).converted()
    return replace(made, files=(*files, *inner))


def is_object(model: Element) -> bool:
    """Whether a model of a world is more than its ground."""
    shapes = {str(shape.tag) for geometry in model.iter("geometry") for shape in geometry.iterchildren(etree.Element)}
    return not shapes or bool(shapes - {"plane", "heightmap"})


class _SdfAsset(SdfModel):
    """One model being converted."""

    def __init__(self, file: Path, work: Path, model: Element, version: tuple[int, ...], notes: Sequence[str]) -> None:
        inner = model.findall("model")
        stated = [(str(item.get("name")), item.findtext("static") or "") for item in inner]
        self.still = tuple(f"{name}{SEPARATOR}" for name, static in stated if static.strip() in ("1", "true"))
        self.is_world = bool(inner) and not model.findall("link") and not model.findall("joint")
        name_nameless(model)
        flatten(model, version, file)
        as_tree(model)
        self.notes, self.work = [*notes, *limits_in_axes(model)], work
        super().__init__(file, model, version)
        self.is_still = self.text(model, "static") in ("1", "true")
        self.base = world_name(self.links)
        self.taken = {*self.links, self.base}
        self.joint_of = {
            self.text(item, "child"): item for item in model.findall("joint") if item.get("type") != "gearbox"
        }

    def converted(self) -> Converted:
        """The model as a URDF."""
        robot = etree.Element("robot", name=str(self.model.get("name") or self.file.stem))
        for name in self.links:
            self.add_link(robot, name)
        gears = [joint for joint in self.model.findall("joint") if joint.get("type") == "gearbox"]
        for joint in self.model.findall("joint"):
            if joint not in gears:
                self.add_joint(robot, joint)
        self.notes += [*tie(robot, list(self.ties(gears))), *close_loops(robot, list(self.closings()))]
        world, free = self.hung(robot)
        on_world = any(self.text(item, "parent") == "world" for item in self.joint_of.values())
        reason = "its file has a joint to the world" if on_world else "its file says that it is static"
        held = reason if (on_world or self.is_still) and not (self.is_world or free) else ""
        return Converted(robot, (), tuple(dict.fromkeys(self.notes)), world=world, free=free, held=held)

    def hung(self, robot: Element) -> tuple[str, tuple[str, ...]]:
        """Hang what stands in the world from a link for it, where there are several such: its name, and the links that
        are free."""
        children = {str(end.get("link")) for end in robot.iterfind("joint/child")}
        roots = [name for name in self.links if name not in children]
        if len(roots) == 1 and self.base not in children and robot.find(f"link[@name='{self.base}']") is None:
            stand_as_drawn(robot, roots[0], self.own_pose(self.model) @ self.frame(roots[0]))
            return "", ()
        if robot.find(f"link[@name='{self.base}']") is None:
            add_child(robot, "link", name=self.base)
        fixed = {name for name in roots if name in self.joint_of}  # by a joint to the world
        held = {name for name in roots if self.is_still or name in fixed or name.startswith(self.still)}
        for name in roots:
            add_joint(robot, f"{name}_stands", "fixed", self.base, name, self.frame(name))
        stand_as_drawn(robot, self.base, self.own_pose(self.model))
        free = tuple(name for name in roots if name not in held)
        self.notes += settle_free(robot, self.base, free)
        return self.base, free

    def frame(self, link: str) -> Array:
        """The pose of a URDF link's frame: that of the joint that moves it, else SDF's own."""
        joint = self.joint_of.get(link)
        held = joint is None or (self.text(joint, "parent") == "world" and joint.get("type") == "fixed")
        return self.pose(link) if held or joint is None else self.pose(str(joint.get("name")))

    def add_link(self, robot: Element, name: str) -> None:
        """A link with its inertial, visuals and collisions."""
        source, link = self.named[name], add_child(robot, "link", name=name)
        to_link = np.linalg.inv(self.frame(name)) @ self.pose(name)
        inertial = source.find("inertial")
        if inertial is not None and inertial.get("auto") in ("1", "true"):
            if weighed := mass_of(source.findall("collision"), inertial, self.numbers, self.own_pose):
                add_inertial(link, weighed[0], to_link @ origin_transform(weighed[1]), NO_INERTIA)
        elif inertial is not None and inertial.find("mass") is not None:
            # A mass alone is stated, too: zeros say that its inertia is not.
            least = "0" if inertial.find("inertia") is None else "1"
            defaults = {"ixx": least, "iyy": least, "izz": least}
            keys = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
            tensor = [self.numbers(inertial, f"inertia/{key}", defaults.get(key, "0"))[0] for key in keys]
            add_inertial(link, self.numbers(inertial, "mass", "1")[0], to_link @ self.own_pose(inertial), tensor)
        for role in ("visual", "collision"):
            for item in source.findall(role):
                self.add_shape(link, item, to_link @ self.own_pose(item))
        surfaces = source.findall("collision/surface")
        given = [item for item in surfaces if item.find("friction/ode/mu") is not None]
        bounces = [item for item in surfaces if item.find("bounce/restitution_coefficient") is not None]
        bounce = [self.numbers(item, "bounce/restitution_coefficient", "0")[0] for item in bounces]
        frictions = [self.numbers(item, "friction/ode/mu", "0")[0] for item in given]
        add_contact(link, frictions, max(bounce, default=None), default=math.inf)

    def add_shape(self, link: Element, item: Element, pose: Array) -> None:
        """A visual or collision; planes are left out, and so is what a URDF has no shape for."""
        found = item.find("geometry")
        shape = None if found is None else next((node for node in found if isinstance(node.tag, str)), None)
        if found is None or shape is None or shape.tag not in (*SHAPES, "mesh", *SOLIDS):
            if shape is not None and shape.tag != "empty":
                self.notes.append(f"link '{link.get('name')}': its <{shape.tag}> is left out")
            return
        element = add_child(link, str(item.tag), name=str(item.get("name") or ""))
        add_origin(element, pose)
        geometry = add_child(element, "geometry")
        if shape.tag == "mesh":
            if shape.find("submesh") is not None:
                self.notes.append(f"link '{link.get('name')}': its mesh is taken whole, not its <submesh>")
            scale = self.numbers(shape, "scale", "1 1 1")
            add_child(geometry, "mesh", filename=self.text(shape, "uri"), scale=short_numbers(scale))
        elif shape.tag in SOLIDS:
            name = f"{link.get('name')}_{item.tag}_{item.get('name')}"
            try:
                vertices, faces = solid_of(found.findall(str(shape.tag)), self.numbers)
            except ValueError as error:
                raise self.refused("sdf_shape", f"link '{link.get('name')}': <{shape.tag}> is {error}") from error
            add_child(geometry, "mesh", filename=write_obj(self.work, name, vertices, faces))
        else:
            values = {key: short_numbers(self.numbers(shape, key, "1")) for key in SHAPES[str(shape.tag)]}
            add_child(geometry, str(shape.tag), **values)
        color = self.text(item, "material/diffuse")
        if item.tag == "visual" and color:
            add_child(
                add_child(element, "material", name=f"{link.get('name')}_{item.get('name')}"), "color", rgba=color
            )

    def add_joint(self, robot: Element, joint: Element) -> None:
        """A joint, or the chain of hinges that stands for one of several axes. One that fixes a link to the world only
        makes that link the root."""
        name, kind = str(joint.get("name")), str(joint.get("type"))
        parent, child = self.text(joint, "parent"), self.text(joint, "child")
        if parent == "world" and kind == "fixed":
            self.notes.append(f"link '{child}' is fixed to the world")
            return
        self.check(name, kind, parent, child)
        above = np.eye(4) if parent == "world" else self.frame(parent)
        if parent == "world":
            parent = self.base
            if all(link.get("name") != parent for link in robot.findall("link")):
                add_child(robot, "link", name=parent)
        if kind == "screw":
            self.notes.append(f"screw '{name}' turns without its thread, which a URDF cannot say")
        steps, pose = self.axes(joint, kind), np.linalg.inv(above) @ self.pose(name)
        for number, axis in enumerate(steps):
            last = number == len(steps) - 1
            end = child if last else unused(f"{child}_{number + 1}", self.taken)
            if not last:
                add_child(robot, "link", name=end)
            simple = kind if kind in ("prismatic", "fixed") else "revolute"
            self.add_step(robot, name if last else f"{name}_{number + 1}", simple, axis, (parent, end), pose, name)
            parent, pose = end, np.eye(4)

    def closings(self) -> Iterator[Closing]:
        """The joints that would close loops of the tree."""
        for joint in self.model.findall(CLOSING):
            name, parent, child = str(joint.get("name")), self.text(joint, "parent"), self.text(joint, "child")
            pose, axis = self.pose(name), joint.find("axis")
            above = np.eye(4) if parent == "world" else self.frame(parent)
            direction = np.zeros(3) if axis is None else self.axis_in_joint(axis, pose)
            ends = self.base if parent == "world" else parent, child
            yield Closing(name, str(joint.get("type")), ends, np.linalg.inv(above) @ pose, direction)

    def ties(self, gears: Sequence[Element]) -> Iterator[Tie]:
        """The ties of hinges that gearboxes are, with a note on each that ties none."""
        boxes = [
            Gearbox(str(gear.get("name")), self.text(gear, "parent"), self.text(gear, "child"),
                    self.text(gear, "gearbox_reference_body"), self.numbers(gear, "gearbox_ratio", "1")[0],
                    (self.turn_axis(gear, "axis"), self.turn_axis(gear, "axis2")))
            for gear in gears
        ]  # fmt: skip
        hinges = [
            Hinge(str(item.get("name")), self.text(item, "parent"), self.text(item, "child"), self.turn_axis(item))
            for item in self.model.findall("joint") if item.get("type") in ("revolute", "continuous")
        ]  # fmt: skip
        for found in gear_ties(boxes, hinges):
            if isinstance(found, Tie):
                yield found
            else:
                self.notes.append(found)

    def check(self, name: str, kind: str, parent: str, child: str) -> None:
        """Refuse a joint of another kind, and one between links that are not there."""
        if kind not in JOINTS:
            raise self.refused("sdf_joint", f"joint '{name}' is {kind}; read are {', '.join(JOINTS)} and gearbox")
        for role, link in (("parent", parent), ("child", child)):
            if link not in (*self.links, "world"):
                raise self.refused("sdf_joint", f"joint '{name}': its {role} '{link}' is not a link of the model")

    def axes(self, joint: Element, kind: str) -> list[Element | None]:
        """The axes about which a joint turns or slides, the outermost first, without those whose limits lock them."""
        if kind == "ball":
            return [etree.fromstring(f"<axis><xyz>{turn}</xyz></axis>") for turn in TURNS]
        if kind not in ("revolute2", "universal"):
            return [joint.find("axis")]
        stated = [axis for axis in (joint.find("axis"), joint.find("axis2")) if axis is not None]
        free = [axis for axis in stated if (limit := self.limit(axis)).get("lower", "") != limit.get("upper", "-")]
        return [*(free or stated[-1:])] or [None]

    def add_step(
        self, robot: Element, name: str, kind: str, axis: Element | None, ends: tuple[str, str], pose: Array, of: str
    ) -> None:
        """One joint of a URDF between two links; ``pose`` is its own in the parent link, ``of`` the SDF's joint."""
        limit = {} if axis is None else self.limit(axis)
        kind = "continuous" if kind == "revolute" and "lower" not in limit else kind
        element = add_joint(robot, name, kind, *ends, pose)
        if axis is not None and kind != "fixed":
            add_child(element, "axis", xyz=short_numbers(self.axis_in_joint(axis, self.pose(of))))
            self.add_terms(element, axis, limit)

    def add_terms(self, element: Element, axis: Element, limit: dict[str, str]) -> None:
        """A joint's limits, dynamics and mimic."""
        if limit:
            add_child(element, "limit", **limit)
        keys = ("damping", "friction", "spring_stiffness", "spring_reference")
        stated = [key for key in keys if axis.find(f"dynamics/{key}") is not None]
        terms = {key: short_numbers(self.numbers(axis, f"dynamics/{key}", "0")) for key in stated}
        if axis.find("initial_position") is not None:
            terms["start"] = short_numbers(self.numbers(axis, "initial_position", "0"))
        if terms:
            add_child(element, "dynamics", **terms)
        mimic = axis.find("mimic")
        if mimic is not None:
            ratio = self.numbers(mimic, "multiplier", "1")[0]
            offset = self.numbers(mimic, "offset", "0")[0] - ratio * self.numbers(mimic, "reference", "0")[0]
            add_child(
                element,
                "mimic",
                joint=str(mimic.get("joint")),
                multiplier=short_numbers([ratio]),
                offset=short_numbers([offset]),
            )


FORMAT = Format("SDF", ".sdf", 2, urdf_of_sdf, preferred="model.sdf", of_several=newest, further=(".world",))
"""The name of Gazebo's files is preferred."""
