"""MJCF export beside the URDF: the refined object in a file that MuJoCo compiles by itself.

It is written from the URDF and the overlay, without MuJoCo: ``MjSpec.to_xml`` (4.0.0) writes six digits, replaces
inertia tensors by their principal axes, and drops inertials that MuJoCo could make up from the shapes.

Two files: ``mobility.xml`` is the object alone, to be attached or included; ``scene.xml`` includes it and adds a floor
and a light. The keyframe ``home`` is the initial state, the object standing on z = 0. A fixed object has no free joint:
its root stays where it is written, just above the floor; to mount it elsewhere, give its body another ``pos``.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from lxml import etree
from lxml.etree import _Element as Element

from asset2sim.assets import mujoco_options
from asset2sim.assets.exports.refined_object import (
    MJCF_NAME,
    ExportJoint,
    ExportObject,
    ExportShape,
    read_object,
    wxyz_of,
)
from asset2sim.assets.exports.visuals import looks_of, write_looks
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import mimics_of
from asset2sim.physics.mass_matrix import GRAVITY_M_S2
from schemas.overlay import PhysicsOverlay

SCENE_NAME = "scene.xml"
HOME = "home"
"""The keyframe of the initial state."""
VISUAL_GROUP, COLLISION_GROUP = "2", "3"
"""Geom groups: MuJoCo's viewer shows groups 0 to 2 and hides 3 to 5, so that one sees looks and not hulls."""


def export_mjcf(folder: Path, overlay: PhysicsOverlay, timestep_s: float) -> Path:
    """Write ``mobility.xml``, ``scene.xml`` and the meshes of its looks into a refined folder; the former's path.
    Everything is in SI units and radians. Options and constraints are those of the checks' own MuJoCo world at
    ``timestep_s``, except that a state which is no longer a number is reset. Raises what ``read_object`` raises."""
    document = mjcf_of(read_object(folder, overlay), timestep_s)
    etree.indent(document, space="  ")
    path = folder / MJCF_NAME
    path.write_bytes(etree.tostring(document, encoding="utf-8", pretty_print=True))
    (folder / SCENE_NAME).write_text(SCENE, encoding="utf-8")
    return path


def mjcf_of(item: ExportObject, timestep_s: float) -> Element:
    """The object's MJCF; the meshes and textures of its looks are written into its folder on the way."""
    root = etree.Element("mujoco", model=item.name)
    # Paths are relative to the file; mass and inertia come from the inertials alone, never from shapes.
    etree.SubElement(root, "compiler", angle="radian", autolimits="true", inertiafromgeom="false", fusestatic="false")
    write_options(root, timestep_s)
    write_defaults(root, item.contact_friction, item.rolling_friction_m, timestep_s)
    assets = etree.SubElement(root, "asset")
    geoms = write_looks(looks_of(item), item.folder, assets)
    names = collision_assets(item, assets)
    world = etree.SubElement(root, "worldbody")
    name = mujoco_options.body_name(item.root, item.bodies)
    height = item.height_to_stand(item.initial if item.fixed else {})
    body = etree.SubElement(world, "body", name=name, pos=exact_numbers((0.0, 0.0, height)))
    if not item.fixed:
        etree.SubElement(body, "freejoint", name=free_name(item))
    write_body(body, item, item.root, geoms, names)
    contact = etree.SubElement(root, "contact")
    for pair in (*related_to_root(item), *item.passing):
        first, second = (mujoco_options.body_name(name, item.bodies) for name in pair)
        etree.SubElement(contact, "exclude", body1=first, body2=second)
    equality = etree.SubElement(root, "equality")
    write_mimics(equality, item, timestep_s)
    actuator = etree.SubElement(root, "actuator")
    write_biases(actuator, item)
    etree.SubElement(
        etree.SubElement(root, "keyframe"), "key", name=HOME, qpos=exact_numbers(keyframe_qpos(item, world))
    )
    for part in (assets, contact, equality, actuator):
        if not len(part):
            root.remove(part)
    return root


def write_options(root: Element, timestep_s: float) -> None:
    """Write the solver's options."""
    # Damping is integrated implicitly: stable at the coarse steps of robot learning.
    etree.SubElement(
        root,
        "option",
        timestep=exact_number(timestep_s),
        gravity=exact_numbers((0.0, 0.0, -GRAVITY_M_S2)),
        integrator="implicitfast",
        solver="Newton",
        cone="elliptic",
        impratio=exact_number(mujoco_options.FRICTION_RATIO),
        iterations=str(mujoco_options.SOLVER_ITERATIONS),
        tolerance=exact_number(mujoco_options.SOLVER_TOLERANCE),
    )


def write_defaults(root: Element, contact_friction: float, rolling_m: float, timestep_s: float) -> None:
    """Write the defaults of joints, and the default classes of visual and collision geoms."""
    defaults = etree.SubElement(root, "default")
    reference = exact_numbers(mujoco_options.solref(timestep_s))
    etree.SubElement(
        defaults,
        "joint",
        solreffriction=reference,
        solimpfriction=exact_numbers(mujoco_options.FRICTION_SOLIMP),
        solreflimit=reference,
        solimplimit=exact_numbers(mujoco_options.LIMIT_SOLIMP),
    )
    visual = etree.SubElement(defaults, "default", {"class": "visual"})
    etree.SubElement(visual, "geom", group=VISUAL_GROUP, contype="0", conaffinity="0", mass="0")
    collision = etree.SubElement(defaults, "default", {"class": "collision"})
    # MuJoCo takes the larger coefficient of a contact; a higher priority lets the object's own decide on any floor.
    friction = exact_numbers((contact_friction, mujoco_options.TORSION_M, rolling_m or mujoco_options.ROLLING_M))
    dimension = {"condim": str(mujoco_options.ROLLING_DIMENSION)} if rolling_m > 0.0 else {}
    etree.SubElement(
        collision,
        "geom",
        dimension,
        group=COLLISION_GROUP,
        friction=friction,
        priority="1",
        solref=reference,
        solimp=exact_numbers(mujoco_options.CONTACT_SOLIMP),
        mass="0",
    )


def collision_assets(item: ExportObject, assets: Element) -> dict[tuple[str, tuple[float, ...]], str]:
    """Add every collision mesh file at its scale as an asset; (file, scale) → its name."""
    names: dict[tuple[str, tuple[float, ...]], str] = {}
    for body in item.bodies.values():
        for shape in body.shapes:
            key = mesh_key(shape)
            if shape.kind == "mesh" and key not in names:
                names[key] = f"hull_{len(names)}"
                scale = {} if np.allclose(key[1], 1.0) else {"scale": exact_numbers(key[1])}
                # The inertials are stated, so a mesh's own volume must not be asked for: a shell always has an area.
                etree.SubElement(assets, "mesh", {"name": names[key], "file": shape.file, **scale, "inertia": "shell"})
    return names


def mesh_key(shape: ExportShape) -> tuple[str, tuple[float, ...]]:
    """Key of a mesh asset: its file and scale."""
    return shape.file, tuple(float(v) for v in (np.ones(3) if shape.scale is None else shape.scale))


def write_body(
    element: Element,
    item: ExportObject,
    link: str,
    looks: dict[str, list[dict[str, str]]],
    names: dict[tuple[str, tuple[float, ...]], str],
) -> None:
    """Fill one body and, recursively, those of its children."""
    body = item.bodies[link]
    # The whole tensor about the centre of mass, in the link's axes.
    m = body.inertia
    full = exact_numbers((m[0, 0], m[1, 1], m[2, 2], m[0, 1], m[0, 2], m[1, 2]))
    etree.SubElement(
        element, "inertial", pos=exact_numbers(body.com), mass=exact_number(body.mass_kg), fullinertia=full
    )
    for attributes in looks.get(link, ()):
        etree.SubElement(element, "geom", {"class": "visual", "type": "mesh", **attributes})
    for shape in body.shapes:
        write_shape(element, shape, names)
    for joint in item.joints:
        if joint.tree.parent != link:
            continue
        name = mujoco_options.body_name(joint.tree.child, item.bodies)
        child = etree.SubElement(element, "body", {"name": name, **pos_and_quat(joint.tree.child_to_parent)})
        if joint.moves:
            write_joint(child, joint)
        write_body(child, item, joint.tree.child, looks, names)


def write_shape(element: Element, shape: ExportShape, names: dict[tuple[str, tuple[float, ...]], str]) -> None:
    """One collision geom. MuJoCo's sizes are half edges, and radius and half length."""
    attributes = {"class": "collision", "type": shape.kind, **pos_and_quat(shape.to_link)}
    if shape.kind == "mesh":
        attributes["mesh"] = names[mesh_key(shape)]
    else:
        halves = {"box": (2.0, 2.0, 2.0), "cylinder": (1.0, 2.0), "sphere": (1.0,)}[shape.kind]
        attributes["size"] = exact_numbers([size / half for size, half in zip(shape.size, halves, strict=True)])
    etree.SubElement(element, "geom", attributes)


def write_joint(element: Element, joint: ExportJoint) -> None:
    """A hinge or slide with its limits, damping, dry friction, spring and armature."""
    terms = joint.dynamics
    attributes = {
        "name": joint.name,
        "type": "hinge" if joint.turns else "slide",
        "axis": exact_numbers(joint.tree.axis),
        "damping": exact_number(terms.damping),
        "frictionloss": exact_number(terms.friction),
    }
    if terms.stiffness > 0.0:
        attributes |= {"stiffness": exact_number(terms.stiffness), "springref": exact_number(terms.spring_reference)}
    if terms.armature > 0.0:
        attributes["armature"] = exact_number(terms.armature)
        attributes["solimplimit"] = exact_numbers(mujoco_options.ARMATURE_LIMIT_SOLIMP)
    if joint.lower is not None and joint.upper is not None:
        attributes["range"] = exact_numbers((joint.lower, max(joint.upper, joint.lower + mujoco_options.LOCKED_RANGE)))
    if joint.effort is not None and joint.effort > 0.0:
        # MuJoCo counts in what a mechanism exerts: a garage door's springs may exceed what a motor may.
        _, _, least, most, _ = terms.bias
        attributes["actuatorfrcrange"] = exact_numbers((min(least, 0.0) - joint.effort, max(most, 0.0) + joint.effort))
    etree.SubElement(element, "joint", attributes)


def write_mimics(equality: Element, item: ExportObject, timestep_s: float) -> None:
    """Bind each joint that follows another to it, as stiff as limits are."""
    stiff = {
        "solref": exact_numbers(mujoco_options.solref(timestep_s)),
        "solimp": exact_numbers(mujoco_options.FRICTION_SOLIMP),
    }
    for name, mimic in mimics_of([joint.tree for joint in item.joints]).items():
        coefficients = exact_numbers((mimic.offset, mimic.multiplier, 0.0, 0.0, 0.0))
        etree.SubElement(equality, "joint", {"joint1": name, "joint2": mimic.joint, "polycoef": coefficients, **stiff})


def write_biases(actuator: Element, item: ExportObject) -> None:
    """Efforts of mechanisms on their joints, as actuators that no control moves. What clicks has the cogging of a motor
    with next to no coil: a sine of the same peak, which draws to the same places over any number of turns."""
    for joint in item.joints:
        slope, none_at, least, most, period = joint.dynamics.bias
        named = {"name": mujoco_options.bias_name(joint.name), "joint": joint.name}
        if period > 0.0:
            sine = exact_numbers((most, 2.0 * np.pi / period, np.pi - 2.0 * np.pi * none_at / period))
            etree.SubElement(actuator, "dcmotor", {**named, "motorconst": "1e-9", "resistance": "1", "cogging": sine})
        elif slope != 0.0:
            bias = {"gaintype": "fixed", "gainprm": "0", "biastype": "affine"}
            bias |= {"biasprm": exact_numbers((-slope * none_at, slope)), "forcerange": exact_numbers((least, most))}
            etree.SubElement(actuator, "general", {**named, **bias})


def related_to_root(item: ExportObject) -> list[tuple[str, str]]:
    """Pairs of colliding links, one rigidly on the root and the other one joint away. MuJoCo leaves out contacts of
    what one joint connects, but not where one of the two is welded to the world, as is the root of an object whose free
    joint a user removes: these pairs have to be named."""
    rigid = {item.root: item.root}
    away: dict[str, str] = {}
    for joint in item.joints:
        parent = rigid[joint.tree.parent]
        rigid[joint.tree.child] = joint.tree.child if joint.moves else parent
        away[joint.tree.child] = parent if joint.moves else away.get(joint.tree.parent, "")
    solid = [name for name, body in item.bodies.items() if body.shapes]
    held = [name for name in solid if rigid[name] == item.root]
    return [(first, second) for first in held for second in solid if away.get(second) == item.root]


def keyframe_qpos(item: ExportObject, world: Element) -> list[float]:
    """The keyframe's qpos: the free joint's (x, y, z, qw, qx, qy, qz), if any, then joints in the bodies' order."""
    by_name = item.initial
    free = [] if item.fixed else [0.0, 0.0, item.height_to_stand(by_name), 1.0, 0.0, 0.0, 0.0]
    return [*free, *(by_name[str(joint.get("name"))] for joint in world.iter("joint"))]


def free_name(item: ExportObject) -> str:
    """A name for the free joint that no other joint has."""
    name = "root"
    while any(joint.name == name for joint in item.joints):
        name += "_free"
    return name


def pos_and_quat(pose: Array) -> dict[str, str]:
    """A (4, 4) transform as ``pos`` and ``quat``; identity parts are left out."""
    attributes = {}
    if not np.allclose(pose[:3, 3], 0.0, atol=1e-12):
        attributes["pos"] = exact_numbers(pose[:3, 3])
    if not np.allclose(pose[:3, :3], np.eye(3), atol=1e-12):
        attributes["quat"] = exact_numbers(wxyz_of(pose[:3, :3]))
    return attributes


def exact_number(value: float) -> str:
    """One number with every digit that a float holds."""
    return repr(float(value))


def exact_numbers(values: Sequence[float] | Array) -> str:
    """Several numbers, separated by spaces."""
    return " ".join(exact_number(value) for value in values)


SCENE = f"""<mujoco model="scene">
  <include file="{MJCF_NAME}"/>
  <visual>
    <headlight ambient="0.4 0.4 0.4" diffuse="0.5 0.5 0.5"/>
  </visual>
  <worldbody>
    <light pos="0 0 4" dir="0 0 -1" type="directional"/>
    <geom name="floor" type="plane" size="0 0 0.05" rgba="0.8 0.8 0.8 1"/>
  </worldbody>
</mujoco>
"""
"""The object on a floor."""
