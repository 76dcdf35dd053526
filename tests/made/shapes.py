"""Parts of made objects, their joints, and the dataset folders that they are written to in the habits of others."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

Point = tuple[float, float, float]
Shape = tuple[str, trimesh.Trimesh]
UP_Y = Rotation.from_euler("xyz", (np.pi / 2.0, 0.0, -np.pi / 2.0))
"""PartNet-Mobility's turn from its meshes' axes, y up, to the world's, z up; objects face -x."""
LONGEST = 1.6
"""Longest edge of what is normalised, in the file's units."""


def block(name: str, size: Point, at: Point) -> Shape:
    """A box of these edges, its middle ``at``, m."""
    return name, trimesh.creation.box(size, trimesh.transformations.translation_matrix(at))


def rod(name: str, radius: float, length: float, at: Point, axis: str = "z") -> Shape:
    """A cylinder along an axis of the world."""
    turn = {"x": (0.0, np.pi / 2.0, 0.0), "y": (np.pi / 2.0, 0.0, 0.0), "z": (0.0, 0.0, 0.0)}[axis]
    mesh = trimesh.creation.cylinder(radius, length, sections=24)
    mesh.apply_transform(trimesh.transformations.euler_matrix(*turn))
    mesh.apply_translation(at)
    return name, mesh


def lathe(name: str, profile: Sequence[tuple[float, float]], at: Point = (0.0, 0.0, 0.0)) -> Shape:
    """A body turned about z: (radius, height) along its outline."""
    mesh = trimesh.creation.revolve(np.array(profile), sections=24)
    mesh.apply_translation(at)
    return name, mesh


def hollow(name: str, size: Point, at: Point, wall: float, front: bool = True) -> list[Shape]:
    """A carcass of boards, its middle ``at``: without the front at -x, or without the top."""
    (x, y, z), (cx, cy, cz) = size, at
    boards = [
        block(name, (x, wall, z), (cx, cy - (y - wall) / 2.0, cz)),
        block(name, (x, wall, z), (cx, cy + (y - wall) / 2.0, cz)),
        block(name, (x, y, wall), (cx, cy, cz - (z - wall) / 2.0)),
        block(name, (wall, y, z), (cx + (x - wall) / 2.0, cy, cz)),
    ]
    last = ((x, y, wall), (cx, cy, cz + (z - wall) / 2.0)) if front else ((wall, y, z), (cx - (x - wall) / 2.0, cy, cz))
    return [*boards, block(name, *last)]


@dataclass(frozen=True)
class Part:
    """A link: its label as PartNet-Mobility has it (mobility and part), its shapes in the world, m, and the joint that
    moves it: kind, a point on its axis, direction, range (rad, m)."""

    label: str
    shapes: Sequence[Shape]
    kind: str = "fixed"
    at: Point = (0.0, 0.0, 0.0)
    axis: Point = (0.0, 0.0, 1.0)
    range: tuple[float, float] = (0.0, 1.5)
    parent: int = 0


@dataclass(frozen=True)
class Made:
    """An object and what a person expects of it, written down before any run: the longest edge closed (cm), what
    carries it, masses (kg) of the whole and of parts by index, forces at the edge of parts (N), whether they stay where
    they are put."""

    name: str
    category: str
    habit: str
    """``partnet``: normalised, labels; ``akb``: metric, links named for their parts; ``bare``: normalised, no labels."""
    parts: Sequence[Part]
    size_cm: tuple[float, float]
    support: tuple[str, ...]
    mass_kg: tuple[float, float]
    part_kg: Mapping[int, tuple[float, float]] = field(default_factory=dict)
    force_n: Mapping[int, tuple[float, float]] = field(default_factory=dict)
    stays: Sequence[int] = ()
    prompt: str = ""


def write(item: Made, folder: Path) -> None:
    """The object's folder, in its habit."""
    metric, labelled = item.habit == "akb", item.habit == "partnet"
    folder.mkdir(parents=True)
    (folder / "textured_objs").mkdir()
    corners = np.vstack([mesh.bounds for part in item.parts for _, mesh in part.shapes])
    scale = 1.0 if metric else LONGEST / float(np.ptp(corners, axis=0).max())
    middle = np.zeros(3) if metric else corners.min(axis=0) / 2.0 + corners.max(axis=0) / 2.0
    turn = Rotation.identity() if metric else UP_Y
    named = [part.label.split()[-1] for part in item.parts]
    links = [f"{name}_{i}" if named.count(name) > 1 else name for i, name in enumerate(named)]
    links = links if metric else [f"link_{i}" for i in range(len(item.parts))]

    def local(point: Sequence[float]) -> "np.ndarray":
        return turn.inv().apply(scale * (np.array(point) - middle))

    text, origins = "", [local(part.at) if part.kind != "fixed" else np.zeros(3) for part in item.parts]
    number = 0
    for i, part in enumerate(item.parts):
        looks = ""
        for name, mesh in part.shapes:
            file = f"textured_objs/original-{(number := number + 1)}.obj"
            moved = trimesh.Trimesh(local(mesh.vertices) - origins[i], mesh.faces, process=False)
            moved.export(folder / file)
            geometry = f'<geometry><mesh filename="{file}"/></geometry>'
            title = f' name="{name}-{number}"' if labelled else ""
            looks += f"<visual{title}>{geometry}</visual><collision>{geometry}</collision>"
        text += f'<link name="{links[i]}">{looks}</link>'
        if i == 0:
            continue
        axis = turn.inv().apply(part.axis)
        low, high = (scale * value if part.kind == "prismatic" else value for value in part.range)
        limit = "" if part.kind in ("continuous", "fixed") else f'<limit lower="{low}" upper="{high}" effort="100" velocity="5"/>'
        text += (
            f'<joint name="joint_{i}" type="{part.kind}"><parent link="{links[part.parent]}"/><child link="{links[i]}"/>'
            f'<origin xyz="{words(origins[i] - origins[part.parent])}"/><axis xyz="{words(axis)}"/>{limit}</joint>'
        )
    if not metric:
        rpy = words(turn.as_euler("xyz"))
        text = (
            f'<link name="base"/>{text}<joint name="joint_0" type="fixed"><origin rpy="{rpy}" xyz="0 0 0"/>'
            '<parent link="base"/><child link="link_0"/></joint>'
        )
    (folder / "mobility.urdf").write_text(f'<robot name="{item.name}">{text}</robot>', encoding="utf-8")
    if labelled:
        lines = [f"{link} {part.label}\n" for link, part in zip(links, item.parts, strict=True)]
        (folder / "semantics.txt").write_text("".join(lines), encoding="utf-8")
        (folder / "meta.json").write_text(json.dumps({"model_cat": item.category}), encoding="utf-8")


def words(values: Sequence[float]) -> str:
    """Numbers separated by spaces."""
    return " ".join(repr(float(value)) for value in values)


def write_dataset(items: Sequence[Made], folder: Path) -> None:
    """All of them with a manifest; the category is in it but for those without labels and names."""
    lines = ["asset_id,category,path,subset,prompt"]
    for item in items:
        write(item, folder / item.name)
        lines.append(f"{item.name},{item.category},{item.name},made,{item.prompt}")
    (folder / "manifest.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
