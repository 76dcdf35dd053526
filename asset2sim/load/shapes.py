"""Geometry of a URDF's tree by numpy and the standard library alone: vectors, poses, points of shapes, and how deep
links are in each other at some joint positions, pieces taken as convex, as engines take them."""

import math
import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np


class LoadError(RuntimeError):
    """The folder is no refined object, or holds or was given what cannot be used; says what to do."""


def finite_numbers(what: str, values: Any, counts: tuple[int, ...]) -> list[float]:
    """So many finite numbers. Raises LoadError."""
    try:
        found = np.atleast_1d(np.asarray(values, dtype=float)).ravel().tolist()
    except (TypeError, ValueError):
        found = []
    if len(found) not in counts or not all(map(math.isfinite, found)):
        several = f"{' or '.join(map(str, counts))} finite numbers"
        raise LoadError(f"{what}: {values} is not {'a finite number' if counts == (1,) else several}")
    return found


def link_of_end(element: ET.Element, tag: str) -> str:
    """The link that a joint's ``<parent>`` or ``<child>`` names."""
    found = element.find(tag)
    return "" if found is None else str(found.get("link"))


def vector_of(element: ET.Element | None, key: str, default: str = "0 0 0") -> np.ndarray:
    """(3,) numbers of an attribute."""
    numbers = str((element is not None and element.get(key)) or default).split()
    return np.array([float(number) for number in (numbers * 3)[:3]])


def axis_rotation(axis: np.ndarray, angle: float) -> np.ndarray:
    """(3, 3) rotation about an axis, by Rodrigues' formula."""
    x, y, z = axis / np.linalg.norm(axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross)


def pose_of(element: ET.Element) -> np.ndarray:
    """(4, 4) transform of an element's ``<origin>``."""
    origin, pose, (x, y, z) = element.find("origin"), np.eye(4), np.eye(3)
    roll, pitch, yaw = vector_of(origin, "rpy")
    pose[:3, :3] = axis_rotation(z, yaw) @ axis_rotation(y, pitch) @ axis_rotation(x, roll)
    pose[:3, 3] = vector_of(origin, "xyz")
    return pose


def link_poses(urdf: ET.Element, root: str, positions: Mapping[str, float]) -> dict[str, np.ndarray]:
    """Link → (4, 4) link-to-root transform at these joint positions."""
    poses, waiting = {root: np.eye(4)}, [root]
    for parent in waiting:
        for element in (joint for joint in urdf.findall("joint") if link_of_end(joint, "parent") == parent):
            motion, axis = np.eye(4), vector_of(element.find("axis"), "xyz", "1 0 0")
            position = positions.get(str(element.get("name")), 0.0)
            if element.get("type") == "prismatic":
                motion[:3, 3] = position * axis / np.linalg.norm(axis)
            elif element.get("type") != "fixed":
                motion[:3, :3] = axis_rotation(axis, position)
            poses[link_of_end(element, "child")] = poses[parent] @ pose_of(element) @ motion
            waiting.append(link_of_end(element, "child"))
    return poses


LEVEL = 0.2  # largest upward share of a wheel's axle; what turns about a steeper one is a turntable


def wheels_of(urdf: Any, root: str) -> dict[str, list[tuple[np.ndarray, float, float]]]:
    """Link → pose (4, 4) in the link's frame, its z along the axle, radius and length, m, of each of its collision
    cylinders that turns without end about its own level axis."""
    poses, found = link_poses(urdf, root, {}), dict[str, list[tuple[np.ndarray, float, float]]]()
    links = {str(link.get("name")): link for link in urdf.findall("link")}
    for joint in urdf.findall("joint[@type='continuous']"):
        name, axis = link_of_end(joint, "child"), vector_of(joint.find("axis"), "xyz", "1 0 0")
        axis = axis / np.linalg.norm(axis)
        for item in links[name].findall("collision"):
            pose, made = pose_of(item), item.find("geometry/cylinder")
            if made is None:
                continue
            radius, length = (float(vector_of(made, key)[0]) for key in ("radius", "length"))
            about = np.linalg.norm(np.cross(axis, pose[:3, 2])) + np.linalg.norm(np.cross(axis, pose[:3, 3])) / radius
            if about <= TOUCH_M and abs(poses[name][2, :3] @ axis) <= LEVEL:
                found.setdefault(name, []).append((pose, radius, length))
    return found


def carried_inertia(urdf: ET.Element, root: str, positions: Mapping[str, float]) -> dict[str, float]:
    """Joint → inertia of all beyond it about its axis, kg·m², or its mass where it slides, kg, the root held."""
    poses, found = link_poses(urdf, root, positions), dict[str, float]()
    joints, inertials = (
        urdf.findall("joint"),
        {str(link.get("name")): link.find("inertial") for link in urdf.iter("link")},
    )
    for joint in (one for one in joints if one.get("type") != "fixed"):
        links, total = [link_of_end(joint, "child")], 0.0
        at = poses[links[0]]
        axis = vector_of(joint.find("axis"), "xyz", "1 0 0")
        along = at[:3, :3] @ axis / np.linalg.norm(axis)
        for link in links:
            links.extend(link_of_end(one, "child") for one in joints if link_of_end(one, "parent") == link)
            inertial = inertials[link]
            if inertial is not None:
                mass, frame = vector_of(inertial.find("mass"), "value", "0")[0], poses[link] @ pose_of(inertial)
                (xx,), (yy,), (zz,), (xy,), (xz,), (yz,) = (
                    vector_of(inertial.find("inertia"), name, "0")[:1]
                    for name in ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
                )
                own = frame[:3, :3].T @ along
                spin = own @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ own
                lever = np.cross(along, frame[:3, 3] - at[:3, 3])
                total += float(mass if joint.get("type") == "prismatic" else spin + mass * lever @ lever)
        found[str(joint.get("name"))] = total
    return found


def points_of(link: ET.Element, tag: str, names: tuple[str, ...] = ("",)) -> np.ndarray:
    """(n, 3) points that span a link's shapes of this tag whose name begins so, in the link's frame, m. Raises
    LoadError for a collision mesh that is not there or no OBJ; visual ones are left out."""
    clouds = [np.zeros((0, 3))]
    for item in (one for one in link.findall(tag) if str(one.get("name", "")).lower().startswith(names)):
        pose = pose_of(item)
        for shape in item.findall("geometry/*"):
            clouds.append(shape_points(shape, tag == "collision") @ pose[:3, :3].T + pose[:3, 3])
    return np.vstack(clouds)


def shape_points(shape: ET.Element, needed: bool) -> np.ndarray:
    """(n, 3) points that span a shape of a ``<geometry>``, in its own frame, m; see ``mesh_points``."""
    half = np.array([0.0, 0.0, float(shape.get("length", 0.0)) / 2.0])
    if shape.tag == "mesh":
        vertices: np.ndarray = mesh_points(Path(shape.get("filename", "")), needed) * vector_of(shape, "scale", "1")
        return vertices
    if shape.tag == "box":
        ends = [(-side / 2.0, side / 2.0) for side in vector_of(shape, "size")]
        return np.asarray(np.array(np.meshgrid(*ends)).reshape(3, -1).T)
    # Round: a cylinder along z by its rims, a sphere or capsule by circles about x.
    around = np.linspace(0.0, 2.0 * math.pi, 64, endpoint=False)
    circle = float(shape.get("radius", 0.0)) * np.stack([np.cos(around), np.sin(around), 0.0 * around], axis=1)
    tilts = [axis_rotation(np.eye(3)[0], tilt) for tilt in (around[:1] if shape.tag == "cylinder" else around)]
    return np.vstack([circle @ tilt + side for tilt in tilts for side in (half, -half)])


def mesh_points(file: Path, needed: bool) -> np.ndarray:
    """(n, 3) vertices of an OBJ file, unscaled; none where it is not one that can be read and not ``needed``."""
    lines = file.read_text("utf-8", "replace").splitlines() if file.suffix.lower() == ".obj" and file.is_file() else []
    points = np.array([line.split()[1:4] for line in lines if line.startswith("v ")], dtype=float).reshape(-1, 3)
    if needed and not len(points):
        problem = "is no OBJ; refine the object with --collision repair" if file.is_file() else "is not there"
        raise LoadError(f"collision mesh {file} {problem}")
    return points


TOUCH_M = 0.002  # links may be so much deeper in each other than as asked for: what engines keep between meshes
STARTS, TURNS = 12, 40  # directions that are turned, and how often, towards ones along which less is in the way
MOST_NORMALS = 400  # directions of a piece along which it is looked for a gap


class Pieces:
    """The convex pieces of all links that may meet: not those that a joint connects or the URDF lets pass. ``links``
    holds (n, 3) points and (m, 3) unit normals of each piece of a link, m in the link's frame."""

    def __init__(self, urdf: ET.Element, root: str, passing: Iterable[tuple[str, str]]) -> None:
        self.urdf, self.root = urdf, root
        self.links = {str(link.get("name")): pieces_of(link) for link in urdf.findall("link")}
        group = rigid_groups(urdf)
        apart = {frozenset(pair) for pair in passing}
        joined = {
            frozenset((group[link_of_end(one, "parent")], group[link_of_end(one, "child")]))
            for one in urdf.findall("joint")
        }
        self.pairs = [
            (one, other)
            for one, other in combinations([name for name, pieces in self.links.items() if pieces], 2)
            if group[one] != group[other] and frozenset((group[one], group[other])) not in joined
            and frozenset((one, other)) not in apart
        ]  # fmt: skip

    def depths(self, positions: Mapping[str, float]) -> dict[tuple[str, str], float]:
        """Pair of links → how deep they are in each other, m: at most the least way apart along a normal of theirs."""
        poses, placed = link_poses(self.urdf, self.root, positions), {}
        for name in {name for pair in self.pairs for name in pair}:
            pose = poses[name]
            pieces = [(at @ pose[:3, :3].T + pose[:3, 3], along @ pose[:3, :3].T) for at, along in self.links[name]]
            low, high = (np.array([pick(at, axis=0) for at, _ in pieces]) for pick in (np.min, np.max))
            placed[name] = pieces, low, high
        found = {}
        for pair in self.pairs:
            (first, low, high), (second, other_low, other_high) = placed[pair[0]], placed[pair[1]]
            near = ((low[:, None] < other_high[None]) & (other_low[None] < high[:, None])).all(axis=2)
            deep = max((overlap_depth(first[i], second[j]) for i, j in np.argwhere(near)), default=0.0)
            if deep > 0.0:
                found[pair] = deep
        return found


def overlap_depth(one: tuple[np.ndarray, np.ndarray], other: tuple[np.ndarray, np.ndarray]) -> float:
    """How far a convex piece has to be moved to be free of another, m, along the best direction found: a normal of
    theirs, turned towards one in which less is in the way. Never less than it is; 0 where a gap is found."""
    (at, along), (other_at, other_along) = one, other
    ways = np.vstack([along, -other_along])
    deep = (at @ ways.T).max(axis=0) - (other_at @ ways.T).min(axis=0)
    found, best = float(deep.min()), np.argsort(deep)[:STARTS]
    ways = ways[best]
    for turned in range(TURNS if found > TOUCH_M else 0):
        between = at[(at @ ways.T).argmax(axis=0)] - other_at[(other_at @ ways.T).argmin(axis=0)]
        aside = between - np.einsum("ij,ij->i", between, ways)[:, None] * ways
        ways = ways - 0.5 * 0.9**turned * aside / np.maximum(np.linalg.norm(aside, axis=1, keepdims=True), 1e-9)
        ways = ways / np.linalg.norm(ways, axis=1, keepdims=True)
        found = min(found, float(((at @ ways.T).max(axis=0) - (other_at @ ways.T).min(axis=0)).min()))
        if found <= 0.0:
            break
    return max(0.0, found)


def rigid_groups(urdf: ET.Element) -> dict[str, str]:
    """Link → the first of the links that fixed joints hold together with it."""
    group = {str(link.get("name")): str(link.get("name")) for link in urdf.findall("link")}
    for joint in urdf.findall("joint"):
        if joint.get("type") == "fixed":
            kept, gone = group[link_of_end(joint, "parent")], group[link_of_end(joint, "child")]
            group = {name: kept if first == gone else first for name, first in group.items()}
    return group


def pieces_of(link: ET.Element) -> list[tuple[np.ndarray, np.ndarray]]:
    """Points and unit normals of each collision shape of a link: of a mesh those of its faces, else of its box."""
    found = []
    for item in link.findall("collision"):
        pose = pose_of(item)
        for shape in item.findall("geometry/*"):
            points, normals = shape_points(shape, True), np.eye(3)
            if shape.tag == "mesh":
                normals = mesh_normals(Path(shape.get("filename", "")), points)
            elif shape.tag != "box":
                normals = points[:: max(1, len(points) // MOST_NORMALS)]
            sizes = np.linalg.norm(normals, axis=1, keepdims=True)
            normals = np.vstack([normals[sizes[:, 0] > 1e-15] / sizes[sizes[:, 0] > 1e-15], np.eye(3), -np.eye(3)])
            found.append((points @ pose[:3, :3].T + pose[:3, 3], normals @ pose[:3, :3].T))
    return found


def mesh_normals(file: Path, points: np.ndarray) -> np.ndarray:
    """(m, 3) normals of an OBJ's faces with the vertices at these points, outward of their middle, not of unit length;
    at most ``MOST_NORMALS``, of the largest."""
    faces = [
        [int(word.partition("/")[0]) for word in line.split()[1:4]]
        for line in file.read_text("utf-8", "replace").splitlines()
        if line.startswith("f ")
    ]
    if not faces:
        return np.zeros((0, 3))
    numbers = np.array(faces)
    first, second, third = (points[np.where(column > 0, column - 1, column)] for column in numbers.T)
    normals = np.cross(second - first, third - first)
    normals[np.einsum("ij,ij->i", normals, first - points.mean(axis=0)) < 0.0] *= -1.0
    return np.asarray(normals[np.argsort(-np.linalg.norm(normals, axis=1))[:MOST_NORMALS]])
