"""Data types of a planted defect, and the edits of a URDF and of collision meshes that planting needs."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from lxml import etree
from lxml.etree import _Element as Element

from asset2sim.intake.locate import find_source
from asset2sim.physics.arrays import Array
from schemas.asset import AssetRecord


@dataclass(frozen=True)
class Target:
    """Where a defect is planted: an asset of the samples, a link of it, and the joint that moves it."""

    asset_id: str
    link: str = ""
    joint: str = ""


@dataclass(frozen=True)
class PlantedChange:
    """The planted change, in words, and the links and joints that it concerns."""

    what: str
    links: tuple[str, ...] = ()
    joints: tuple[str, ...] = ()


@dataclass(frozen=True)
class RefinedAsset:
    """A refined asset: its folder and its record."""

    folder: Path
    record: AssetRecord


Plant = Callable[[Path, Target], PlantedChange]
"""Plants a defect in a copy of a clean asset's folder."""
Left = Callable[[RefinedAsset, RefinedAsset, Target], str]
"""Why a defect is left, or an empty text: from the clean asset, the refined planted asset and the target."""


@dataclass(frozen=True)
class Defect:
    """One class of defect seen in real assets, planted in one place."""

    name: str
    target: Target
    plant: Plant
    left: Left


@contextmanager
def edited(folder: Path) -> Iterator[Element]:
    """The root element of the folder's URDF, written back at the end of the block."""
    path = find_source(folder)
    tree = etree.parse(str(path))
    yield tree.getroot()
    tree.write(str(path), xml_declaration=True, encoding="utf-8")


def changed(tag: str, path: str, edit: Callable[[Element], str]) -> Plant:
    """A plant that edits the element at a path below the target's link or joint, as the tag says; ``edit`` returns what
    it made of it, in words that follow the name."""

    def plant(folder: Path, at: Target) -> PlantedChange:
        name = at.joint if tag == "joint" else at.link
        with edited(folder) as robot:
            said = f"'{name}' {edit(named(robot, tag, name, path))}"
        return PlantedChange(said, **{f"{tag}s": (name,)})

    return plant


def named(robot: Element, tag: str, name: str, path: str = ".") -> Element:
    """The link or joint of that name, or the element at a path below it; KeyError if there is none."""
    for element in robot.findall(tag):
        if element.get("name") == name:
            return part(element, path)
    raise KeyError(f"{tag} '{name}'")


def part(element: Element, path: str) -> Element:
    """The element at that path; KeyError if there is none."""
    found = element.find(path)
    if found is None:
        raise KeyError(f"{element.tag!s} '{element.get('name')}' has no {path}")
    return found


def above(element: Element) -> Element:
    """The element that holds this one."""
    parent = element.getparent()
    assert parent is not None, "links and joints are in a robot"
    return parent


def numbers(element: Element, key: str) -> Array:
    """(n,) numbers of one attribute."""
    return np.array([float(word) for word in str(element.get(key)).split()])


def write(element: Element, key: str, values: float | Sequence[float] | Array) -> None:
    """Set one attribute to these numbers."""
    element.set(key, " ".join(f"{value:.9g}" for value in np.atleast_1d(np.asarray(values, dtype=float))))


def scaled(element: Element, key: str, factor: float) -> str:
    """Multiply an attribute's numbers; returns the old and the new text."""
    before = str(element.get(key))
    write(element, key, numbers(element, key) * factor)
    return f"{before} to {element.get(key)}"


def collision_files(folder: Path, link: str) -> list[Path]:
    """The mesh files of one link's collision elements."""
    urdf = find_source(folder)
    element = named(etree.parse(str(urdf)).getroot(), "link", link)
    return [urdf.parent / str(mesh.get("filename")) for mesh in element.findall("collision/geometry/mesh")]


def rewrite_obj(path: Path, vertices: Callable[[Array], Array], faces: Callable[[Array], Array]) -> None:
    """Change the (n, 3) vertices and the (k, 3) vertex numbers, from 1, of a plain OBJ of triangles."""
    points, triangles = read_obj(path)
    lines = ["v " + " ".join(f"{value:.9g}" for value in point) for point in vertices(points)]
    lines += ["f " + " ".join(str(int(index)) for index in triangle) for triangle in faces(triangles)]
    path.write_text("\n".join(lines) + "\n", encoding="ascii")


def read_obj(path: Path) -> tuple[Array, Array]:
    """(n, 3) vertices and (k, 3) vertex numbers, from 1, of a plain OBJ of triangles."""
    rows = [line.split() for line in path.read_text(encoding="ascii").splitlines()]
    points = np.array([[float(word) for word in row[1:4]] for row in rows if row and row[0] == "v"])
    triangles = np.array([[float(word.split("/")[0]) for word in row[1:4]] for row in rows if row and row[0] == "f"])
    return points, triangles
