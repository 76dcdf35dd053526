"""Made objects read from ``objects.json``, and the dataset folders that they are written to in the habits of others."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from scipy.spatial.transform import Rotation

from asset2sim.physics.arrays import Array

UP_Y = Rotation.from_euler("xyz", (np.pi / 2.0, 0.0, -np.pi / 2.0))
"""PartNet-Mobility's turn from its meshes' axes, y up, to the world's, z up; objects face -x."""
LONGEST = 1.6
"""Longest edge of what is normalised, in the file's units."""


TURNS = {"x": (0.0, np.pi / 2.0, 0.0), "y": (np.pi / 2.0, 0.0, 0.0), "z": (0.0, 0.0, 0.0)}


@dataclass(frozen=True)
class Part:
    """A link: its label as PartNet-Mobility has it (mobility and part), its shapes in the world, m, and the joint that
    moves it: kind, a point on its axis, direction, range (rad, m). A shape is a name, a kind and its numbers."""

    label: str
    shapes: Sequence[Sequence[Any]]
    kind: str = "fixed"
    at: Sequence[float] = (0.0, 0.0, 0.0)
    axis: Sequence[float] = (0.0, 0.0, 1.0)
    range: Sequence[float] = (0.0, 1.5)
    parent: int = 0


@dataclass(frozen=True)
class Made:
    """An object and what a person expects of it, written down before any run: the longest edge closed (cm), what
    carries it, masses (kg) of the whole and of parts by index, forces at the edge of parts (N), whether they stay where
    they are put."""

    name: str
    category: str
    habit: str
    """``partnet``: normalised, labels; ``akb``: metric, links named for parts; ``bare``: normalised, no labels."""
    parts: Sequence[Part]
    size_cm: tuple[float, float]
    support: Sequence[str]
    mass_kg: tuple[float, float]
    part_kg: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    force_n: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    stays: Sequence[int] = ()


def made() -> tuple[Made, ...]:
    """All made objects. Sizes, masses and forces are what a person who handles such things says of them, written down
    before the first run and not changed after it."""
    read = json.loads((Path(__file__).parent / "objects.json").read_text(encoding="utf-8"))
    return tuple(Made(**item | {"parts": [Part(**part) for part in item["parts"]]}) for item in read)


def mesh_of(kind: str, numbers: Sequence[float]) -> trimesh.Trimesh:
    """A box (edges, middle), a rod along an axis (radius, length, middle), a beam (radius, both ends), or a body turned
    about z (its foot, then radius and height along its outline), m."""
    mesh: trimesh.Trimesh
    if kind == "box":
        mesh = trimesh.creation.box(numbers[:3], trimesh.transformations.translation_matrix(numbers[3:]))
        return mesh
    if kind == "beam":
        mesh = trimesh.creation.cylinder(numbers[0], segment=np.reshape(numbers[1:], (2, 3)), sections=8)
        return mesh
    if kind == "lathe":
        mesh = trimesh.creation.revolve(np.reshape(numbers[3:], (-1, 2)), sections=24)
        mesh.apply_translation(numbers[:3])
        return mesh
    mesh = trimesh.creation.cylinder(numbers[0], numbers[1], sections=24)
    mesh.apply_transform(trimesh.transformations.euler_matrix(*TURNS[kind[-1]]))
    mesh.apply_translation(numbers[2:])
    return mesh


def write(item: Made, folder: Path) -> None:
    """The object's folder, in its habit."""
    metric, labelled = item.habit == "akb", item.habit == "partnet"
    folder.mkdir(parents=True)
    (folder / "textured_objs").mkdir()
    meshes = [[(name, mesh_of(kind, numbers)) for name, kind, *numbers in part.shapes] for part in item.parts]
    corners = np.vstack([mesh.bounds for shapes in meshes for _, mesh in shapes])
    scale = 1.0 if metric else LONGEST / float(np.ptp(corners, axis=0).max())
    middle = np.zeros(3) if metric else corners.min(axis=0) / 2.0 + corners.max(axis=0) / 2.0
    turn = Rotation.identity() if metric else UP_Y
    named = [part.label.split()[-1] for part in item.parts]
    links = [f"{name}_{i}" if named.count(name) > 1 else name for i, name in enumerate(named)]
    links = links if metric else [f"link_{i}" for i in range(len(item.parts))]

    def local(point: Any) -> Array:
        moved: Array = turn.inv().apply(scale * (np.array(point) - middle))
        return moved

    text, origins = "", [local(part.at) if part.kind != "fixed" else np.zeros(3) for part in item.parts]
    number = 0
    for i, part in enumerate(item.parts):
        looks = ""
        for name, mesh in meshes[i]:
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
        limit = (
            ""
            if part.kind in ("continuous", "fixed")
            else f'<limit lower="{low}" upper="{high}" effort="100" velocity="5"/>'
        )
        text += (
            f'<joint name="joint_{i}" type="{part.kind}"><parent link="{links[part.parent]}"/>'
            f'<child link="{links[i]}"/>'
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


def words(values: Any) -> str:
    """Numbers separated by spaces."""
    return " ".join(repr(float(value)) for value in values)


def write_dataset(items: Sequence[Made], folder: Path) -> None:
    """All of them with a manifest; the category is in it but for those without labels and names."""
    lines = ["asset_id,category,path,subset,prompt"]
    for item in items:
        write(item, folder / item.name)
        lines.append(f"{item.name},{item.category},{item.name},made,")
    (folder / "manifest.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
