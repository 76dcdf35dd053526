"""Pairs of links that slide side by side and never meet: the keys of a keyboard, the buttons of a remote control.

PyBullet solves a contact for every two parts closer than a step of free fall, and each costs it in proportion to the
joints: on a keyboard of 115 keys such contacts, none of which ever bears anything, were nine tenths of a step.
"""

from collections import defaultdict
from collections.abc import Sequence
from functools import lru_cache
from itertools import combinations
from pathlib import Path

import numpy as np

from asset2sim.assets.urdf.collision_points import shape_points
from asset2sim.assets.urdf.document import parsed_root
from asset2sim.assets.urdf.read import element_joint
from asset2sim.physics.arrays import Array
from asset2sim.physics.convex_hull import convex_hull
from asset2sim.physics.kinematics import apply

PARALLEL = 1e-9
"""Largest difference of two unit axes that count as parallel: along 0.1 m they part by a tenth of a nanometre."""
NEAR_M = 0.03
"""Distance of two parts beyond which no engine makes contacts, m: a step at 60 Hz of a fall ends 20 mm further."""

Outline = tuple[Array, Array, Array]
"""A convex outline in the plane across an axis: its (n, 2) corners, and (m, 2) outward normals and (m,) offsets of its
sides, a point x being inside where normal · x + offset is at most 0."""


def never_meeting(urdf: Path, gap_m: float) -> tuple[tuple[str, str], ...]:
    """Pairs of links that slide on one link along parallel axes, and whose collision shapes, seen along these, are more
    than ``gap_m`` apart: nothing that their joints do brings them closer. Only neighbours are named."""
    shapes = [
        urdf.parent / str(mesh.get("filename")) for mesh in parsed_root(urdf).iterfind("link/collision/geometry/mesh")
    ]
    return _known(urdf, urdf.read_bytes(), tuple(hash(file.read_bytes()) for file in shapes if file.is_file()), gap_m)


@lru_cache(maxsize=8)
def _known(urdf: Path, content: bytes, shapes: tuple[int, ...], gap_m: float) -> tuple[tuple[str, str], ...]:
    """The pairs of a URDF of this content and with shapes of these hashes: an object is loaded several times."""
    robot = parsed_root(urdf)
    beside: dict[tuple[str, tuple[float, ...]], list[tuple[str, Array]]] = defaultdict(list)
    for joint in (element_joint(element) for element in robot.findall("joint")):
        if joint.type == "prismatic":
            axis = joint.child_to_parent[:3, :3] @ joint.axis
            axis = axis if axis[np.abs(axis).argmax()] > 0.0 else -axis
            known = (key for key in beside if key[0] == joint.parent and np.abs(axis - key[1]).max() <= PARALLEL)
            key = next(known, (joint.parent, tuple(axis.tolist())))
            beside[key].append((joint.child, joint.child_to_parent))
    links = {str(element.get("name")): element for element in robot.findall("link")}
    found: list[tuple[str, str]] = []
    for (_, along), sliders in beside.items():
        if len(sliders) > 1:
            across = np.linalg.svd(np.array([along]))[2][1:]
            placed = {
                name: outlines([apply(pose, points) @ across.T for points in shape_points(links[name], urdf.parent)])
                for name, pose in sliders
            }
            found += [(a, b) for a, b in combinations(placed, 2) if line_between(placed[a], placed[b], gap_m)]
    return tuple(found)


def outlines(pieces: Sequence[Array]) -> tuple[Outline, ...] | None:
    """The outlines of pieces of (n, 2) points; None where one has no area, or there is none."""
    found = []
    for points in pieces:
        hull = convex_hull(points)
        if hull is None:
            return None
        found.append((points[hull.vertices], hull.equations[:, :2], hull.equations[:, 2]))
    return tuple(found) or None


def line_between(one: tuple[Outline, ...] | None, other: tuple[Outline, ...] | None, gap_m: float) -> bool:
    """Whether two parts are neighbours with a gap of that width between any two pieces, along a side of either."""
    if one is None or other is None:
        return False
    boxes = [[(corners.min(axis=0), corners.max(axis=0)) for corners, _, _ in part] for part in (one, other)]
    near = any(np.all(a[0] - NEAR_M <= b[1]) and np.all(b[0] - NEAR_M <= a[1]) for a in boxes[0] for b in boxes[1])
    return near and all(max(clearance(a, b), clearance(b, a)) > gap_m for a in one for b in other)


def clearance(outline: Outline, other: Outline) -> float:
    """How far beyond a side of an outline the whole of another lies, for the side that it is farthest from, m."""
    _, normals, offsets = outline
    return float((other[0] @ normals.T + offsets).min(axis=0).max())
