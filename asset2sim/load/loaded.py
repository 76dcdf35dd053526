"""An object in an engine, alike in all: its joints by name, efforts, targets, poses and contacts."""

import tempfile
import xml.etree.ElementTree as ET
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np

from asset2sim.load.description import Description, State, Values
from asset2sim.load.shapes import LoadError

GRAVITY = (0.0, 0.0, -9.81)  # m/s²
STOP_DAMPING = 1e8  # of drives that are dry friction, N·m·s/rad or N·s/m: a held joint creeps at its load over this
SERVO_RAD_S, SERVO_STEP = 60.0, 0.25  # a target's natural frequency, and the most of it times the time step: stable
SERVO_NEAR = 1e-3  # rad or m from a target within which a servo no longer bears all of the friction
BEYOND = 0.05  # share of its range by which a position may be set beyond a limit: what engines themselves overshoot
PACKAGES = {"pydrake": "drake", "genesis": "genesis-world", "newton": "newton[sim]", "mujoco_warp": "newton[sim]"}
UNSET: Any = None  # a handle that is not there yet: the world that it is of is not compiled


class Root(NamedTuple):
    """Whether the root is held to the world, its frame's position (m) and orientation (wxyz), and the object's name in
    a world of several, None where it may be any."""

    fixed: bool
    position: tuple[float, float, float]
    wxyz: tuple[float, float, float, float]
    name: str | None = None


class Contact(NamedTuple):
    """Where a link touches something: a link of the same object, or what the engine calls the other; m and N."""

    link: str
    other: str
    position: tuple[float, float, float]
    force_n: float


class Loaded(ABC):
    """An object in an engine, whose handles are attributes. ``about`` describes it; positions are in rad or m, efforts
    in N·m or N. Numbers are given by joint name or, one for each, in the order of ``joint_names``; LoadError says what
    is wrong with them."""

    engine: ClassVar[str]
    takes: ClassVar[tuple[str, str]]
    """The world of a user's that it may be put into, and an attribute by which that is told."""

    def __init__(self, about: Description, root: Root) -> None:
        self.about, self.root, self.name = about, root, root.name or about.asset_id
        self.joint_names = tuple(joint.name for joint in about.joints)
        self.efforts: dict[str, float] = {}
        self.targets: dict[str, float] = {}

    @property
    @abstractmethod
    def timestep_s(self) -> float:
        """The world's time step, s."""

    @abstractmethod
    def read(self) -> tuple[Any, Any]:
        """Positions and velocities in the order of ``joint_names``."""

    @abstractmethod
    def write(self, positions: Mapping[str, float]) -> None:
        """Set the positions of these joints, at rest."""

    @abstractmethod
    def place(self) -> None:
        """Put the root where it was put first, at rest."""

    @abstractmethod
    def push(self, efforts: Mapping[str, float]) -> None:
        """Have these efforts, and none on the other joints, act in the next step."""

    @abstractmethod
    def advance(self) -> object:
        """Advance the world by one time step."""

    @abstractmethod
    def link_poses(self) -> dict[str, np.ndarray]:
        """Link → (4, 4) link-to-world transform, m."""

    @abstractmethod
    def contacts(self) -> list[Contact]:
        """The contacts of its links that bore a force in the last step."""

    def positions(self) -> dict[str, float]:
        """Joint → position, rad or m."""
        return {name: float(value) for name, value in zip(self.joint_names, self.read()[0], strict=True)}

    def velocities(self) -> dict[str, float]:
        """Joint → velocity, rad/s or m/s."""
        return {name: float(value) for name, value in zip(self.joint_names, self.read()[1], strict=True)}

    def set_positions(self, positions: Values) -> None:
        """Put joints at these positions, at rest, and with them those that follow them; the others stay."""
        numbers = self.about.followed(self.about.numbers(positions, "set_positions"))
        for joint in (one for one in self.about.joints if one.name in numbers):
            if joint.lower is not None and joint.upper is not None:
                over = BEYOND * (joint.upper - joint.lower) + 1e-6
                if not joint.lower - over <= numbers[joint.name] <= joint.upper + over:
                    ends = f"{joint.lower:.4g} to {joint.upper:.4g} {joint.unit}"
                    raise LoadError(f"set_positions: {numbers[joint.name]:.4g} is beyond joint '{joint.name}', {ends}")
        self.write(numbers)

    def apply_effort(self, efforts: Values) -> None:
        """Have these efforts act in every step from now on, until they are given anew or ``reset``."""
        self.efforts.update(self.about.numbers(efforts, "apply_effort"))

    def set_targets(self, positions: Values | None) -> None:
        """Lead joints to these positions by a critically damped servo that overcomes their friction, in every step from
        now on, until they are given anew or ``reset``; None lets all go. It yields to gravity by g / (60 rad/s)² a
        metre of lever."""
        self.targets = {} if positions is None else self.targets | self.about.numbers(positions, "set_targets")

    def reset(self, state: State = None, seed: int = 0) -> None:
        """Its first place, at rest, joints in the initial state or in another ("closed", "open", "random" with a seed,
        {joint: share}), without efforts and targets."""
        positions = self.about.positions_at(state, seed)
        self.efforts, self.targets = {}, {}
        self.place()
        self.write(positions)
        self.push({})

    def drive(self) -> None:
        """Set efforts, targets, mechanisms and what springs the engine lacks for the next step. ``step`` does so
        itself: call it before each step that a world of yours makes."""
        efforts = dict(self.efforts)
        biased = [joint for joint in self.about.joints if joint.bias is not None]
        positions = self.positions() if self.targets or biased else {}
        for joint in biased:
            efforts[joint.name] = efforts.get(joint.name, 0.0) + joint.exerted(positions[joint.name])
        if self.targets:
            velocities = self.velocities()
            speed = min(SERVO_RAD_S, SERVO_STEP / self.timestep_s)
            for joint in (one for one in self.about.joints if one.name in self.targets):
                target, inertia = self.targets[joint.name], joint.effective_inertia + joint.armature
                off = target - positions[joint.name]
                pull = inertia * speed * (speed * off - 2.0 * velocities[joint.name])
                pull += joint.friction * min(max(off / SERVO_NEAR, -1.0), 1.0)
                pull += joint.stiffness * (target - joint.spring_reference) - joint.exerted(positions[joint.name])
                efforts[joint.name] = efforts.get(joint.name, 0.0) + pull
        self.push(efforts)

    def step(self) -> None:
        """Advance the world by one time step, with this object's efforts, targets and springs."""
        self.drive()
        self.advance()


def engine_module(name: str) -> Any:
    """An engine's module. Raises ImportError with the package to install (``PACKAGES``, where it has another name)."""
    try:
        return import_module(name)
    except ModuleNotFoundError as error:
        missing = str(error.name).partition(".")[0]
        package = PACKAGES.get(missing, missing)
        raise ImportError(f"{name} needs {missing}, which is not installed: pip install '{package}'") from error


def free_name(root: Root, about: Description, taken: Any) -> str:
    """The name asked for, else the asset's, numbered where ``taken`` says that another has it. Raises LoadError where
    one was asked for that is taken."""
    if root.name is not None:
        if taken(root.name):
            raise LoadError(f"another object is named '{root.name}' there: give this one another name=")
        return root.name
    names = (about.asset_id, *(f"{about.asset_id}_{number}" for number in range(2, 10_000)))
    return next(name for name in names if not taken(name))


def pose_matrix(position: Any, wxyz: Any) -> np.ndarray:
    """(4, 4) transform of a position and a unit quaternion."""
    (w, x, y, z), pose = (float(value) for value in wxyz), np.eye(4)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    pose[:3, :3] = np.eye(3) + 2.0 * w * cross + 2.0 * cross @ cross
    pose[:3, 3] = position
    return pose


def three_numbers(values: Any) -> tuple[float, float, float]:
    """Three numbers."""
    x, y, z = (float(value) for value in values)
    return x, y, z


@contextmanager
def copied_urdf(urdf: ET.Element, visuals: bool = True) -> Iterator[str]:
    """Path of a file of the URDF's tree, without its visuals if so asked, until the block ends."""
    for link in () if visuals else urdf.findall("link"):
        link[:] = [element for element in link if element.tag != "visual"]
    with tempfile.TemporaryDirectory() as folder:
        ET.ElementTree(urdf).write(Path(folder) / "mobility.urdf", encoding="utf-8")
        yield str(Path(folder) / "mobility.urdf")
