"""Reading the structured information and the guidance out of a prompt, forgiving whatever is missing or malformed."""

import json
import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import TypeVar

import numpy as np

from asset2sim.physics.arrays import Array, vector
from asset2sim.physics.kinematics import apply, link_to_root, tree_of
from schemas.base import Vector3
from schemas.features import Features, JointFeatures, LinkFeatures

Json = object
Vector = tuple[float, float, float]

_BLOCK = r"<{0}>\s*(.*?)\s*</{0}>"


def read_prompt(text: str) -> tuple[Mapping[str, Json], str]:
    """The structured information (empty if there is none) and the guidance ("" if there is none) of a prompt."""
    information = _decode(_block(text, "structured_information"))
    raw_guidance = _block(text, "user_guidance")
    guidance = _decode(raw_guidance)
    return (
        information if isinstance(information, dict) else {},
        guidance if isinstance(guidance, str) else ("" if guidance is not None else raw_guidance),
    )


@dataclass(frozen=True)
class LinkInfo:
    """One link: sizes in m, volumes in m³ and areas in m², in the root frame at rest and at the authored scale."""

    name: str
    label: str
    box_m: Vector
    center_m: Vector
    volume_m3: float
    hull_volume_m3: float
    volume_source: str
    area_m2: float
    materials: tuple[str, ...]

    @property
    def has_geometry(self) -> bool:
        """Whether the link has a volume or an area."""
        return self.volume_m3 > 0.0 or self.hull_volume_m3 > 0.0 or self.area_m2 > 0.0


@dataclass(frozen=True)
class JointInfo:
    """One movable joint; positions in rad or m. ``closed`` and ``open`` are 0 for a continuous joint."""

    name: str
    type: str
    parent: str
    child: str
    axis: Vector
    lower: float | None
    upper: float | None
    closed: float
    open: float
    open_confidence: float

    @property
    def motion(self) -> str:
        """hinge, slider or spin."""
        return {"prismatic": "slider", "continuous": "spin"}.get(self.type, "hinge")

    @property
    def zero(self) -> float:
        """The authored zero, clamped to the limits."""
        low = -math.inf if self.lower is None else self.lower
        high = math.inf if self.upper is None else self.upper
        return min(max(0.0, low), high) if low <= high else 0.0

    @property
    def range(self) -> float:
        """|open − closed|, rad or m."""
        return abs(self.open - self.closed)

    def opened_by(self, amount: float) -> float:
        """The position that is ``amount`` (rad or m) from closed towards open."""
        return self.closed + math.copysign(min(amount, self.range), self.open - self.closed)


@dataclass(frozen=True)
class ObjectInfo:
    """What the prompt says of one object, at authored scale. ``edges``: (parent, child) of all joints, fixed too."""

    asset_id: str
    category: str
    size_m: Vector
    size_closed_m: Vector
    links: tuple[LinkInfo, ...]
    joints: tuple[JointInfo, ...]
    edges: tuple[tuple[str, str], ...]

    @classmethod
    def from_json(cls, data: Mapping[str, Json]) -> "ObjectInfo":
        """Read the synthesis information; whatever does not fit is left out."""
        size = _vector(data.get("size_m"))
        closed = _vector(data.get("size_closed_m"))
        return cls(
            asset_id=_text(data.get("asset_id")),
            category=_text(data.get("category")),
            size_m=size,
            size_closed_m=closed if max(closed) > 0.0 else size,
            links=_unique(tuple(_link(item) for item in _dicts(data.get("links")))),
            joints=_unique(tuple(_joint(item) for item in _dicts(data.get("joints")) if _movable(item))),
            edges=tuple((_text(item.get("parent")), _text(item.get("child"))) for item in _dicts(data.get("joints"))),
        )

    @cached_property
    def link_by_name(self) -> dict[str, LinkInfo]:
        """Link name → link."""
        return {link.name: link for link in self.links}

    @cached_property
    def joint_by_child(self) -> dict[str, JointInfo]:
        """Child link name → the movable joint that carries it."""
        return {joint.child: joint for joint in self.joints}

    @cached_property
    def parent_of(self) -> dict[str, str]:
        """Link name → its parent link."""
        return {child: parent for parent, child in self.edges}

    @property
    def body(self) -> LinkInfo | None:
        """The largest link that no joint moves, or the largest of all; None if no link has geometry."""
        shaped = [link for link in self.links if link.has_geometry]
        still = [link for link in shaped if link.name not in self.joint_by_child]
        return max(still or shaped, key=lambda link: math.prod(link.box_m), default=None)


@dataclass(frozen=True)
class FocusJoint:
    """A joint under refinement: where it is, where it was asked to be, where it came to rest (None: not watched), the
    positions that earlier refused proposals gave it, and its range; rad or m."""

    name: str
    position: float
    desired: float
    lower: float
    upper: float
    closed: float
    open: float
    settled: float | None = None
    tried: tuple[float, ...] = ()


@dataclass(frozen=True)
class RefinementInfo:
    """What a refinement prompt says: Φ in m and the joints to move."""

    phi_m: float
    joints: tuple[FocusJoint, ...]


def read_refinement(data: Mapping[str, Json]) -> RefinementInfo:
    """Read the refinement information; joints without limits are given a full turn."""
    joints = []
    tried = [places for item in _dicts(data.get("tried")) if isinstance(places := item.get("positions"), dict)]
    for item in _dicts(data.get("focus_joints")):
        position = _number(item.get("position"), 0.0)
        lower, upper = (
            _number(item.get("lower"), -math.pi),
            _number(item.get("upper"), math.pi),
        )
        joints.append(
            FocusJoint(
                name=_text(item.get("name")),
                position=position,
                desired=_number(item.get("desired"), position),
                lower=min(lower, upper),
                upper=max(lower, upper),
                closed=_number(item.get("closed"), lower),
                open=_number(item.get("open"), upper),
                settled=_optional(item.get("settled")),
                tried=tuple(_number(places.get(_text(item.get("name"))), position) for places in tried),
            )
        )
    return RefinementInfo(_number(data.get("phi_m"), 0.0), _unique(tuple(joints)))


_Named = TypeVar("_Named", LinkInfo, JointInfo, FocusJoint)


def _block(text: str, tag: str) -> str:
    found = re.search(_BLOCK.format(tag), text, re.DOTALL)
    return found.group(1) if found else ""


def _decode(text: str) -> Json:
    try:
        return json.loads(text) if text else None
    except (ValueError, RecursionError):
        return None


def _movable(item: Mapping[str, Json]) -> bool:
    return _text(item.get("type")) in ("revolute", "prismatic", "continuous")


def _link(item: Mapping[str, Json]) -> LinkInfo:
    materials = item.get("materials")
    return LinkInfo(
        name=_text(item.get("name")),
        label=_text(item.get("label")),
        box_m=_vector(item.get("box_m")),
        center_m=_vector(item.get("center_m"), signed=True),
        volume_m3=max(_number(item.get("volume_m3"), 0.0), 0.0),
        hull_volume_m3=max(_number(item.get("hull_volume_m3"), 0.0), 0.0),
        volume_source=_text(item.get("volume_source")),
        area_m2=max(_number(item.get("area_m2"), 0.0), 0.0),
        materials=tuple(m for m in materials if isinstance(m, str)) if isinstance(materials, list) else (),
    )


def _joint(item: Mapping[str, Json]) -> JointInfo:
    lower, upper = _optional(item.get("lower")), _optional(item.get("upper"))
    if item.get("type") == "continuous":
        lower = upper = None
    closed = _number(item.get("closed"), lower if lower is not None else 0.0)
    return JointInfo(
        name=_text(item.get("name")),
        type=_text(item.get("type")),
        parent=_text(item.get("parent")),
        child=_text(item.get("child")),
        axis=_vector(item.get("axis"), signed=True),
        lower=lower,
        upper=upper,
        closed=closed,
        open=_number(item.get("open"), upper if upper is not None else closed),
        open_confidence=min(max(_number(item.get("open_confidence"), 0.0), 0.0), 1.0),
    )


def _unique(items: tuple[_Named, ...]) -> tuple[_Named, ...]:
    return tuple({item.name: item for item in items if item.name}.values())


def _dicts(value: Json) -> list[dict[str, Json]]:
    return [item for item in value if isinstance(item, dict)] if isinstance(value, list) else []


def _text(value: Json) -> str:
    return value if isinstance(value, str) else ""


def _optional(value: Json) -> float | None:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    try:
        number = float(value)
    except OverflowError:
        return None
    return number if math.isfinite(number) and abs(number) < 1e6 else None


def _number(value: Json, default: float) -> float:
    number = _optional(value)
    return default if number is None else number


def _vector(value: Json, signed: bool = False) -> Vector:
    if not isinstance(value, Sequence) or isinstance(value, str) or len(value) != 3:
        return (0.0, 0.0, 0.0)
    x, y, z = (_number(item, 0.0) if signed else max(_number(item, 0.0), 0.0) for item in value)
    return (x, y, z)


def closed_size(features: Features) -> Vector3:
    """(3,) edges of the object's box with every joint closed, m; from the links' boxes, so at least the true one.

    Where the closed state is the authored one, it is the exact box of the rest pose.
    """
    closed = {joint.name: joint.closed for joint in features.joints if joint.closed}
    if not closed:
        return features.rest_size
    poses = link_to_root(tree_of(features.joints), features.root, closed)
    corners = [apply(poses[link.name], _corners(link)) for link in features.links if link.has_geometry]
    return vector(np.ptp(np.vstack(corners), axis=0)) if corners else features.rest_size


def link_centers(features: Features) -> dict[str, Vector3]:
    """Link name → the centre of its box at rest in the root link's frame, m; links without geometry are left out."""
    poses = link_to_root(tree_of(features.joints), features.root, {})
    return {
        link.name: vector(apply(poses[link.name], _corners(link)).mean(axis=0))
        for link in features.links
        if link.has_geometry
    }


def _corners(link: LinkFeatures) -> Array:
    """(8, 3) corners of a link's box in its own frame, m."""
    return np.array(list(product(*zip(link.box_min, link.box_max, strict=True))), dtype=float)


def object_info(features: Features) -> ObjectInfo:
    """The object at the authored scale: lengths in m, positions in rad or m."""
    centers = link_centers(features)
    return ObjectInfo(
        asset_id=features.asset_id,
        category=features.category,
        size_m=features.rest_size,
        size_closed_m=closed_size(features),
        links=tuple(_link_of(link, centers.get(link.name, (0.0, 0.0, 0.0))) for link in features.links),
        joints=tuple(_joint_of(joint) for joint in features.movable_joints),
        edges=tuple((joint.parent, joint.child) for joint in features.joints),
    )


def _link_of(link: LinkFeatures, center: Vector3) -> LinkInfo:
    return LinkInfo(
        name=link.name,
        label=link.label,
        box_m=link.box_size,
        center_m=center,
        volume_m3=link.volume_m3,
        hull_volume_m3=link.hull_volume_m3,
        volume_source=link.volume_source.value,
        area_m2=link.area_m2,
        materials=link.materials,
    )


def _joint_of(joint: JointFeatures) -> JointInfo:
    limits = [limit for limit in (joint.lower, joint.upper) if limit is not None]
    turns = joint.type == "continuous"
    return JointInfo(
        name=joint.name,
        type=joint.type,
        parent=joint.parent,
        child=joint.child,
        axis=joint.axis_in_root,
        lower=None if turns else min(limits, default=None),
        upper=None if turns else max(limits, default=None),
        closed=joint.closed or 0.0,
        open=joint.open or 0.0,
        open_confidence=joint.openness_confidence,
    )
