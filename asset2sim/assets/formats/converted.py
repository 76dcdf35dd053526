"""A converter's result, and the small pieces of URDF that converters write."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from lxml import etree
from lxml.etree import _Element as Element

from asset2sim.assets.urdf.edit import words
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import rpy_of
from schemas.errors import AssetError
from schemas.vocabulary import FailureMode


@dataclass(frozen=True)
class Converted:
    """A URDF that was made of a file of another ``kind``, the other ``files`` that it includes, and what a user must
    know of the conversion."""

    robot: Element
    kind: str
    files: tuple[Path, ...] = ()
    notes: tuple[str, ...] = ()


def unconvertible(file: Path, code: str, problem: str) -> AssetError:
    """An unreadable_asset error that names the file that cannot be converted."""
    return AssetError(FailureMode.UNREADABLE_ASSET, code, f"{file.name}: {problem}")


def add(parent: Element, tag: str, **attributes: str) -> Element:
    """A new child with these attributes; an underscore at the end of a name is dropped."""
    return etree.SubElement(parent, tag, {key.rstrip("_"): value for key, value in attributes.items()})


def add_origin(parent: Element, pose: Array) -> None:
    """State the (4, 4) pose of an element in its link, or of a joint in its parent link."""
    add(parent, "origin", xyz=words(pose[:3, 3]), rpy=words(rpy_of(pose[:3, :3])))


def add_inertial(link: Element, mass: float, pose: Array, inertia: Sequence[float]) -> None:
    """State a link's mass (kg) and its inertia about the centre of mass (ixx ixy ixz iyy iyz izz, kg·m²) in the axes of
    ``pose``, which lies in the centre of mass."""
    element = add(link, "inertial")
    add_origin(element, pose)
    add(element, "mass", value=words([mass]))
    names = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    add(element, "inertia", **{name: words([value]) for name, value in zip(names, inertia, strict=True)})
