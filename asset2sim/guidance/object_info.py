"""The structured information and the guidance as a prompt states them. What our own prompts leave out has its default;
a text without them is of an object of which nothing is known."""

import json
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

Vector = tuple[float, float, float]
NOWHERE: Vector = (0.0, 0.0, 0.0)
_MOVABLE = ("revolute", "prismatic", "continuous")
_BLOCK = r"<{0}>\s*(.*?)\s*</{0}>"


def read_prompt(text: str) -> tuple[Mapping[str, Any], str]:
    """The structured information (empty if there is none) and the guidance ("" if there is none) of a prompt."""
    information = decoded(_block(text, "structured_information"))
    raw_guidance = _block(text, "user_guidance")
    guidance = decoded(raw_guidance)
    return (
        information if isinstance(information, dict) else {},
        guidance if isinstance(guidance, str) else ("" if guidance is not None else raw_guidance),
    )


@dataclass(frozen=True)
class LinkInfo:
    """One link: sizes in m, volumes in m³ and areas in m², in the root frame at rest and at the authored scale; what
    covers it in words, what covers most first."""

    name: str
    label: str
    box_m: Vector
    center_m: Vector
    volume_m3: float
    hull_volume_m3: float
    outer_m2: float
    covers: tuple[str, ...] = ()

    @property
    def has_geometry(self) -> bool:
        """Whether the link has a volume or an area."""
        return self.volume_m3 > 0.0 or self.hull_volume_m3 > 0.0 or self.outer_m2 > 0.0


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
    """Facts of the prompt on one object, at authored scale. ``edges``: (parent, child) of all joints, fixed too."""

    asset_id: str
    category: str
    size_m: Vector
    size_closed_m: Vector
    links: tuple[LinkInfo, ...]
    joints: tuple[JointInfo, ...]
    edges: tuple[tuple[str, str], ...]
    lengths: str = ""
    """Why its lengths are metres already; empty where nothing says so."""
    hangs: str = ""
    """Why its shape is that of a thing that hangs on a wall; empty where it is not."""

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> "ObjectInfo":
        """The object of the synthesis information."""
        size, joints = tuple(data.get("size_m", NOWHERE)), data.get("joints", ())
        closed = tuple(data.get("size_closed_m", NOWHERE))
        return cls(
            asset_id=data.get("asset_id") or "",
            category=data.get("category") or "",
            size_m=size,
            size_closed_m=closed if max(closed) > 0.0 else size,
            links=tuple(map(_link, data.get("links", ()))),
            joints=tuple(_joint(item) for item in joints if item["type"] in _MOVABLE),
            edges=tuple((item["parent"], item["child"]) for item in joints),
            lengths=data.get("lengths", ""),
            hangs=data.get("made_to_hang", ""),
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


def _block(text: str, tag: str) -> str:
    found = re.search(_BLOCK.format(tag), text, re.DOTALL)
    return found.group(1) if found else ""


def decoded(text: str) -> Any:
    """The JSON value of a text; None where it has none."""
    try:
        return json.loads(text) if text else None
    except (ValueError, RecursionError):
        return None


def _link(item: Mapping[str, Any]) -> LinkInfo:
    return LinkInfo(
        name=item["name"],
        label=item.get("label", ""),
        box_m=tuple(item.get("box_m", NOWHERE)),
        center_m=tuple(item.get("center_m") or NOWHERE),
        volume_m3=item.get("volume_m3", 0.0),
        hull_volume_m3=item.get("hull_volume_m3", 0.0),
        outer_m2=item.get("outer_m2", item.get("area_m2", 0.0)),
        covers=tuple(item.get("materials", ())),
    )


def _joint(item: Mapping[str, Any]) -> JointInfo:
    limited = item["type"] != "continuous"
    lower, upper = (item.get(key) if limited else None for key in ("lower", "upper"))
    closed, opened = item.get("closed"), item.get("open")
    closed = closed if closed is not None else lower or 0.0
    return JointInfo(
        name=item["name"],
        type=item["type"],
        parent=item["parent"],
        child=item["child"],
        axis=tuple(item.get("axis", NOWHERE)),
        lower=lower,
        upper=upper,
        closed=closed,
        open=opened if opened is not None else closed if upper is None else upper,
        open_confidence=item.get("open_confidence", 0.0),
    )
