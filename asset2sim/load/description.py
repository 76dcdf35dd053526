"""Description of a refined object: joints, ranges, what holds, where to pull, support, mass and verdict."""

import json
import math
import xml.etree.ElementTree as ET
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from asset2sim.load.shapes import (
    TOUCH_M,
    LoadError,
    Pieces,
    finite_numbers,
    link_of_end,
    link_poses,
    points_of,
    vector_of,
)

Values = Mapping[str, float] | Sequence[float] | np.ndarray | float
"""Numbers of joints by name, or one for each in the order of ``joint_names``."""
State = str | Mapping[str, float] | None
DRAWN = 16  # states drawn at random before joints are drawn one after another, and of each then
ROUND = 0.25  # share of a part's reach from its axis below which its middle lies on the axis
HANDLES = ("handle", "knob", "pull", "grip", "lever", "latch", "strap")  # names of visuals that hands take begin so


@dataclass(frozen=True)
class Joint:
    """One movable joint; ``unit`` is rad or m, ``lower`` and ``upper`` are None where it turns for ever. ``pull`` is a
    point to take hold of, m in the frame of ``link``: the middle of a handle, else of the edge that moves furthest;
    of what is round about its axis, a point on its rim.
    ``mimic``: the joint that it follows, multiplier, offset. Effective inertia and load are of the initial state."""

    name: str
    type: str
    label: str
    unit: str
    link: str
    lower: float | None
    upper: float | None
    initial_position: float
    holds: bool
    damping: float
    friction: float
    stiffness: float
    spring_reference: float
    effective_inertia: float
    gravity_load: float
    closed: float = 0.0
    open: float = 0.0
    armature: float = 0.0
    mimic: tuple[str, float, float] | None = None
    pull: tuple[float, ...] | None = None
    bias: dict[str, Any] | None = None

    def exerted(self, position: float) -> float:
        """Effort of its mechanism at a position besides its spring, N·m or N: a gasket, a rocker, a strut, clicks."""
        if self.bias is None:
            return 0.0
        off, period = position - self.bias["none_at"], self.bias.get("period", 0.0)
        off = math.remainder(off, period) if period > 0.0 else off
        return float(min(max(self.bias["slope"] * off, self.bias["least"]), self.bias["most"]))

    @property
    def let_go(self) -> str:
        """How it moves where it is let go, in words."""
        if self.holds:
            return "holds"
        if self.stiffness > 0.0:
            return "springs back"
        return "gravity moves it" if abs(self.gravity_load) > self.friction else "moves freely"

    def __str__(self) -> str:
        ends = "endless" if self.lower is None or self.upper is None else f"{self.lower:z.4g} to {self.upper:z.4g}"
        pull = "" if self.pull is None else f", pull {self.link} at ({', '.join(f'{v:.3f}' for v in self.pull)}) m"
        does = f"starts at {self.initial_position:z.4g}, {self.let_go}"
        return f"{self.name} ({self.label or self.link}): {self.type}, {ends} {self.unit}, {does}{pull}"


@dataclass(frozen=True)
class Description:
    """Description of a refined object. ``support`` is freestanding, fixed or handheld; ``mount`` what a fixed
    one is fixed to, if known; ``height_m`` how far its root's origin is over its lowest point in the initial state;
    ``urdf`` its URDF's tree with absolute paths. ``verdict`` is ok, else what it failed by, with ``reason``; "unknown"
    where no ``index.json`` beside the folder says."""

    asset_id: str
    folder: Path
    root: str
    mass_kg: float
    support: str
    mount: str | None
    contact_friction: float
    rolling_friction_m: float
    height_m: float
    joints: tuple[Joint, ...]
    urdf: ET.Element = field(repr=False)
    verdict: str = "unknown"
    reason: str = ""

    @property
    def passing(self) -> tuple[tuple[str, str], ...]:
        """Pairs of links that pass through each other by the URDF."""
        return tuple(
            (str(item.get("link1")), str(item.get("link2"))) for item in self.urdf.findall("disable_collisions")
        )

    @property
    def held_together(self) -> tuple[tuple[str, ...], ...]:
        """Links that fixed joints hold at their places, which pass through each other: those of one group each."""
        fixed = {
            link_of_end(joint, "child"): link_of_end(joint, "parent")
            for joint in self.urdf.findall("joint[@type='fixed']")
        }
        groups: dict[str, list[str]] = {}
        for link in self.links:
            holder = link
            while holder in fixed:
                holder = fixed[holder]
            groups.setdefault(holder, []).append(link)
        return tuple(tuple(group) for group in groups.values() if len(group) > 1)

    @property
    def links(self) -> tuple[str, ...]:
        """Names of its links."""
        return tuple(str(link.get("name")) for link in self.urdf.findall("link"))

    def __str__(self) -> str:
        first = f"{self.asset_id}: {self.mass_kg:.3g} kg, {self.support}{f' to {self.mount}' if self.mount else ''}"
        first += "" if self.verdict in ("ok", "unknown") else f", failed: {self.verdict}: {self.reason}"
        return "\n  ".join((first, *(str(joint) for joint in self.joints)))

    def numbers(self, given: Values, what: str) -> dict[str, float]:
        """Joint → number, of a mapping by name or of one number for each joint. Raises LoadError for a name that is
        none, another count, or what is not finite."""
        names = [joint.name for joint in self.joints]
        if isinstance(given, Mapping):
            named = dict(given)
        else:
            several = np.atleast_1d(np.asarray(given, dtype=object)).ravel()
            if len(several) != len(names):
                raise LoadError(f"{what}: {len(several)} numbers for {len(names)} joints: {', '.join(names)}")
            named = dict(zip(names, several, strict=True))
        for name in named:
            if name not in names:
                raise LoadError(f"{what}: no joint '{name}'; choose of {', '.join(names) or 'none'}")
        return {name: finite_numbers(f"{what}, joint '{name}'", number, (1,))[0] for name, number in named.items()}

    def followed(self, positions: Mapping[str, float]) -> dict[str, float]:
        """These positions, and those of the joints that follow one of them."""
        found = dict(positions)
        for joint in self.joints:
            if joint.mimic is not None and joint.mimic[0] in positions and joint.name not in positions:
                found[joint.name] = joint.mimic[1] * positions[joint.mimic[0]] + joint.mimic[2]
        return found

    def positions_at(self, state: State = None, seed: int = 0) -> dict[str, float]:
        """Joint → position, rad or m: None as asked of it, "closed", "open", "random", or for joints by name a share of
        the way from closed (0) to open (1), the others as asked. A seed gives the same "random" in every engine. Raises
        LoadError as ``numbers`` does, for another word, and for a state in which links are in each other."""
        asked = {joint.name: joint.initial_position for joint in self.joints}
        if state is None:
            return asked
        if isinstance(state, str) and state not in ("closed", "open", "random"):
            raise LoadError(f'no state "{state}"; choose "closed", "open", "random", or {{joint: share}}')
        if state == "random":
            return self.drawn(asked, seed)
        leaders = [joint.name for joint in self.joints if joint.mimic is None]
        shares = dict.fromkeys(leaders, float(state == "open")) if isinstance(state, str) else state
        ends = {joint.name: (joint.closed, joint.open) for joint in self.joints}
        shares = self.numbers(shares, "state")
        for name, share in shares.items():
            if not -1e-6 <= share <= 1.0 + 1e-6:
                raise LoadError(f"state: {share:g} for joint '{name}' is no share from 0, closed, to 1, open")
        moved = {name: ends[name][0] + share * (ends[name][1] - ends[name][0]) for name, share in shares.items()}
        positions = asked | self.followed(moved)
        met = self.overlap(positions)
        if met is not None:
            (one, other), deep = met
            mine = [joint.name for joint in self.joints if joint.link in (one, other)]
            raise LoadError(
                f"state: {state!r} puts link '{one}' {1000.0 * deep:.0f} mm into '{other}'; choose other shares for "
                f"{' or '.join(mine) or 'the joints before them'}"
            )
        return positions

    def drawn(self, asked: Mapping[str, float], seed: int) -> dict[str, float]:
        """Positions drawn evenly over the joints' ranges, free of overlaps: all joints at once, else one after another,
        each left as asked where nothing that is drawn is free. Raises LoadError for a seed that is none."""
        if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
            raise LoadError(f"seed: {seed!r} is no whole number from 0 on")
        rng, leaders = np.random.default_rng(int(seed)), [joint for joint in self.joints if joint.mimic is None]

        def draw(joint: Joint) -> dict[str, float]:
            endless = joint.lower is None or joint.upper is None
            low, high = (-math.pi, math.pi) if endless else (joint.closed, joint.open)
            return {joint.name: float(low + rng.uniform() * (high - low))}

        for _ in range(DRAWN):
            positions = dict(asked) | self.followed({key: at for joint in leaders for key, at in draw(joint).items()})
            if self.overlap(positions) is None:
                return positions
        positions = dict(asked)
        for index in rng.permutation(len(leaders)):
            tried = (positions | self.followed(draw(leaders[index])) for _ in range(DRAWN))
            positions = next((found for found in tried if self.overlap(found) is None), positions)
        return positions

    @cached_property
    def pieces(self) -> tuple[Pieces, dict[tuple[str, str], float]]:
        """Its pieces that may meet, and how deep links are in each other as asked, m."""
        found = Pieces(self.urdf, self.root, self.passing)
        return found, found.depths({joint.name: joint.initial_position for joint in self.joints})

    def overlap(self, positions: Mapping[str, float]) -> tuple[tuple[str, str], float] | None:
        """The links that are deepest in each other at these positions, and how deep, m; None where none are by more
        than ``TOUCH_M`` and as the object is asked to be."""
        pieces, before = self.pieces
        depths = pieces.depths(positions)
        worst = max(depths, key=lambda pair: depths[pair] - before.get(pair, 0.0), default=None)
        if worst is None or depths[worst] - before.get(worst, 0.0) <= TOUCH_M:
            return None
        return worst, depths[worst]

    def in_state(self, state: State, seed: int = 0) -> "Description":
        """The same object in another initial state, at the height at which it stands then. Raises LoadError."""
        positions = self.positions_at(state, seed)
        joints = tuple(replace(joint, initial_position=positions[joint.name]) for joint in self.joints)
        return replace(self, joints=joints, height_m=height_at(self.urdf, self.root, positions))


def describe(folder: str | Path) -> Description:
    """Description of a refined folder: joints with ranges and where to pull, support and mass. Raises LoadError where
    the URDF, overlay.json or a collision mesh is not there or cannot be read."""
    try:
        place = Path(folder).resolve()
    except (TypeError, ValueError) as error:
        raise LoadError(f"{folder!r} is no path ({error}); name the folder of a refined object") from None
    missing = [name for name in ("mobility.urdf", "overlay.json") if not (place / name).is_file()]
    if missing:
        raise LoadError(f"{folder} lacks {' and '.join(missing)}; name the folder of a refined object, OUT/assets/<id>")
    try:
        overlay = json.loads((place / "overlay.json").read_text(encoding="utf-8"))
        urdf = ET.parse(place / "mobility.urdf").getroot()
    except (ValueError, ET.ParseError) as error:
        which = "mobility.urdf" if isinstance(error, ET.ParseError) else "overlay.json"
        raise LoadError(f"{folder}: {which} is damaged ({error}); refine the object again") from error
    # A transmission is a motor in Drake, on the joint that has friction, and an error in SAPIEN.
    urdf[:] = [element for element in urdf if element.tag != "transmission"]
    for mesh in urdf.iter("mesh"):
        mesh.set("filename", str(place / str(mesh.get("filename"))))
    elements = {str(element.get("name")): element for element in urdf.findall("joint")}
    links = {str(link.get("name")): link for link in urdf.findall("link")}
    clouds = {name: points_of(link, "collision") for name, link in links.items()}
    root = next(name for name in clouds if name not in {link_of_end(element, "child") for element in elements.values()})
    every = (*overlay["joints"], *overlay.get("followers", ()))
    terms = {item["name"]: item for item in every if item["name"] in elements}
    height_m = height_at(urdf, root, {name: item["initial_position"] for name, item in terms.items()}, clouds)
    support = overlay.get("support") or {"kind": "freestanding"}
    contact = (overlay["contact_friction"], overlay.get("rolling_friction_m", 0.0), height_m)
    ends = {name: link_of_end(elements[name], "child") for name in terms}
    joints = tuple(joint_of(links[ends[name]], elements[name], terms[name], clouds[ends[name]]) for name in terms)
    mass_kg, carried = sum(link["mass_kg"] for link in overlay["links"]), (support["kind"], support.get("mount"))
    judged = verdict_of(place)
    return Description(overlay["asset_id"], place, root, mass_kg, *carried, *contact, joints, urdf, *judged)


def height_at(
    urdf: ET.Element, root: str, positions: Mapping[str, float], clouds: Mapping[str, np.ndarray] | None = None
) -> float:
    """How far, m, the root's origin is over the lowest collision point at these joint positions."""
    clouds = clouds or {str(link.get("name")): points_of(link, "collision") for link in urdf.findall("link")}
    poses = link_poses(urdf, root, positions)
    lowest = [
        float((cloud @ poses[name][2, :3]).min()) + poses[name][2, 3] for name, cloud in clouds.items() if len(cloud)
    ]
    return -min(lowest, default=0.0)


def verdict_of(folder: Path) -> tuple[str, str]:
    """The verdict on a refined folder, and its reason, from the index beside it."""
    try:
        entries = json.loads((folder.parent / "index.json").read_text(encoding="utf-8"))["assets"]
        found = next(entry for entry in entries if entry["path"] == folder.name)
        return ("ok", "") if found["status"] == "ok" else (str(found["failure_mode"]), str(found.get("reason") or ""))
    except (OSError, ValueError, LookupError, TypeError, StopIteration):
        return "unknown", ""


def pull_point(points: np.ndarray, axis: np.ndarray | None) -> np.ndarray:
    """The middle of a part's points; of a part that is round about its axis (a knob, a wheel), where no pull at the
    middle turns it, a point on the rim beside it."""
    middle: np.ndarray = (points.min(axis=0) + points.max(axis=0)) / 2.0
    if axis is None:
        return middle
    arms = np.linalg.norm(np.cross(points, axis), axis=1)
    if np.linalg.norm(np.cross(middle, axis)) >= ROUND * arms.max():
        return middle
    across = points[arms >= 0.98 * arms.max()][0] - middle
    return np.asarray(middle + across - axis * (across @ axis))


def joint_of(link: ET.Element, element: ET.Element, terms: dict[str, Any], cloud: np.ndarray) -> Joint:
    """One joint from the link that it moves, its URDF element, its entry in the overlay, and the link's points."""
    lead, points, mimic = element.find("mimic"), points_of(link, "visual", HANDLES), None
    axis, slides = vector_of(element.find("axis"), "xyz", "1 0 0"), terms["type"] == "prismatic"
    axis = axis / np.linalg.norm(axis) * (-1.0 if terms["open"] < terms["closed"] else 1.0)
    if not len(points) and len(cloud):
        reach = cloud @ axis if slides else np.linalg.norm(np.cross(cloud, axis), axis=1)
        points = cloud[reach >= reach.max() - 0.02 * np.ptp(cloud, axis=0).max()]
    if lead is not None:
        mimic = str(lead.get("joint")), float(lead.get("multiplier", 1.0)), float(lead.get("offset", 0.0))
    pull = tuple(pull_point(points, None if slides else axis).tolist()) if len(points) else None
    unit, known = "m" if terms["type"] == "prismatic" else "rad", {*terms} & {*Joint.__dataclass_fields__} - {"mimic"}
    return Joint(**{key: terms[key] for key in known}, unit=unit, link=str(link.get("name")), mimic=mimic, pull=pull)
