"""Reading the structured information and the guidance out of a prompt, forgiving whatever is missing or malformed."""

import json
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Protocol, TypeVar

Json = object
Vector = tuple[float, float, float]


class Named(Protocol):
    """Anything with a name."""

    @property
    def name(self) -> str:
        """The name."""


_Named = TypeVar("_Named", bound=Named)
_MOVABLE = ("revolute", "prismatic", "continuous")
_BLOCK = r"<{0}>\s*(.*?)\s*</{0}>"


def read_prompt(text: str) -> tuple[Mapping[str, Json], str]:
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

    @classmethod
    def from_json(cls, data: Mapping[str, Json]) -> "ObjectInfo":
        """Read the synthesis information; whatever does not fit is left out."""
        size = _vector(data.get("size_m"))
        closed = _vector(data.get("size_closed_m"))
        joints = dicts(data.get("joints"))
        return cls(
            asset_id=text_or_empty(data.get("asset_id")),
            category=text_or_empty(data.get("category")),
            size_m=size,
            size_closed_m=closed if max(closed) > 0.0 else size,
            links=unique(_link(item) for item in dicts(data.get("links"))),
            joints=unique(_joint(item) for item in joints if item.get("type") in _MOVABLE),
            edges=tuple((text_or_empty(item.get("parent")), text_or_empty(item.get("child"))) for item in joints),
            lengths=text_or_empty(data.get("lengths")),
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


def decoded(text: str) -> Json:
    """The JSON value of a text; None where it has none."""
    try:
        return json.loads(text) if text else None
    except (ValueError, RecursionError):
        return None


def _link(item: Mapping[str, Json]) -> LinkInfo:
    area, covers = max(finite_number(item.get("area_m2"), 0.0), 0.0), item.get("materials")
    return LinkInfo(
        name=text_or_empty(item.get("name")),
        label=text_or_empty(item.get("label")),
        box_m=_vector(item.get("box_m")),
        center_m=_vector(item.get("center_m"), signed=True),
        volume_m3=max(finite_number(item.get("volume_m3"), 0.0), 0.0),
        hull_volume_m3=max(finite_number(item.get("hull_volume_m3"), 0.0), 0.0),
        outer_m2=max(finite_number(item.get("outer_m2"), area), 0.0),
        covers=tuple(word for word in covers if isinstance(word, str)) if isinstance(covers, list | tuple) else (),
    )


def _joint(item: Mapping[str, Json]) -> JointInfo:
    lower, upper = number_or_none(item.get("lower")), number_or_none(item.get("upper"))
    if item.get("type") == "continuous":
        lower = upper = None
    closed = finite_number(item.get("closed"), lower if lower is not None else 0.0)
    return JointInfo(
        name=text_or_empty(item.get("name")),
        type=text_or_empty(item.get("type")),
        parent=text_or_empty(item.get("parent")),
        child=text_or_empty(item.get("child")),
        axis=_vector(item.get("axis"), signed=True),
        lower=lower,
        upper=upper,
        closed=closed,
        open=finite_number(item.get("open"), upper if upper is not None else closed),
        open_confidence=min(max(finite_number(item.get("open_confidence"), 0.0), 0.0), 1.0),
    )


def unique(items: Iterable[_Named]) -> tuple[_Named, ...]:
    """The items of different names; of several of one name the last, in the place of the first."""
    return tuple({item.name: item for item in items if item.name}.values())


def dicts(value: Json) -> list[dict[str, Any]]:
    """The objects in a list; empty where it is none."""
    return [item for item in value if isinstance(item, dict)] if isinstance(value, list) else []


def text_or_empty(value: Json) -> str:
    """The value if it is text, else ""."""
    return value if isinstance(value, str) else ""


def number_or_none(value: Json) -> float | None:
    """The value if it is a finite number of sensible size, else None."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return None
    return float(value) if abs(value) < 1e6 else None  # never true of NaN


def finite_number(value: Json, default: float) -> float:
    """The value if it is a finite number of sensible size, else the default."""
    found = number_or_none(value)
    return default if found is None else found


def _vector(value: Json, signed: bool = False) -> Vector:
    if not isinstance(value, Sequence) or isinstance(value, str) or len(value) != 3:
        return (0.0, 0.0, 0.0)
    x, y, z = (finite_number(item, 0.0) if signed else max(finite_number(item, 0.0), 0.0) for item in value)
    return (x, y, z)
