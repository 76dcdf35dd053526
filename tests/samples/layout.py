"""One blueprint as the files of PartNet-Mobility's layout, a path within the asset's folder → its bytes."""

import json
import math
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np

from asset2sim.physics.arrays import Array
from tests.samples.blueprint import TEXTURES, Blueprint, Finish, JointSpec, Link
from tests.samples.shapes import Mesh, Point

DIGITS = 6


def authored_parts(blueprint: Blueprint) -> tuple[Link, ...]:
    """The parts moved to their joints' ``authored`` positions, limits counted from there; centred as real data is."""
    by_key = {part.key: part for part in blueprint.parts}
    moved = tuple(_moved(part, by_key) for part in blueprint.parts)
    vertices = np.vstack([piece.mesh.vertices for part in moved for piece in part.pieces])
    centre = np.round((vertices.min(axis=0) + vertices.max(axis=0)) / 2.0, 3)
    return tuple(_shifted(part, -centre) for part in moved)


def _frame(part: Link, by_key: dict[str, Link]) -> Array:
    """(4, 4) transform of a part from the closed to the authored pose."""
    return np.eye(4) if part.joint is None else _frame(by_key[part.joint.parent], by_key) @ _motion(part.joint)


def _motion(joint: JointSpec) -> Array:
    # Rodrigues about the joint's axis, which the blueprints give with unit length.
    motion = np.eye(4)
    axis = np.array(joint.axis)
    if joint.type == "prismatic":
        motion[:3, 3] = axis * joint.authored
        return motion
    x, y, z = joint.axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    turn = np.eye(3) + math.sin(joint.authored) * cross + (1.0 - math.cos(joint.authored)) * (cross @ cross)
    motion[:3, :3] = turn
    motion[:3, 3] = np.array(joint.point) - turn @ np.array(joint.point)
    return motion


def _moved(part: Link, by_key: dict[str, Link]) -> Link:
    frame, joint = _frame(part, by_key), part.joint
    pieces = tuple(replace(piece, mesh=_transformed(piece.mesh, frame)) for piece in part.pieces)
    if joint is not None:
        before = _frame(by_key[joint.parent], by_key)
        point = before[:3, :3] @ np.array(joint.point) + before[:3, 3]
        axis = before[:3, :3] @ np.array(joint.axis)
        lower, upper = joint.lower - joint.authored, joint.upper - joint.authored
        joint = replace(joint, point=_point(point), axis=_point(axis), lower=lower, upper=upper)
    return replace(part, pieces=pieces, joint=joint)


def _shifted(part: Link, shift: Array) -> Link:
    pieces = []
    for piece in part.pieces:
        # Rounded here, so that boxes and files agree on the last digit.
        vertices = np.round(piece.mesh.vertices + shift, DIGITS) + 0.0
        pieces.append(replace(piece, mesh=replace(piece.mesh, vertices=vertices)))
    joint = part.joint
    if joint is not None and joint.type != "prismatic":
        joint = replace(joint, point=_point(np.array(joint.point) + shift))
    return replace(part, pieces=tuple(pieces), joint=joint)


def _transformed(mesh: Mesh, motion: Array) -> Mesh:
    return replace(mesh, vertices=mesh.vertices @ motion[:3, :3].T + motion[:3, 3])


def _point(values: Array) -> Point:
    x, y, z = (round(float(value), DIGITS) + 0.0 for value in values)
    return (x, y, z)


UPRIGHT_RPY = "1.570796326794897 0 -1.570796326794897"
"""The real data's fixed joint: turns the y-up body upright, its front towards -x."""
ORIGIN: Point = (0.0, 0.0, 0.0)


def asset_files(blueprint: Blueprint) -> dict[str, bytes]:
    """All files of one asset."""
    parts = authored_parts(blueprint)
    used = sorted({piece.paint.texture for part in parts for piece in part.pieces if piece.paint.texture})
    textures = {name: f"texture_{index}.png" for index, name in enumerate(used)}
    files: dict[str, bytes] = {f"images/{file}": TEXTURES[name] for name, file in textures.items()}
    number = 0
    meshes: list[list[str]] = []
    for part in parts:
        meshes.append([])
        for piece in part.pieces:
            number += 1
            stem = f"original-{number}"
            files[f"textured_objs/{stem}.obj"] = _obj(piece.mesh, stem, piece.name)
            files[f"textured_objs/{stem}.mtl"] = _mtl(piece.paint, textures)
            meshes[-1].append(f"textured_objs/{stem}.obj")
    files["mobility.urdf"] = _urdf(blueprint, parts, meshes)
    files["semantics.txt"] = "".join(
        f"link_{i} {part.joint.kind if part.joint else part.kind} {part.label}\n" for i, part in enumerate(parts)
    ).encode()
    files["meta.json"] = _json({"model_cat": blueprint.category, "model_id": blueprint.asset_id, "version": "1"})
    files["bounding_box.json"] = _bounding_box(parts)
    files["mobility_v2.json"] = _annotation(parts)
    return files


def number_text(value: float) -> str:
    """The shortest text of a number rounded to ``DIGITS`` decimals, without a minus zero."""
    text = f"{value:.{DIGITS}f}".rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def _triple(values: Point) -> str:
    return " ".join(number_text(value) for value in values)


def _obj(mesh: Mesh, stem: str, name: str) -> bytes:
    lines = [f"mtllib {stem}.mtl", f"o {name}"]
    lines += ["v " + " ".join(number_text(value) for value in vertex) for vertex in mesh.vertices.tolist()]
    if mesh.uv is None:
        lines += ["usemtl material_0", *("f {} {} {}".format(*face) for face in (mesh.faces + 1).tolist())]
        return ("\n".join(lines) + "\n").encode()
    corners = [" ".join(number_text(value) for value in corner) for corner in mesh.uv.reshape(-1, 2).tolist()]
    place = {corner: index + 1 for index, corner in enumerate(dict.fromkeys(corners))}
    lines += [f"vt {corner}" for corner in place]
    lines.append("usemtl material_0")
    for row, face in enumerate((mesh.faces + 1).tolist()):
        lines.append("f " + " ".join(f"{vertex}/{place[corners[3 * row + k]]}" for k, vertex in enumerate(face)))
    return ("\n".join(lines) + "\n").encode()


def _mtl(paint: Finish, textures: dict[str, str]) -> bytes:
    # A texture multiplies Kd, so textured parts are white, as in the real data.
    rgb = (1.0, 1.0, 1.0) if paint.texture else paint.rgb
    lines = ["newmtl material_0", "illum 2", f"d {number_text(paint.alpha)}", "Ns 30", f"Kd {_triple(rgb)}"]
    lines.append("Ks 0.066667 0.066667 0.066667")
    if paint.texture:
        lines.append(f"map_Kd ../images/{textures[paint.texture]}")
    return ("\n".join(lines) + "\n").encode()


def _urdf(blueprint: Blueprint, parts: tuple[Link, ...], meshes: list[list[str]]) -> bytes:
    robot = ET.Element("robot", name=f"sample_{blueprint.asset_id}")
    ET.SubElement(robot, "link", name="base")
    index = {part.key: i for i, part in enumerate(parts)}
    for i, (part, files) in enumerate(zip(parts, meshes, strict=True)):
        link = ET.SubElement(robot, "link", name=f"link_{i}")
        point = part.joint.point if part.joint else ORIGIN
        # Meshes are in the object's frame: their origin undoes the joint's, which undoes the parent's in turn.
        origin = _triple((-point[0], -point[1], -point[2]))
        for tag in ("visual", "collision"):
            for piece, file in zip(part.pieces, files, strict=True):
                shape = ET.SubElement(link, tag, {"name": f"{piece.name}-{i + 1}"} if tag == "visual" else {})
                ET.SubElement(shape, "origin", xyz=origin)
                ET.SubElement(ET.SubElement(shape, "geometry"), "mesh", filename=file)
        _joint(robot, i, part.joint, parts, index)
    ET.indent(robot)
    return ("<?xml version='1.0' encoding='utf-8'?>\n" + ET.tostring(robot, encoding="unicode") + "\n").encode()


def _joint(robot: ET.Element, i: int, joint: JointSpec | None, parts: tuple[Link, ...], index: dict[str, int]) -> None:
    element = ET.SubElement(robot, "joint", name=f"joint_{i}", type=joint.type if joint else "fixed")
    if joint is None:
        ET.SubElement(element, "origin", rpy=UPRIGHT_RPY, xyz="0 0 0")
    else:
        above = parts[index[joint.parent]].joint
        frame = above.point if above else ORIGIN
        (x, y, z), (x0, y0, z0) = joint.point, frame
        ET.SubElement(element, "origin", xyz=_triple((x - x0, y - y0, z - z0)))
        ET.SubElement(element, "axis", xyz=_triple(joint.axis))
    ET.SubElement(element, "child", link=f"link_{i}")
    ET.SubElement(element, "parent", link=f"link_{index[joint.parent]}" if joint else "base")
    if joint is not None and joint.type != "continuous":
        ET.SubElement(element, "limit", lower=number_text(joint.lower), upper=number_text(joint.upper))


def _bounding_box(parts: tuple[Link, ...]) -> bytes:
    vertices = np.vstack([piece.mesh.vertices for part in parts for piece in part.pieces])
    return _json({"min": vertices.min(axis=0).tolist(), "max": vertices.max(axis=0).tolist()})


def _annotation(parts: tuple[Link, ...]) -> bytes:
    # The annotators' tree: hinge limits in degrees, ids the links' numbers, parts numbered after them.
    index = {part.key: i for i, part in enumerate(parts)}
    rows: list[dict[str, object]] = []
    for i, part in enumerate(parts):
        joint = part.joint
        data: dict[str, object] = {}
        if joint is not None:
            unit = 1.0 if joint.type == "prismatic" else 180.0 / math.pi
            limit = {"a": round(joint.lower * unit, 4), "b": round(joint.upper * unit, 4)}
            data["axis"] = {"origin": list(joint.point), "direction": list(joint.axis)}
            data["limit"] = {**limit, "noLimit": joint.type == "continuous"}
        parent, kind = (index[joint.parent], joint.kind) if joint else (-1, part.kind)
        below = [{"id": len(parts) + i, "name": part.label, "children": []}]
        rows.append({"id": i, "parent": parent, "joint": kind, "name": part.label, "parts": below, "jointData": data})
    return _json(rows)


def _json(value: object) -> bytes:
    return (json.dumps(value, ensure_ascii=True) + "\n").encode()
