"""A format of assets as its module declares it, the result of its converter, and small pieces of URDF to write."""

import re
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePosixPath

import numpy as np
from lxml import etree
from lxml.etree import _Element as Element
from scipy.spatial.transform import Rotation

from asset2sim.assets.urdf.edit import short_numbers, turn_root
from asset2sim.assets.urdf.references import AllowedFolders
from asset2sim.physics.arrays import Array, Faces
from asset2sim.physics.kinematics import rpy_of
from schemas.errors import AssetError
from schemas.vocabulary import FailureMode

LEVEL = 1e-6
"""One less the cosine of the angle from the vertical, 0.08°, from which what a file draws is tilted."""
HEAD_BYTES = 65_536
"""Bytes at the beginning of a file that ``Format.recognises``."""


@dataclass(frozen=True)
class Converted:
    """A URDF that was made of a file of another format, the other ``files`` that it includes, and what a user must know
    of the conversion."""

    robot: Element
    files: tuple[Path, ...] = ()
    notes: tuple[str, ...] = ()
    metric: bool = True
    """Whether a file of a metric format says so itself, where its format leaves that to it."""
    world: str = ""
    """The link that stands for the world, where there is one."""
    free: tuple[str, ...] = ()
    """The links that the file has free of the world and that are fixed in ``robot``."""
    beside: tuple[str, ...] = ()
    """The links that stand still in the file's world, apart from the one thing in it that moves."""
    held: str = ""
    """Why the file holds the whole where it is, in words; empty where it leaves that open."""
    stood: str = ""
    """How the file stands the whole, fixed, on a table that is left out, in words; empty where it does not."""
    masks: Mapping[str, tuple[int, int]] = field(default_factory=dict)
    """Link with shapes → its bits as MuJoCo has them, contype and conaffinity, where the format has any."""
    driven: frozenset[str] = frozenset()
    """The joints that motors of the file move."""
    sized: bool = False
    """Whether its loader brings it to another size, by marks at its corners, so that its lengths mean nothing."""


INCLUDED = re.compile(r"""(?:<(?:xacro:)?include\s[^>]*?file(?:name)?\s*=\s*["']|@(?=[^@\n]*\.usd[acz]?@))([^"'@]+)""")


def included_in(text: str) -> set[str]:
    """Names, without folders, of the files that a description includes, as xacro, MJCF and USD do."""
    return {re.split(r"[/\\]", path)[-1] for path in INCLUDED.findall(text)}


def outermost_files(texts: Mapping[str, str]) -> list[str]:
    """The files, texts by name, that no other includes; all where each is included."""
    every = {name for text in texts.values() for name in included_in(text)}
    return [name for name in texts if PurePosixPath(name).name not in every] or list(texts)


@dataclass(frozen=True)
class Format:
    """A format in which assets are described: what it is called, the ``suffix`` of its files, and its ``converter``:
    (the file, a folder to write into, the folders that may be read) → ``Converted``. ``rank``: in a folder with
    several formats the lowest is read."""

    name: str
    suffix: str
    rank: int
    converter: Callable[[Path, Path, AllowedFolders], Converted]
    preferred: str = ""
    """The name that is taken where a folder has several files of the format."""
    metric: bool = True
    """Whether lengths are metres, as in all formats of simulators; a URDF may be of normalised meshes."""
    recognises: Callable[[bytes], bool] | None = None
    """Whether the first ``HEAD_BYTES`` of a file are of this format, where other files have its suffix too."""
    not_models: tuple[str, ...] = ()
    """Names of files with its suffix that never describe an asset."""
    of_several: Callable[[Mapping[str, str]], list[str]] | None = None
    """Of several files, text by name, those that describe an asset of their own; None: each does."""
    further: tuple[str, ...] = ()
    """Other suffixes of its files."""


WORLDS = ("base", "world", "stage", "ground")
"""Names for the link that stands for a file's world, the first that no other link has."""


def world_name(taken: Collection[str]) -> str:
    """The name of the link that stands for a file's world, which none of the ``taken`` ones is."""
    return next(name for name in (*WORLDS, *(f"base_{n}" for n in range(len(taken) + 1))) if name not in taken)


def pose_of(position: Array, quaternion: Array) -> Array:
    """(4, 4) of a (3,) position and a quaternion (w x y z)."""
    w, x, y, z = quaternion
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_quat([x, y, z, w]).as_matrix()
    pose[:3, 3] = position
    return pose


def unconvertible_error(file: Path, code: str, problem: str) -> AssetError:
    """An unreadable_asset error that names the file that cannot be converted."""
    return AssetError(FailureMode.UNREADABLE_ASSET, code, f"{file.name}: {problem}")


def add_child(parent: Element, tag: str, **attributes: str) -> Element:
    """A new child with these attributes; an underscore at the end of a name is dropped."""
    return etree.SubElement(parent, tag, {key.rstrip("_"): value for key, value in attributes.items()})


def add_origin(parent: Element, pose: Array) -> None:
    """State the (4, 4) pose of an element in its link, or of a joint in its parent link."""
    add_child(parent, "origin", xyz=short_numbers(pose[:3, 3]), rpy=short_numbers(rpy_of(pose[:3, :3])))


def settle_free(robot: Element, world: str, free: Sequence[str]) -> tuple[str, ...]:
    """Notes on links that a file has free of the link ``world`` and that are fixed to it. Where nothing is held they
    float instead, which is refused of an asset that is not cut."""
    hung = robot.findall(f"joint/parent[@link='{world}']/..")
    solid = any(robot.find(f"link[@name='{world}']/{tag}") is not None for tag in ("visual", "collision"))
    if len(free) < len(hung) or solid:
        said = f"{', '.join(free)}: free in it, and fixed where they stand; --split keeps them free"
        return (said,) if free else ()
    for joint in hung:
        joint.set("type", "floating")
    return ()


def stand_as_drawn(robot: Element, root: str, pose: Array) -> None:
    """Turn the object about its root's origin as the (4, 4) pose there does, where that tilts it: a URDF's root has no
    pose. What is upright keeps its axes."""
    if pose[2, 2] < 1.0 - LEVEL:
        turn_root(robot, root, Rotation.from_matrix(pose[:3, :3]))


def add_joint(robot: Element, name: str, kind: str, parent: str, child: str, pose: Array) -> Element:
    """A new joint between two links; ``pose`` is its (4, 4) own in the parent."""
    element = add_child(robot, "joint", name=name, type=kind)
    add_origin(element, pose)
    add_child(element, "parent", link=parent)
    add_child(element, "child", link=child)
    return element


def write_obj(work: Path, name: str, vertices: Array, faces: Faces, uv: Array | None = None) -> str:
    """The absolute path of a mesh, written below ``work``: (n, 3) vertices, (m, 3) faces, and for each of their corners
    (m, 3, 2) texture coordinates."""
    place = work / "meshes" / f"{re.sub(r'[^A-Za-z0-9_]', '_', name)[-100:]}.obj"
    place.parent.mkdir(exist_ok=True)
    while place.exists():
        place = place.with_stem(f"{place.stem}_")
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in np.asarray(vertices, dtype=float).tolist()]
    if uv is None:
        lines += [f"f {a} {b} {c}" for a, b, c in (faces + 1).tolist()]
    else:
        lines += [f"vt {u!r} {v!r}" for u, v in uv.reshape(-1, 2).tolist()]
        lines += [
            f"f {a}/{3 * i + 1} {b}/{3 * i + 2} {c}/{3 * i + 3}" for i, (a, b, c) in enumerate((faces + 1).tolist())
        ]
    place.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return str(place)


def add_contact(
    link: Element, frictions: Sequence[float], restitution: float | None = None, *, default: float = 0.0
) -> None:
    """State the mean Coulomb coefficient of a link's shapes, and its restitution, as Bullet reads them; nothing where
    each is the format's ``default``, which is no statement."""
    said = any(value != default for value in frictions)
    if said or restitution is not None:
        contact = add_child(link, "contact")
        if said:
            add_child(contact, "lateral_friction", value=short_numbers([sum(frictions) / len(frictions)]))
        if restitution is not None:
            add_child(contact, "restitution", value=short_numbers([restitution]))


def add_inertial(link: Element, mass: float, pose: Array, inertia: Sequence[float]) -> None:
    """State a link's mass (kg) and its inertia about the centre of mass (ixx ixy ixz iyy iyz izz, kg·m²) in the axes of
    ``pose``, which lies in the centre of mass."""
    element = add_child(link, "inertial")
    add_origin(element, pose)
    add_child(element, "mass", value=short_numbers([mass]))
    names = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")
    add_child(element, "inertia", **{name: short_numbers([value]) for name, value in zip(names, inertia, strict=True)})
