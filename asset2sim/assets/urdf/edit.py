"""Editing a URDF: scale, inertials, joints, mesh references. Everything else of the document stays as it was."""

import copy
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from lxml import etree
from lxml.etree import _Element as Element
from scipy.spatial.transform import Rotation

from asset2sim.assets.meshes.cylinder import Cylinder
from asset2sim.assets.urdf.capsule import split_capsules
from asset2sim.assets.urdf.document import read_document, textures_of
from asset2sim.assets.urdf.numbers import BIAS
from asset2sim.physics.felt import effort_limit, plain_spring
from asset2sim.physics.kinematics import locked_joint, rpy_of
from schemas.features import Features, JointFeatures
from schemas.overlay import JointPhysics, LinkPhysics, PhysicsOverlay
from schemas.settings import PhysicsSettings
from schemas.vocabulary import CollisionMode

POSITIONS = (
    ("safety_controller", "soft_lower_limit"), ("safety_controller", "soft_upper_limit"),
    ("calibration", "rising"), ("calibration", "falling"),
)  # fmt: skip
"""Attributes beside the limits that are positions of their joint."""


def refined_urdf(
    source: Path,
    features: Features,
    overlay: PhysicsOverlay,
    mesh_places: Mapping[str, str],
    collision_files: Mapping[str, Sequence[str | Cylinder]],
    settings: PhysicsSettings,
    mode: CollisionMode = CollisionMode.REPAIR,
    *,
    cut_primitives: bool = False,
) -> bytes:
    """The refined URDF as UTF-8 XML.

    ``mesh_places`` maps each mesh reference to its path beside the new file; references without one are dropped, having
    been found missing. ``collision_files`` holds each link's hulls, at the final scale in the link's frame; they
    replace its collision meshes, while collision primitives stay and are scaled. Where ``mode`` is ``keep``, collision
    geometry stays as authored, its meshes re-pointed and scaled as the visual ones are, and no hull is added. With
    ``cut_primitives`` hulls replace boxes and cylinders, too.
    URDF has no field for initial positions: a comment lists them (``overlay.json`` holds them too).
    """
    robot = read_document(source).robot
    links = {link.name: link for link in overlay.links}
    joints = {joint.name: joint for joint in overlay.all_joints}
    keep = mode is CollisionMode.KEEP
    for link in robot.findall("link"):
        if link.find("collision") is None and not keep:
            add_primitive_collisions(link)
        if cut_primitives:
            drop_boxes_and_cylinders(link)
        split_capsules(link)
        edit_geometry(link, overlay.scale, mesh_places, keep)
        if not keep:
            write_collision(link, collision_files.get(str(link.get("name")), ()))
        write_inertial(link, links[str(link.get("name"))])
        write_contact(link, overlay.contact_friction, overlay.rolling_friction_m)
    for element in robot.findall("joint"):
        authored = features.joint(str(element.get("name")))
        scale_origin(element, overlay.scale)
        scale_positions(element, features, overlay.scale)
        drop_zero_axis(element)
        if authored.name in joints:
            write_joint(element, authored, joints[authored.name], settings)
        elif authored.movable:
            lock_joint(element, authored, overlay.scale)
    edit_textures(robot, mesh_places)
    robot.extend([etree.Element("disable_collisions", link1=a, link2=b, reason="Default") for a, b in overlay.passing])
    if any(overlay.turned_rad):
        turn_root(robot, features.root, Rotation.from_rotvec(overlay.turned_rad))
    for node in [item for item in robot.iterchildren(etree.Comment) if (item.text or "").startswith(" asset2sim")]:
        robot.remove(node)
    robot.insert(0, state_comment(overlay))
    return serialised(robot)


def turn_root(robot: Element, root: str, turn: Rotation) -> None:
    """Turn the whole object about its root's origin: all that is fixed to the root link, and the joints on it."""
    own = next(link for link in robot.findall("link") if link.get("name") == root)
    placed = [item for tag in ("visual", "collision", "inertial") for item in own.findall(tag)]
    for joint in robot.findall("joint"):
        parent = joint.find("parent")
        if parent is not None and parent.get("link") == root:
            placed.append(joint)
    for element in placed:
        origin = element.find("origin")
        if origin is None:
            origin = etree.Element("origin")
            element.insert(0, origin)
        place = [float(word) for word in str(origin.get("xyz", "0 0 0")).split()]
        angles = [float(word) for word in str(origin.get("rpy", "0 0 0")).split()]
        origin.set("xyz", short_numbers(turn.apply(place)))
        origin.set("rpy", short_numbers(rpy_of((turn * Rotation.from_euler("xyz", angles)).as_matrix())))


def edit_textures(robot: Element, places: Mapping[str, str]) -> None:
    """Point the materials' textures at new files; missing ones go."""
    for texture in textures_of(robot):
        place = places.get(str(texture.get("filename")))
        parent = texture.getparent()
        if place is not None:
            texture.set("filename", place)
        elif parent is not None:
            parent.remove(texture)


def edit_geometry(link: Element, scale: float, mesh_places: Mapping[str, str], keep_collision: bool = False) -> None:
    """Scale a link's shapes and point its meshes at new files; missing ones go, as do collision meshes unless kept."""
    for item in [*link.findall("visual"), *link.findall("collision")]:
        mesh = item.find("geometry/mesh")
        if mesh is not None and item.tag == "collision" and not keep_collision:
            link.remove(item)
            continue
        if mesh is not None:
            place = mesh_places.get(str(mesh.get("filename")))
            if place is None:
                link.remove(item)
                continue
            mesh.set("filename", place)
            authored = [float(word) for word in str(mesh.get("scale", "1 1 1")).split()]
            mesh.set("scale", short_numbers([value * scale for value in (authored * 3)[:3]]))
        scale_origin(item, scale)
        for tag, keys in (("box", ("size",)), ("cylinder", ("radius", "length")), ("sphere", ("radius",))):
            shape = item.find(f"geometry/{tag}")
            if shape is not None:
                for key in keys:
                    shape.set(key, short_numbers([float(word) * scale for word in str(shape.get(key)).split()]))


def add_primitive_collisions(link: Element) -> None:
    """Copy the primitives among a link's visuals as its collision shapes; its meshes get hulls."""
    for visual in link.findall("visual"):
        geometry = visual.find("geometry")
        if geometry is not None and geometry.find("mesh") is None:
            collision = etree.SubElement(link, "collision")
            collision.extend([copy.deepcopy(node) for node in visual if node.tag in ("origin", "geometry")])


def drop_boxes_and_cylinders(link: Element) -> None:
    """Remove a link's collision shapes that hulls stand for (``primitive_hulls``)."""
    for item in link.findall("collision"):
        if item.find("geometry/box") is not None or item.find("geometry/cylinder") is not None:
            link.remove(item)


def write_collision(link: Element, shapes: Sequence[str | Cylinder]) -> None:
    """Add a link's hulls, by their files, and its cylinders as collision elements."""
    for shape in shapes:
        collision = etree.SubElement(link, "collision")
        if isinstance(shape, Cylinder):
            x, y, z = shape.axis
            turned = (0.0, math.atan2(math.hypot(x, y), z), math.atan2(y, x))  # z comes to lie on the axis
            place = {"xyz": short_numbers(shape.middle), "rpy": short_numbers(turned)}
            etree.SubElement(collision, "origin", place)
        geometry = etree.SubElement(collision, "geometry")
        if isinstance(shape, Cylinder):
            size = {"radius": short_number(shape.radius), "length": short_number(shape.length)}
            etree.SubElement(geometry, "cylinder", size)
        else:
            etree.SubElement(geometry, "mesh", filename=shape)


def scale_origin(element: Element, scale: float) -> None:
    """Multiply the translation of an element's origin."""
    origin = element.find("origin")
    if origin is not None and origin.get("xyz") is not None:
        origin.set("xyz", short_numbers([float(word) * scale for word in str(origin.get("xyz")).split()]))


def scale_positions(element: Element, features: Features, scale: float) -> None:
    """Scale a joint's other positions: a slider's mimic offset, safety limits and calibration, and the
    multiplier between a slider and a hinge."""
    own = features.joint(str(element.get("name")))
    factor = scale if own.prismatic else 1.0
    mimic = element.find("mimic")
    if mimic is not None:
        leader = next((joint for joint in features.joints if joint.name == mimic.get("joint")), own)
        ratio = factor / (scale if leader.prismatic else 1.0)
        scale_attribute(mimic, "offset", factor)
        scale_attribute(mimic, "multiplier", ratio, "1")
    for tag, key in POSITIONS:
        stated = element.find(tag)
        if stated is not None:
            scale_attribute(stated, key, factor)


def scale_attribute(element: Element, key: str, factor: float, default: str | None = None) -> None:
    """Multiply an attribute by ``factor``; an absent one is ``default``, and left out where that is None."""
    text = element.get(key, default)
    if text is not None and factor != 1.0:
        element.set(key, short_number(float(text) * factor))


def write_inertial(link: Element, physics: LinkPhysics) -> None:
    """Replace a link's inertial: mass, centre of mass and inertia about it, in the link's axes."""
    for old in link.findall("inertial"):
        link.remove(old)
    inertial = etree.Element("inertial")
    etree.SubElement(inertial, "origin", xyz=short_numbers(physics.com), rpy="0 0 0")
    etree.SubElement(inertial, "mass", value=short_number(physics.mass_kg))
    names = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    etree.SubElement(
        inertial, "inertia", {name: short_number(v) for name, v in zip(names, physics.inertia, strict=True)}
    )
    link.insert(0, inertial)


def write_contact(link: Element, friction: float, rolling_friction_m: float) -> None:
    """State the rolling resistance of a link's contacts (m) in the element that Bullet reads, nothing where it is 0;
    where the file states a coefficient there it becomes the object's, without bouncing."""
    stated = link.find("contact")
    if stated is not None:
        ensure_child(stated, "lateral_friction").set("value", short_number(friction))
        for old in stated.findall("restitution"):
            stated.remove(old)
    if rolling_friction_m > 0.0:
        ensure_child(ensure_child(link, "contact"), "rolling_friction").set("value", short_number(rolling_friction_m))


def write_joint(element: Element, authored: JointFeatures, physics: JointPhysics, settings: PhysicsSettings) -> None:
    """Write one movable joint's type, axis, limits and dynamics. Stiffness goes into ``spring_stiffness`` and
    ``spring_reference``, the names that SDF uses: URDF has no field for them, and its readers ignore the attributes.
    They are such that they may be applied as they are; a spring that only an armature bears is in ``geared_stiffness``
    and ``geared_reference`` beside ``armature``, what a mechanism exerts in ``bias_slope`` and its like. Our adapters
    read those; ``overlay.json`` has them too."""
    element.set("type", physics.type)
    ensure_child(element, "axis").set("xyz", short_numbers(authored.axis))
    limit = ensure_child(element, "limit")
    for key, value in (("lower", physics.lower), ("upper", physics.upper)):
        limit.attrib.pop(key, "")
        if value is not None:
            limit.set(key, short_number(value))
    limit.set("effort", short_number(effort_limit(authored.effort, physics, settings)))
    limit.set("velocity", short_number(authored.velocity if authored.velocity else settings.default_velocity))
    dynamics = ensure_child(element, "dynamics")
    dynamics.set("damping", short_number(physics.damping))
    dynamics.set("friction", short_number(physics.friction))
    dynamics.attrib.pop("start", "")
    stiffness, reference = plain_spring(physics, settings)
    dynamics.set("spring_stiffness", short_number(stiffness))
    dynamics.set("spring_reference", short_number(reference))
    for key in BIAS:
        dynamics.attrib.pop(key, "")
        if physics.bias is not None:
            dynamics.set(key, short_number(getattr(physics.bias, key.removeprefix("bias_"))))
    geared = {"armature": physics.armature, "geared_stiffness": physics.stiffness}
    for key, value in (geared | {"geared_reference": physics.spring_reference}).items():
        dynamics.attrib.pop(key, "")
        if physics.armature > 0.0:
            dynamics.set(key, short_number(value))


def lock_joint(element: Element, authored: JointFeatures, scale: float) -> None:
    """Write a joint without a range as fixed where its limits hold it."""
    held = locked_joint(authored)
    origin = ensure_child(element, "origin")
    origin.set("xyz", short_numbers([scale * value for value in held.origin_xyz]))
    origin.set("rpy", short_numbers(held.origin_rpy))
    element.set("type", "fixed")
    for tag in ("axis", "limit", "dynamics", "mimic"):
        for old in element.findall(tag):
            element.remove(old)


def drop_zero_axis(element: Element) -> None:
    """Take the axis from a fixed joint that states one without length: readers that divide by it place NaNs."""
    axis = element.find("axis") if element.get("type") == "fixed" else None
    if axis is not None and not any(float(word) for word in str(axis.get("xyz", "1 0 0")).split()):
        element.remove(axis)


def state_comment(overlay: PhysicsOverlay) -> "etree._Comment":
    """The comment that names scale and initial joint positions; units are radians and metres."""
    lines = [f"{joint.name} = {joint.initial_position:.6g}" for joint in overlay.all_joints]
    # A comment may not contain two hyphens; names that do are still in overlay.json.
    state = "; ".join(lines).replace("--", "- -") or "none"
    return etree.Comment(f" asset2sim: scale {overlay.scale:.6g}; initial joint positions (rad, m): {state} ")


def ensure_child(element: Element, tag: str) -> Element:
    """The element's child of that tag, made if there is none."""
    found = element.find(tag)
    return etree.SubElement(element, tag) if found is None else found


def serialised(robot: Element) -> bytes:
    """The document as indented UTF-8 XML."""
    etree.indent(robot, space="  ")
    return bytes(etree.tostring(robot, xml_declaration=True, encoding="utf-8", pretty_print=True))


def short_number(value: float) -> str:
    """One number with the digits that a float holds, short where it can be."""
    return f"{float(value):.9g}"


def short_numbers(values: "list[float] | tuple[float, ...] | np.ndarray") -> str:
    """Several numbers, separated by spaces."""
    return " ".join(short_number(value) for value in values)
