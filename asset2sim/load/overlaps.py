"""How deep links of an object are in each other at some joint positions, by numpy alone: pieces are taken as convex,
as engines take them."""

import xml.etree.ElementTree as ET
from collections.abc import Iterable, Mapping
from itertools import combinations
from pathlib import Path

import numpy as np

from asset2sim.load.shapes import link_of_end, link_poses, pose_of, shape_points

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
        """Pair of links → how deep they are in each other, m, where they are: at most what the least way apart along a
        normal of theirs is."""
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
