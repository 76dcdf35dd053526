"""Pieces of a housing cut where they stand in a fingertip's way to a key and nothing is drawn there: the hull of a
well's walls, made as thick as a sheet, lies over the keys in it like a lid."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.spatial import ConvexHull

from asset2sim.assets.authored_overlap import AuthoredShapes
from asset2sim.assets.finger_depth import press_ends
from asset2sim.assets.hulls import Hulls
from asset2sim.assets.meshes.patches import piece_of
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import TreeJoint, apply, link_to_root, rigid_links
from asset2sim.refinement.collision.floors import LOST, Floor, free_above, inside_planes, lost_m2
from asset2sim.refinement.collision.trim import CLEARANCE_M, Cut, PlaneCut, trim
from schemas.hand_settings import FINGERTIP_M
from schemas.overlay import JointPhysics

PLACES = 3
"""Places under a fingertip, along each of its sides."""
DIRECTIONS = 16
"""Directions in which a piece is split beside keys."""
ALIKE = 1e-2
"""Rounding of the ways of keys that are looked at together."""


def room_for_presses(
    hulls: Hulls,
    joints: Sequence[JointPhysics],
    tree: Sequence[TreeJoint],
    root: str,
    shapes: AuthoredShapes,
    planes: list[PlaneCut],
) -> tuple[Hulls, list[Cut]]:
    """The hulls, those that bear sprung sliders cut to how deep these go, and the cuts; ``planes`` gets each."""
    found, cuts = dict(hulls), list[Cut]()
    for (housing, part), floor in floors_of_presses(joints, tree, root, shapes).items():
        drawn = drawn_of(shapes, housing).reshape(-1, 3, 3)
        for index, points in enumerate(found.get(housing, ())):
            made = parts_below(found[housing], index, floor, drawn)
            if not made:
                continue
            heights = points @ floor.normal
            depth = float(heights.max()) - floor.height
            planes += made
            cuts.append(Cut(housing, part, depth, depth / float(np.ptp(heights))))
            beside = (cut.left for cut in made[1:-1])
            found[housing] = (*found[housing][:index], made[-1].left, *found[housing][index + 1 :], *beside)
    return (found, cuts) if cuts else (hulls, [])


def ends_of_press(joint: JointPhysics) -> tuple[float, float] | None:
    """Where a sprung slider rests and its further end, m; None for what has no spring, turns, follows or is endless."""
    if joint.type != "prismatic" or joint.stiffness <= 0.0 or joint.mimic is not None:
        return None
    if joint.lower is None or joint.upper is None or joint.lower == joint.upper:
        return None
    return press_ends(joint.spring_reference, joint.lower, joint.upper)


def floors_of_presses(
    joints: Sequence[JointPhysics], tree: Sequence[TreeJoint], root: str, shapes: AuthoredShapes
) -> dict[tuple[str, str], Floor]:
    """(Link, first part mounted on it) → the plane in the link's frame to which the fronts of such parts come that go
    equally deep, with the places under a fingertip on the middle of each."""
    rests = {joint.name: ends for joint in joints if (ends := ends_of_press(joint)) is not None}
    poses = link_to_root(tree, root, {name: rest for name, (rest, _) in rests.items()}) if rests else {}
    groups: dict[tuple[str, tuple[float, ...]], list[tuple[str, Array, float, Array]]] = {}
    steps = FINGERTIP_M * ((np.arange(PLACES) + 0.5) / PLACES - 0.5)
    tip = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    for joint in tree:
        if joint.name not in rests:
            continue
        rest, far = rests[joint.name]
        to_housing = np.linalg.inv(poses[joint.parent])
        links = rigid_links(tree, joint.name)
        part = np.vstack([apply(to_housing @ poses[link], drawn_of(shapes, link)) for link in links])
        if not len(part):
            continue
        way = np.sign(far - rest) * joint.child_to_parent[:3, :3] @ joint.axis
        across, deep = np.linalg.svd(way[None])[2][1:], float((part @ way).min()) + abs(far - rest) + CLEARANCE_M
        flat = part @ across.T
        places = ((flat.min(axis=0) + flat.max(axis=0)) / 2.0 + tip) @ across + deep * way
        key = (joint.parent, tuple(np.round([*(way / ALIKE), deep / CLEARANCE_M])))
        groups.setdefault(key, []).append((joint.child, way, deep, places))
    found = {}
    for (housing, _), own in groups.items():
        first, way, deep, _ = max(own, key=lambda item: item[2])
        places = np.vstack([item[3] for item in own])
        found[housing, first] = Floor(-way, -deep, places, (FINGERTIP_M / PLACES) ** 2)
    return found


def drawn_of(shapes: AuthoredShapes, link: str) -> Array:
    """(3 n, 3) corners of a link's triangles in its frame at the final scale, three by three."""
    read = shapes.read(link)
    return np.zeros((0, 3)) if read is None else shapes.scale * read[0][read[1]].reshape(-1, 3)


def parts_below(hulls: Sequence[Array], index: int, floor: Floor, drawn: Array) -> list[PlaneCut]:
    """The cuts that take one of a link's hulls down to a floor over which it stands where nothing of the (n, 3, 3)
    triangles is, the last one's the part that is left below; where that would lose what is drawn elsewhere, it is split
    beside the places first, and the second cut's is the part that stays as it is. None for one that stays."""
    hull, heights = hulls[index], hulls[index] @ floor.normal - floor.height
    if heights.max() <= CLEARANCE_M or heights.min() >= 0.0:
        return []
    low, piece = CLEARANCE_M * floor.normal, piece_of(hull, 0.0)
    covered = inside_planes(ConvexHull(piece.points).equations, floor.places + low)
    if not covered.any():
        return []
    over = drawn[(drawn @ floor.normal - floor.height).max(axis=1) > CLEARANCE_M]
    free = replace(floor, places=floor.places[covered])
    area = float((free_above(free, over) > heights.max()).sum()) * floor.each_m2
    if area == 0.0:
        return []
    planes = [ConvexHull(points).equations for points in hulls]

    def loses(part: Array) -> float:
        known = [*planes[:index], ConvexHull(part).equations, *planes[index + 1 :]]
        return lost_m2(index, known, piece_of(part, 0.0), floor, over, CLEARANCE_M)

    splits, near = list[PlaneCut](), hull
    if loses(hull) > LOST * area:
        splits = min(splits_beside(hull, free), key=lambda split: loses(split[0].left), default=[])
        if not splits or loses(splits[0].left) > LOST * area:
            return []
        near = splits[0].left
    left = trim(near, -floor.normal, -floor.height)
    return [] if left is None else [*splits, PlaneCut(near, left, -floor.normal, -floor.height)]


def splits_beside(hull: Array, floor: Floor) -> list[list[PlaneCut]]:
    """A hull cut square to a floor beside all of its places, in each direction: the part over them, and the rest."""
    found, half = list[list[PlaneCut]](), FINGERTIP_M / PLACES / 2.0
    first, second = np.linalg.svd(floor.normal[None])[2][1:]
    for angle in 2.0 * np.pi * np.arange(DIRECTIONS) / DIRECTIONS:
        away = np.cos(angle) * first + np.sin(angle) * second
        offset = float((floor.places @ away).max()) + half
        near, far = trim(hull, -away, -offset), trim(hull, away, offset)
        if near is not None and far is not None and near is not hull:
            found.append([PlaneCut(hull, near, -away, -offset), PlaneCut(hull, far, away, offset)])
    return found
