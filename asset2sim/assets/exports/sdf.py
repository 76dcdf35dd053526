"""SDF export beside the URDF: a model folder as Gazebo takes it (``model.config``, ``model.sdf``).

SDF has no start state for joints: the joints' zero is the initial state, as in a baked URDF, and limits, springs and
couplings are measured from it. Of a spring that only an armature bears, and of what a mechanism exerts, SDF has no
word; what a spring may bear without is written. Gazebo has contacts within a model or none: none where links pass
through each other.
"""

from collections.abc import Iterable
from pathlib import Path

from lxml import etree
from lxml.etree import _Element as Element

from asset2sim.assets.exports.refined_object import SDF_CONFIG_NAME, SDF_NAME, read_object
from asset2sim.assets.folder import URDF_NAME
from asset2sim.assets.urdf.bake import bake
from asset2sim.assets.urdf.edit import ensure_child, short_numbers
from schemas.overlay import PhysicsOverlay

VERSION, VERSION_WITH_MIMIC = "1.9", "1.11"
"""Versions of SDF that are written: that of Gazebo Fortress and later, and from Harmonic on where a joint follows."""


def export_sdf(folder: Path, overlay: PhysicsOverlay) -> Path:
    """Write ``model.sdf`` and ``model.config`` into a refined folder; the path of the former. The model stands on
    z = 0; one that is fixed is held by a joint to the world. Raises what ``read_object`` raises."""
    item = read_object(folder, overlay)
    baked, _ = bake((folder / URDF_NAME).read_bytes(), item.initial)
    robot = etree.fromstring(baked)
    follows = any(joint.find("mimic") is not None for joint in robot.findall("joint"))
    root = etree.Element("sdf", version=VERSION_WITH_MIMIC if follows else VERSION)
    model = etree.SubElement(root, "model", name=overlay.asset_id, canonical_link=item.root)
    add_text(model, "pose", short_numbers((0.0, 0.0, item.height_to_stand(item.initial), 0.0, 0.0, 0.0)))
    add_text(model, "self_collide", "false" if item.passing else "true")
    if item.fixed:
        held = etree.SubElement(model, "joint", name="world_fixed", type="fixed")
        add_text(held, "parent", "world")
        add_text(held, "child", item.root)
    placed = {str(ensure_child(joint, "child").get("link")): str(joint.get("name")) for joint in robot.findall("joint")}
    for link in robot.findall("link"):
        write_link(model, link, placed.get(str(link.get("name"))), overlay)
    for joint in robot.findall("joint"):
        write_joint(model, joint)
    etree.indent(root, space="  ")
    path = folder / SDF_NAME
    path.write_bytes(etree.tostring(root, xml_declaration=True, encoding="utf-8", pretty_print=True))
    config = etree.Element("model")
    for tag, text in (("name", overlay.asset_id), ("version", "1.0")):
        add_text(config, tag, text)
    etree.SubElement(config, "sdf", version=str(root.get("version"))).text = SDF_NAME
    add_text(config, "description", f"{overlay.asset_id}, refined by asset2sim: {overlay.mass_kg:.4g} kg")
    etree.indent(config, space="  ")
    (folder / SDF_CONFIG_NAME).write_bytes(etree.tostring(config, xml_declaration=True, encoding="utf-8"))
    return path


def write_link(model: Element, link: Element, joint: str | None, overlay: PhysicsOverlay) -> None:
    """Write one link at the frame of the joint that carries it, with its inertial and its shapes."""
    name = str(link.get("name"))
    made = etree.SubElement(model, "link", name=name)
    if joint is not None:
        etree.SubElement(made, "pose", relative_to=joint).text = "0 0 0 0 0 0"
    inertial = link.find("inertial")
    if inertial is not None:
        own = etree.SubElement(made, "inertial")
        add_text(own, "pose", sdf_pose(inertial))
        add_text(own, "mass", ensure_child(inertial, "mass").get("value"))
        tensor, stated = etree.SubElement(own, "inertia"), ensure_child(inertial, "inertia")
        for key in ("ixx", "ixy", "ixz", "iyy", "iyz", "izz"):
            add_text(tensor, key, stated.get(key))
    for tag in ("visual", "collision"):
        for number, shape in enumerate(link.findall(tag)):
            item = etree.SubElement(made, tag, name=f"{tag}_{number}")
            add_text(item, "pose", sdf_pose(shape))
            item.append(sdf_geometry(ensure_child(shape, "geometry")))
            color = shape.find("material/color")
            if tag == "visual" and color is not None:
                material = etree.SubElement(item, "material")
                for key in ("ambient", "diffuse"):
                    add_text(material, key, color.get("rgba"))
            if tag == "collision":
                write_friction(item, overlay)


def sdf_geometry(stated: Element) -> Element:
    """The geometry of a URDF's shape in SDF; mesh files stay where they are, relative to the model."""
    made = etree.Element("geometry")
    mesh = stated.find("mesh")
    if mesh is not None:
        item = etree.SubElement(made, "mesh")
        add_text(item, "uri", mesh.get("filename"))
        add_text(item, "scale", mesh.get("scale", "1 1 1"))
    for tag, keys in (("box", ("size",)), ("cylinder", ("radius", "length")), ("sphere", ("radius",))):
        shape = stated.find(tag)
        if shape is not None:
            item = etree.SubElement(made, tag)
            for key in keys:
                add_text(item, key, shape.get(key))
    return made


def write_friction(collision: Element, overlay: PhysicsOverlay) -> None:
    """Write the contact friction of a shape, and its rolling resistance where it has one, in words of both solvers."""
    friction = etree.SubElement(etree.SubElement(collision, "surface"), "friction")
    value = f"{overlay.contact_friction:.9g}"
    for solver, keys in (("ode", ("mu", "mu2")), ("bullet", ("friction", "friction2"))):
        own = etree.SubElement(friction, solver)
        for key in keys:
            add_text(own, key, value)
    if overlay.rolling_friction_m > 0.0:
        add_text(ensure_child(friction, "bullet"), "rolling_friction", f"{overlay.rolling_friction_m:.9g}")


def write_joint(model: Element, joint: Element) -> None:
    """Write one joint: place, axis, limits, damping, friction, spring, and what it follows."""
    kind = str(joint.get("type"))
    made = etree.SubElement(model, "joint", name=str(joint.get("name")),
                            type={"continuous": "revolute"}.get(kind, kind))  # fmt: skip
    parent = str(ensure_child(joint, "parent").get("link"))
    etree.SubElement(made, "pose", relative_to=parent).text = sdf_pose(joint)
    add_text(made, "parent", parent)
    add_text(made, "child", ensure_child(joint, "child").get("link"))
    if kind == "fixed":
        return
    axis = etree.SubElement(made, "axis")
    stated, limit, dynamics = joint.find("axis"), joint.find("limit"), joint.find("dynamics")
    add_text(axis, "xyz", "1 0 0" if stated is None else stated.get("xyz", "1 0 0"))
    ends = ("lower", "upper") if kind != "continuous" else ()
    say_all(etree.SubElement(axis, "limit"), limit, (*ends, "effort", "velocity"))
    terms = ("damping", "friction", "spring_stiffness", "spring_reference")
    say_all(etree.SubElement(axis, "dynamics"), dynamics, terms)
    mimic = joint.find("mimic")
    if mimic is not None:
        follow = etree.SubElement(axis, "mimic", joint=str(mimic.get("joint")))
        for key, usual in (("multiplier", "1"), ("offset", "0")):
            add_text(follow, key, mimic.get(key, usual))
        add_text(follow, "reference", "0")


def sdf_pose(element: Element) -> str:
    """An element's origin as SDF has poses: metres and roll, pitch, yaw."""
    origin = element.find("origin")
    return "0 0 0 0 0 0" if origin is None else f"{origin.get('xyz', '0 0 0')} {origin.get('rpy', '0 0 0')}"


def add_text(parent: Element, tag: str, text: str | None) -> None:
    """Add an element that holds a text."""
    etree.SubElement(parent, tag).text = text


def say_all(parent: Element, stated: Element | None, keys: Iterable[str]) -> None:
    """Add an element for each of these attributes that is stated."""
    for key in keys:
        text = None if stated is None else stated.get(key)
        if text is not None:
            add_text(parent, key, text)
