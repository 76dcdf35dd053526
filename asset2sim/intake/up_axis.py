"""Which axis of an asset's file points up, from what it could stand on, its symmetry, its joints and its parts' names.

For each of the six axes, evidence that the object is upright along it (``evidence``) is weighed (``WEIGHTS``) against
the evidence for z. The weights are those of a softmax over the six axes (L2 penalty 0.003), fitted to 178 objects whose
z axis is known to point up: 150 of PartNet-Mobility, 28 of another origin, each category counting as the root of its
number. Fitted to half of them and tried on the other half, none that is right is turned, with names and categories or
without, and none a wrong way; of those that are no things of the hand 65 % are found when they are turned to y up.
Two weights are not fitted: ``trays``, since few of these drawers are open boxes, and ``glTF``, in which none of these
objects is drawn: odds of 3 to 1, since some tools write it with z up.
"""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from asset2sim.assets.extract import Extraction
from asset2sim.assets.urdf.document import known_robot
from asset2sim.assets.urdf.read import element_pose
from asset2sim.guidance.tables import sizes
from asset2sim.physics.arrays import Array
from asset2sim.physics.convex_hull import convex_hull, hull_volume
from asset2sim.physics.kinematics import apply, link_to_root, rigid_links, tree_of
from schemas.features import JointFeatures
from schemas.finding import Finding, remark, warning
from schemas.vocabulary import Stage, UpAxis

AXES: dict[UpAxis, tuple[float, float, float]] = {
    UpAxis.Z: (0.0, 0.0, 1.0), UpAxis.Y: (0.0, 1.0, 0.0), UpAxis.MINUS_Y: (0.0, -1.0, 0.0),
    UpAxis.MINUS_Z: (0.0, 0.0, -1.0), UpAxis.X: (1.0, 0.0, 0.0), UpAxis.MINUS_X: (-1.0, 0.0, 0.0),
}  # fmt: skip
WEIGHTS = {
    "foot": 0.36, "stands": 0.9, "flat": 0.72, "top": 0.73, "sides": 1.55, "upright": 0.83, "level": -1.09,
    "above": 0.51, "drawers": 0.47, "lids": 1.74, "high": 1.88, "low": 2.29, "trays": 2.2, "glTF": 1.2,
}  # fmt: skip
REASONS = {
    "foot": "what it stands on is large", "stands": "it stands on it without tipping", "flat": "its height",
    "top": "top and bottom differ", "sides": "its sides are alike", "upright": "its hinges are upright",
    "level": "few of its hinges are level", "above": "its parts hang from or stand on their hinges",
    "drawers": "its drawers slide level",
    "lids": "its lids turn about level axes", "trays": "its drawers are open above", "glTF": "its meshes are glTF's",
    "high": "its top, lids and seats are high", "low": "its base, legs and wheels are low",
}  # fmt: skip
"""What each kind of evidence says, in a finding's words."""
SHAPE = ("foot", "stands", "flat")
"""Evidence from what the object would stand on ..."""
MOST_SHAPE = 1.5
"""... which alone turns nothing: what is screwed to a wall does not stand either."""
UNUSUAL = {UpAxis.MINUS_Y: 3.0, UpAxis.MINUS_Z: 3.0, UpAxis.X: 2.5, UpAxis.MINUS_X: 2.5}
"""Evidence that these axes need beyond y, which glTF, Unity and animation tools have up: files with them are rare."""
LEAST_EVIDENCE, LEAST_NAMELESS = 1.5, 2.25
"""Log odds from which an object is turned whose parts have names that say what they are, and one whose have not. Of the
178 objects that are right the most doubtful has 1.1 with its names; with names and category withheld it has 2.05."""
DOUBT = 0.75
"""Log odds from which an object that is left as it is may lie: 2 of the 149 that are right and no hand tools."""

TOUCHING = 0.01
"""Height over the lowest point, as a share of the object's diagonal, within which points stand on the floor."""
STANDING = 0.02
"""Distance of the middle within the edge of what it stands on from which it counts as standing, as that share."""
ALIKE = 0.01
"""Mean distance between an object and its mirror image, as that share, at which their likeness is 1/e."""
MOST_POINTS = 6_000
"""Points that are mirrored; of more, every n-th."""
LEVEL, UPRIGHT = 0.3, 0.9
"""|axis · up| up to which a joint's axis counts as level, and from which as upright."""
LARGE_HINGED, LARGE_SLIDING, TRAVEL = 0.25, 0.2, 0.1
"""Diagonal of a part over the object's from which it is a door, lid or drawer, and a drawer's least travel over it."""
TRAY = 0.1
"""Distance of the middle of a drawer's walls below that of its box, over its height: half of an open box's."""
DISC = 0.3
"""Extent of a part along its axis over its largest across, below which it turns as a wheel or a clock's hand does."""
GLTF = (".glb", ".gltf")
LIDS = {"lid", "screen", "cover"}
HIGH = {*LIDS, "seat", "top", "cap", "pump", "hood", "back", "backrest", "armrest", "tabletop", "roof"}
LOW = {"wheel", "caster", "leg", "pad", "foot", "base", "stand", "pedal"}
"""Words in labels, or where there is none in names, of parts that are at an object's top or bottom ..."""
TELLING = {*HIGH, *LOW, "door", "drawer", "shelf", "tray", "button", "knob", "handle"}
"""... and of parts by which one knows what one sees."""

WHICH = re.compile(
    r"(?<![a-z])(top|base|back)[ _-]+(?=(basket|rack|drawer|door|shelf|tray|button|knob|handle|cabinet))"
)


def find_up(extraction: Extraction) -> tuple[UpAxis, Finding | None]:
    """The axis that points up in an asset's file, and a finding where it is not z, or may not be. Things that are put
    down on any side (a knife, a camera) are left as they are, and so is what a format of simulators says, in all
    of which z is up, and what its file itself turns from y up to z up."""
    known = sizes().get(extraction.features.category)
    if known is not None and known.lies:
        return UpAxis.Z, None
    seen = RestingShape.of(extraction)
    found = {up: evidence(seen, np.array(axis)) for up, axis in AXES.items()}
    gains = {up: gain(found[up], found[UpAxis.Z]) for up in AXES if up is not UpAxis.Z}
    odds = {up: sum(terms.values()) - UNUSUAL.get(up, 0.0) for up, terms in gains.items()}
    best = max(odds, key=lambda up: odds[up])
    least = LEAST_EVIDENCE if any(words & TELLING for words, _ in seen.named) else LEAST_NAMELESS
    if odds[best] < DOUBT:
        return UpAxis.Z, None
    reasons = sorted(REASONS, key=lambda name: -gains[best].get(name, 0.0))[:3]
    said = ", ".join(REASONS[name] for name in reasons if gains[best].get(name, 0.0) > 0.0)
    weight_ = f"log odds {odds[best]:.2g}, sure from {least} on: {said}"
    opened = extraction.opened
    by_format = opened is not None and bool(opened.metric_format)
    raised = raised_by_file(extraction)
    turned = odds[best] >= least and not by_format and not raised
    if turned:
        say, code = warning, "turned_upright"
        message = f"its file has {best} up ({weight_}); it is turned upright: if that is wrong, state --up=z"
    else:
        say, code = remark, "up_doubtful"
        says = "its format has z up" if by_format else "its file turns y up into z up"
        why = f"{says}, and it is left" if odds[best] >= least else "it is left"
        message = f"its file may have {best} up ({weight_}); {why} as it is: if it lies, state --up={best}"
    finding = say(Stage.EXTRACT, code, f"{message}, or `up` in the manifest", value=odds[best], limit=least)
    return (best if turned else UpAxis.Z), finding


def raised_by_file(extraction: Extraction) -> bool:
    """Whether all fixed joints on a root without a shape turn y up into z up, as in PartNet-Mobility's files."""
    features = extraction.features
    fixed = {joint.name for joint in features.joints if joint.type == "fixed" and joint.parent == features.root}
    turns = [node.child_to_parent[:3, 1] for node in tree_of(features.joints) if node.name in fixed]
    return not features.link(features.root).has_geometry and bool(turns) and all(y[2] > UPRIGHT for y in turns)


def gain(found: dict[str, float], usual: dict[str, float]) -> dict[str, float]:
    """Evidence that each kind adds for one axis over that for z, in log odds; that of the shape is limited."""
    terms = {name: weight * (found[name] - usual[name]) for name, weight in WEIGHTS.items()}
    shape = sum(terms[name] for name in SHAPE)
    if shape > MOST_SHAPE:
        terms |= {name: terms[name] * MOST_SHAPE / shape for name in SHAPE}
    return terms


@dataclass(frozen=True)
class PartPoints:
    """Part that one joint moves: its (n, 3) points at rest in the root's frame, its words, where its axis passes, and
    the (3,) middle of the walls of its first link."""

    joint: JointFeatures
    points: Array
    at: Array
    walls: Array
    words: frozenset[str]


@dataclass(frozen=True)
class RestingShape:
    """An object at rest in its root's frame: (n, 3) points, the (3,) middle of its walls, its diagonal (m), how alike
    it is to its mirror images across x, y and z (0 to 1), its moving parts, its links' words with their points, and the
    (3,) axis that its meshes have up by their format, zero where that says none."""

    points: Array
    middle: Array
    diagonal: float
    alike: Array
    parts: tuple[PartPoints, ...]
    named: tuple[tuple[frozenset[str], Array], ...]
    drawn_up: Array

    @classmethod
    def of(cls, extraction: Extraction) -> "RestingShape":
        """The resting shape of an extraction."""
        features = extraction.features
        tree = tree_of(features.joints)
        rest = link_to_root(tree, features.root, {})
        clouds = {
            name: apply(rest[name], item.points) for name, item in extraction.geometry.items() if len(item.points)
        }
        meshes = [(name, part) for name in clouds for part in extraction.geometry[name].parts]
        drawn = [(name, piece) for name, part in meshes for piece in (*part.pieces, part.sheet) if piece is not None]
        points = np.vstack([apply(rest[name], piece) for name, piece in drawn] or list(clouds.values()))
        low, high = points.min(axis=0), points.max(axis=0)
        diagonal = float(np.linalg.norm(high - low))
        areas = np.array([max(features.link(name).outer_m2, 1e-12) for name in clouds])
        centers = np.vstack([apply(rest[name], np.array([features.link(name).shell_center])) for name in clouds])
        parts, nodes = [], {node.name: node for node in tree}
        for joint in features.movable_joints:
            node = nodes[joint.name]
            moved = [clouds[name] for name in rigid_links(tree, joint.name) if name in clouds]
            if moved:
                at = (rest[joint.parent] @ node.child_to_parent)[:3, 3]
                child = features.link(joint.child)
                walls = apply(rest[joint.child], np.array([child.shell_center]))[0]
                parts.append(PartPoints(joint, np.vstack(moved), at, walls, words_of(child.label, joint.child)))
        named = tuple((words_of(features.link(name).label, name), cloud) for name, cloud in clouds.items())
        middle = (areas[:, None] * centers).sum(axis=0) / areas.sum()
        alike = likeness(points, (low + high) / 2.0, diagonal)
        return cls(points, middle, diagonal, alike, tuple(parts), named, drawn_up(extraction.urdf, rest))


def drawn_up(urdf: Path, rest: Mapping[str, Array]) -> Array:
    """(3,) axis of the root's frame that is up in all meshes that are drawn, which is y in glTF; zero where some are of
    other formats, or turned another way."""
    ways = []
    for link in known_robot(urdf).findall("link"):
        for visual in link.findall("visual"):
            mesh = visual.find("geometry/mesh")
            if mesh is None:
                continue
            if Path(str(mesh.get("filename"))).suffix.lower() not in GLTF:
                return np.zeros(3)
            ways.append((rest[str(link.get("name"))] @ element_pose(visual))[:3, 1])
    found = np.array(ways)
    return found[0] if ways and np.all(found @ found[0] > UPRIGHT) else np.zeros(3)


def words_of(label: str, name: str) -> frozenset[str]:
    """The words of a label, or where there is none of a name, without those that tell one part from its like: the top
    basket is not the top."""
    return frozenset(re.findall(r"[a-z]+", WHICH.sub("", (label or name).lower())))


def likeness(points: Array, middle: Array, diagonal: float) -> Array:
    """(3,) how alike the points are to their mirror image across each axis, 0 to 1."""
    some = points[:: -(-len(points) // MOST_POINTS)]
    near = cKDTree(some)
    found = []
    for axis in range(3):
        mirrored = some.copy()
        mirrored[:, axis] = 2.0 * middle[axis] - mirrored[:, axis]
        found.append(np.exp(-float(np.mean(near.query(mirrored)[0])) / (ALIKE * diagonal)))
    return np.array(found)


def evidence(seen: RestingShape, up: Array) -> dict[str, float]:
    """Evidence for the (3,) axis pointing up, by name; each is a number of the order of one."""
    heights = seen.points @ up
    floor, high = float(heights.min()), float(heights.max())
    across = np.eye(3)[np.abs(up) < 0.5]
    flat = seen.points @ across.T
    footing = flat[heights < floor + TOUCHING * seen.diagonal]
    own = int(np.argmax(np.abs(up)))
    found = {
        "foot": float(np.log(hull_volume(footing) / max(hull_volume(flat), 1e-12) + 0.02)),
        "stands": float(inside(footing, across @ seen.middle) > STANDING * seen.diagonal),
        "flat": (high - floor) / seen.diagonal,
        "top": 1.0 - float(seen.alike[own]),
        "sides": float(np.delete(seen.alike, own).max()),
    }
    found |= joint_evidence(seen, up) | {"glTF": float(seen.drawn_up @ up > UPRIGHT)}
    share: dict[str, list[float]] = {"high": [], "low": []}
    # A single wheel is as likely turned by a hand as it carries anything.
    low_words = LOW if sum("wheel" in words for words, _ in seen.named) > 1 else LOW - {"wheel"}
    for words, points in seen.named:
        place = ((points.min(axis=0) + points.max(axis=0)) @ up / 2.0 - floor) / max(high - floor, 1e-12) - 0.5
        if words & low_words:
            share["low"].append(-place)
        elif words & HIGH:
            share["high"].append(place)
    return found | {name: float(np.mean(places)) if places else 0.0 for name, places in share.items()}


def joint_evidence(seen: RestingShape, up: Array) -> dict[str, float]:
    """Evidence of the joints: doors turn about upright axes, lids about level ones, drawers slide level and are open
    above."""
    count = dict.fromkeys(("upright", "level", "above", "drawers", "lids", "trays"), 0.0)
    deep = []
    for part in seen.parts:
        axis, extent = np.array(part.joint.axis_in_root), np.ptp(part.points, axis=0)
        size, along = float(np.linalg.norm(extent)) / seen.diagonal, abs(float(axis @ up))
        if part.joint.prismatic:
            travel = abs((part.joint.upper or 0.0) - (part.joint.lower or 0.0)) / seen.diagonal
            if travel > TRAVEL and size > LARGE_SLIDING:
                count["drawers"] -= along
                box = (part.points.min(axis=0) + part.points.max(axis=0)) / 2.0
                deep.append(float((box - part.walls) @ up / max(extent @ np.abs(up), 1e-12)) if along < LEVEL else 0.0)
            continue
        if part.joint.type == "revolute" and part.words & LIDS:
            count["lids"] += float(along < LEVEL) - along
        # What turns for ever or as a disc does is a wheel, a knob, a clock's hand, a turntable: any axis may be right.
        if part.joint.type != "continuous" and size > LARGE_HINGED and not is_disc(part.points, axis):
            arm = (part.points.min(axis=0) + part.points.max(axis=0)) / 2.0 - part.at
            arm = arm - axis * float(axis @ arm)
            length = float(np.linalg.norm(arm))
            count["upright"] += float(along > UPRIGHT)
            if along < LEVEL and length > 1e-6 * seen.diagonal:
                count["level"] += 1.0
                count["above"] += float(arm @ up) / length
    count["trays"] = float(np.mean(deep)) / TRAY if deep else 0.0
    return {name: float(np.tanh(value)) for name, value in count.items()}


def is_disc(points: Array, axis: Array) -> bool:
    """Whether a part is thin along the axis about which it turns."""
    beside = np.linalg.svd(axis[None, :])[2][1:]
    return bool(np.ptp(points @ axis) < DISC * np.ptp(points @ beside.T, axis=0).max())


def inside(points: Array, place: Sequence[float] | Array) -> float:
    """The distance of a (2,) place within the convex hull of (n, 2) points; negative outside, and without a hull."""
    hull = convex_hull(points)
    return -1.0 if hull is None else float(-(hull.equations[:, :2] @ np.asarray(place) + hull.equations[:, 2]).max())
