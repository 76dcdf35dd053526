"""Parts of a written asset that an engine dies of: found by leaving parts out in child processes, in bounded time."""

import copy
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import monotonic

import numpy as np
from lxml.etree import SubElement
from lxml.etree import _Element as Element
from scipy.spatial.transform import Rotation

from asset2sim.assets.hulls import box_corners
from asset2sim.assets.meshes.load import mesh_points
from asset2sim.assets.urdf.document import read_document
from asset2sim.assets.urdf.edit import ensure_child, serialised, short_numbers
from asset2sim.assets.urdf.references import find_mesh
from asset2sim.engines.child import in_child
from asset2sim.engines.registry import open_world
from schemas.finding import Finding
from schemas.settings import EngineSettings
from schemas.vocabulary import Engine, Severity, Stage

LOOKING_S = 60.0
"""Wall time after which no further part is left out, s; also what one asset's death may cost at most."""
PROBE_S = 10.0
"""Longest that one world may take to load and step, s."""
STEPS = 20
"""Steps of a world after which an engine that dies of a part has done so, at each of its joints' ends, too."""
MOST_CULPRITS = 4
"""Parts named of one asset: where more kill an engine, its file has one fault throughout."""
PLAIN_RADIUS_M = 0.1
"""Radius of gyration of a link whose inertia is left out, m."""


@dataclass(frozen=True)
class FatalPart:
    """A part without which the engine lives: ``kind`` is shape, joint, inertial or link; ``name`` that of its link or
    joint; ``number`` counts a link's shapes, ``file`` is a shape's mesh and ``box`` its corners; ``facts`` in words."""

    engine: Engine
    kind: str
    name: str
    number: int = 0
    file: str = ""
    box: tuple[tuple[float, ...], tuple[float, ...]] | None = None
    facts: str = ""

    @property
    def finding(self) -> Finding:
        """The finding that names the part."""
        what = {"shape": f"collision shape {self.number} of link", "link": "all of link"}.get(self.kind, self.kind)
        told = f" ({self.facts})" if self.facts else ""
        message = f"{self.engine} dies of {what} '{self.name}'{told}; without it, it steps the object"
        place = {"joint" if self.kind == "joint" else "link": self.name}
        return Finding(stage=Stage.MEASURE, severity=Severity.WARNING, code="engine_dies_of", message=message, **place)


LeftOut = Callable[[Element], None]
"""Leaves one part out of a URDF that is given it."""


def fatal_parts(
    engine: Engine, urdf: Path, start: Mapping[str, float], settings: EngineSettings
) -> tuple[FatalPart, ...]:
    """The parts of a URDF that the engine dies of while it loads and steps it; empty where it does not die of loading
    and stepping alone, where nothing that is left out helps, or where the time is spent.

    Kind by kind all parts are left out, and the fewest of the first kind that lets the engine live are found.
    """
    robot, stop = read_document(urdf).robot, monotonic() + LOOKING_S
    kinds = parts_by_kind(engine, robot, urdf.parent)
    with TemporaryDirectory(prefix="asset2sim-death-") as place:
        for mesh in robot.iter("mesh"):
            file = find_mesh(str(mesh.get("filename")), urdf.parent)
            mesh.set("filename", str(mesh.get("filename") if file is None else file.resolve()))
        target = Path(place) / urdf.name

        def dies(parts: Sequence[tuple[FatalPart, LeftOut]]) -> bool:
            changed = copy.deepcopy(robot)
            for _, leave_out in parts:
                leave_out(changed)
            target.write_bytes(serialised(changed))
            limit = min(PROBE_S, max(stop - monotonic(), 1.0))
            return in_child(engine, load_and_step, engine, target, start, settings, time_limit_s=limit).died

        if dies(()):
            for parts in kinds:
                if parts and monotonic() < stop and not dies(parts):
                    return tuple(part for part, _ in fewest_culprits(parts, dies, stop))
    return ()


def load_and_step(engine: Engine, urdf: Path, start: Mapping[str, float], settings: EngineSettings) -> bool:
    """Whether the engine gets through loading, contacts and a few steps, held and free, at the start."""
    for plane in (False, True):
        with open_world(engine, urdf, plane=plane, timestep_s=settings.timestep_s, contact_friction=0.5) as world:
            world.place(start)
            world.contacts()
            world.step(STEPS)
            world.contacts()
    return True


def fewest_culprits(
    parts: Sequence[tuple[FatalPart, LeftOut]], dies: Callable[[Sequence[tuple[FatalPart, LeftOut]]], bool], stop: float
) -> list[tuple[FatalPart, LeftOut]]:
    """The parts of which none may stay, found by halving; no more than ``MOST_CULPRITS``."""
    found: list[tuple[FatalPart, LeftOut]] = []
    left = list(parts)
    while len(found) < MOST_CULPRITS and monotonic() < stop and (not found or dies(found)):
        low, high = 0, len(left)
        # The engine dies with the first ``low`` left out beside those found, and lives with the first ``high``.
        while high - low > 1 and monotonic() < stop:
            middle = (low + high) // 2
            low, high = (middle, high) if dies([*found, *left[:middle]]) else (low, middle)
        if high == 0 or high - low > 1:
            break
        found.append(left[high - 1])
        left = left[: high - 1]
    return found


def parts_by_kind(engine: Engine, robot: Element, folder: Path) -> list[list[tuple[FatalPart, LeftOut]]]:
    """All parts that may be left out, kind by kind: shapes, joints' dynamics and couplings, inertials, whole links."""
    links = [str(link.get("name")) for link in robot.findall("link")]
    shapes = []
    for link in robot.findall("link"):
        for number, shape in enumerate(link.findall("collision")):
            part = shape_facts(engine, str(link.get("name")), number, shape, folder)
            if part is not None:
                shapes.append((part, mesh_as_box(part)))
    joints = [
        (
            FatalPart(engine, "joint", str(joint.get("name")), facts=joint_facts(joint)),
            bare_joint(str(joint.get("name"))),
        )
        for joint in robot.findall("joint")
    ]
    inertials = [(FatalPart(engine, "inertial", name), link_as_ball(name)) for name in links]
    whole = [(FatalPart(engine, "link", name), link_without_shapes(name)) for name in links]
    return [shapes, joints, inertials, whole]


def shape_facts(engine: Engine, link: str, number: int, shape: Element, folder: Path) -> FatalPart | None:
    """A collision mesh with its file and box; None for a primitive and what cannot be read."""
    mesh = shape.find("geometry/mesh")
    file = None if mesh is None else find_mesh(str(mesh.get("filename")), folder)
    if mesh is None or file is None:
        return None
    scale = np.array([float(word) for word in str(mesh.get("scale", "1 1 1")).split()])
    try:
        points = mesh_points(file) * scale
    except ValueError:
        return None
    low, high = points.min(axis=0), points.max(axis=0)
    edges = ", ".join(f"{1e3 * edge:.3g}" for edge in high - low)
    facts = f"{file.name}: {len(points)} corners in a box of {edges} mm"
    return FatalPart(engine, "shape", link, number, str(mesh.get("filename")), (tuple(low), tuple(high)), facts)


def joint_facts(joint: Element) -> str:
    """Axis, limits, dynamics and coupling of a joint, as written."""
    stated = [item for tag in ("axis", "limit", "dynamics", "mimic") for item in joint.findall(tag)]
    said = (f"{item.tag} " + " ".join(f"{key}={item.get(key)}" for key in map(str, item.attrib)) for item in stated)
    return f"{joint.get('type')}: " + "; ".join(said)


def corners_of(part: FatalPart) -> "np.ndarray":
    """(8, 3) corners of a shape's box, no edge of it thinner than a sheet, m."""
    assert part.box is not None, "only shapes have a box"
    return box_corners(np.array(part.box))


def link_of(robot: Element, name: str) -> Element:
    """The link of that name."""
    return next(link for link in robot.findall("link") if link.get("name") == name)


def mesh_as_box(part: FatalPart) -> LeftOut:
    """A collision mesh replaced by its box."""

    def change(robot: Element) -> None:
        shape = link_of(robot, part.name).findall("collision")[part.number]
        corners = corners_of(part)
        geometry, origin = ensure_child(shape, "geometry"), ensure_child(shape, "origin")
        for old in list(geometry):
            geometry.remove(old)
        place, turn = (
            np.array([float(word) for word in str(origin.get(key, "0 0 0")).split()]) for key in ("xyz", "rpy")
        )
        origin.set("xyz", short_numbers(place + Rotation.from_euler("xyz", turn).apply(corners.mean(axis=0))))
        SubElement(geometry, "box", size=short_numbers(np.ptp(corners, axis=0)))

    return change


def bare_joint(name: str) -> LeftOut:
    """A joint without dynamics and coupling, a fixed one also without an axis."""

    def change(robot: Element) -> None:
        joint = next(joint for joint in robot.findall("joint") if joint.get("name") == name)
        for tag in ("dynamics", "mimic", *(("axis", "limit") if joint.get("type") == "fixed" else ())):
            for old in joint.findall(tag):
                joint.remove(old)

    return change


def link_as_ball(name: str) -> LeftOut:
    """A link whose inertia is that of a ball of a kilogram about its origin."""

    def change(robot: Element) -> None:
        link = link_of(robot, name)
        for old in link.findall("inertial"):
            link.remove(old)
        inertial = SubElement(link, "inertial")
        SubElement(inertial, "mass", value="1")
        moment = f"{PLAIN_RADIUS_M**2:g}"
        SubElement(inertial, "inertia", ixx=moment, iyy=moment, izz=moment, ixy="0", ixz="0", iyz="0")

    return change


def link_without_shapes(name: str) -> LeftOut:
    """A link without collision shapes, with a plain inertia and a bare joint to its parent."""

    def change(robot: Element) -> None:
        link = link_of(robot, name)
        for shape in link.findall("collision"):
            link.remove(shape)
        link_as_ball(name)(robot)
        for joint in robot.findall("joint"):
            if ensure_child(joint, "child").get("link") == name:
                bare_joint(str(joint.get("name")))(robot)

    return change
