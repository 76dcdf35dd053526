"""An object that moves, ready to be drawn: its triangles, and where its links are at each frame."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import yourdfpy

from asset2sim.assets.surfaces.scene import Scene, load_scene
from asset2sim.assets.surfaces.surface import Surface
from asset2sim.assets.urdf.read import read_urdf, root_of, tree_joint
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import TreeJoint, link_to_root, parents_first
from asset2sim.render.camera import Singles
from asset2sim.render.faces import Faces, faces_of
from asset2sim.report.loops.record import LoopMotion

WIDEST = 4.0 * math.pi
"""Widest range of a joint, rad or m, that counts as one: beyond it URDFs mean that there is no limit."""
SAME = 1e-3
"""Difference of two objects' corners, as a share of their size, up to which they are drawn from the same triangles."""


@dataclass(frozen=True, eq=False)
class LoopFigure:
    """An object and how it is drawn. ``scene`` is as it was read; ``faces`` are of the object, or of one of the same
    shape that is ``scale`` times as large, in the root frame, where the links of that are at ``links_to_root``.
    ``size_m`` is the longest edge of its box as it was read, m; ``limits`` the (lower, upper) of joints that have any,
    rad or m."""

    tree: tuple[TreeJoint, ...]
    root: str
    limits: dict[str, tuple[float, float]]
    scene: Scene
    faces: Faces
    links_to_root: dict[str, Array]
    size_m: float
    scale: float = 1.0

    def placed(self, recording: LoopMotion) -> Array:
        """(frames, links, 4, 4) transforms of its triangles to the recording's world, m."""
        poses = link_poses(self.tree, self.root, recording.joints, len(recording.root))
        shrink = np.diag([1.0 / self.scale] * 3 + [1.0])
        links = [poses[link] @ (shrink @ np.linalg.inv(self.links_to_root[link])) for link in self.faces.links]
        return np.asarray(recording.root[:, None] @ np.stack(links, axis=1))

    def normalised(self, placed: Array, *, floor: bool) -> Singles:
        """(frames, links, 3, 4) of such transforms, to a world in which the object is one unit long, starts about the
        origin, and stands on z = 0: the recording's plane, or with ``floor``, wherever its lowest point is at first."""
        points = self.spanned(placed[:1])
        low, high = points.min(axis=0), points.max(axis=0)
        moved = placed[..., :3, :] / self.size_m
        moved[..., :2, 3] -= 0.5 * (low + high)[:2] / self.size_m
        if floor:
            moved[..., 2, 3] -= low[2] / self.size_m
        return np.asarray(moved, dtype=np.float32)

    def in_link(self, surface: Surface, link: str) -> Array:
        """(n, 3) vertices of a surface as read, in its link's frame, m; before other triangles take their place."""
        to_root = self.links_to_root[link]
        return np.asarray((surface.vertices - to_root[:3, 3]) @ to_root[:3, :3])

    def spanned(self, transforms: Array | Singles) -> Array:
        """(n, 3) points that span the object in all frames of (frames, links, 3 or 4, 4) transforms."""
        return np.asarray(np.einsum("fljk,lpk->flpj", transforms[..., :3, :], self.faces.extremes).reshape(-1, 3))


def read_figure(urdf: Path, positions: Mapping[str, float], loaded: dict[Path, tuple[Surface, ...]]) -> LoopFigure:
    """A URDF's object, read at these joint positions (rad or m). ``loaded`` remembers mesh files. Raises AssetError as
    ``load_scene`` does."""
    scene = load_scene(urdf, positions, loaded)
    return figure_of(urdf, positions, scene, faces_of(scene))


def read_alike(
    urdf: Path, positions: Mapping[str, float], loaded: dict[Path, tuple[Surface, ...]], other: LoopFigure, scale: float
) -> LoopFigure:
    """As ``read_figure``, drawn from the triangles of the ``other`` object where that has the same, ``scale`` times as
    large: what is drawn of one is drawn of both then."""
    scene = load_scene(urdf, positions, loaded)
    own = figure_of(urdf, positions, scene, other.faces)
    alike = scene.links == other.scene.links and all(
        np.array_equal(mine.faces, theirs.faces)
        and mine.vertices.shape == theirs.vertices.shape
        and np.abs(own.in_link(mine, link) * scale - other.in_link(theirs, link)).max() <= SAME * other.size_m
        for mine, theirs, link in zip(scene.surfaces, other.scene.surfaces, scene.links, strict=True)
    )
    if not alike:
        return replace(own, faces=faces_of(scene))
    return replace(own, links_to_root=other.links_to_root, scale=scale)


def figure_of(urdf: Path, positions: Mapping[str, float], scene: Scene, faces: Faces) -> LoopFigure:
    """The figure of a scene that was read at these joint positions, drawn from these triangles."""
    robot = scene.robot or read_urdf(urdf)
    tree = parents_first([tree_joint(joint) for joint in robot.joints])
    poses = link_to_root(tree, root_of(robot), positions)
    corners = [surface.vertices[surface.faces].reshape(-1, 3) for surface in scene.surfaces]
    low, high = (np.array([of(points, axis=0) for points in corners]) for of in (np.min, np.max))
    size_m = float((high.max(axis=0) - low.min(axis=0)).max())
    return LoopFigure(tree, root_of(robot), limits_of(robot), scene, faces, poses, size_m)


def limits_of(robot: yourdfpy.Robot) -> dict[str, tuple[float, float]]:
    """Joint → (lower, upper) of those whose URDF gives them a range that can be shown, rad or m."""
    found = {}
    for joint in robot.joints:
        limit = joint.limit
        if joint.type in ("revolute", "prismatic") and limit is not None and None not in (limit.lower, limit.upper):
            lower, upper = float(limit.lower), float(limit.upper)
            if 0.0 <= upper - lower <= WIDEST:
                found[joint.name] = (lower, upper)
    return found


def link_poses(tree: Sequence[TreeJoint], root: str, joints: Mapping[str, Array], frames: int) -> dict[str, Array]:
    """Link → (frames, 4, 4) link-to-root transforms at (frames,) joint positions, rad or m, as ``link_to_root``."""
    each = [
        link_to_root(tree, root, {name: float(at[frame]) for name, at in joints.items()}) for frame in range(frames)
    ]
    return {link: np.stack([poses[link] for poses in each]) for link in (root, *(joint.child for joint in tree))}


def sweep(figure: LoopFigure, start: Mapping[str, float], names: Sequence[str], frames: int, least: int) -> LoopMotion:
    """Its joints moved one after another, from ``start`` to one end of the range and back, then to the other and back,
    the root held. Where there are many they overlap, so that each has ``least`` of the frames."""
    still = {name: np.full(frames, value) for name, value in start.items()}
    each = max(frames // max(len(names), 1), least)
    moved, sliders = {}, {joint.name for joint in figure.tree if joint.type == "prismatic"}
    for number, name in enumerate(names):
        at = start.get(name, 0.0)
        reach = 0.5 * figure.size_m if name in sliders else math.pi
        lower, upper = figure.limits.get(name, (at - reach, at + reach))
        first = round(number * (frames - each) / max(len(names) - 1, 1))
        path = np.full(frames, at)
        path[first : first + each] = swept(min(max(at, lower), upper), lower, upper, each)
        moved[name] = path
    return LoopMotion(np.tile(np.eye(4), (frames, 1, 1)), still | moved)


def swept(start: float, lower: float, upper: float, frames: int) -> Array:
    """(frames,) positions from ``start`` to one end and back, then to the other and back, slow at each. The way back is
    through the positions of the way there, which are drawn once."""
    found = np.full(frames, start)
    half = (frames - 1) // 2
    down = round(half * (start - lower) / max(upper - lower, 1e-12))
    for first, steps, end in ((0, down, lower), (2 * down, half - down, upper)):
        share = 0.5 - 0.5 * np.cos(np.linspace(0.0, math.pi, steps + 1))
        there = start + share * (end - start)
        found[first : first + 2 * steps + 1] = np.concatenate([there, there[-2::-1]])
    return found
