"""Defects of joints: axes, limits, origins, the tree, and damping, friction, springs and efforts."""

import copy
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from lab.defects.planting import Plant, PlantedChange, Target, edited, edited_part, named, numbers, part, write
from schemas.overlay import PhysicsOverlay
from schemas.settings import PhysicsSettings

LIMIT_KEYS = ("lower", "upper")
STEP_S = PhysicsSettings().coarse_timestep_s
UNSTABLE_FACTOR = 200.0
"""Planted damping or stiffness over the stability limit at the coarse time step."""
RINGING_RAD_S = 2.0 * math.pi * 3.0
"""Frequency of the spring that is left without damping, rad/s: 3 Hz."""
OPENING_LOADS = 3.0
"""Torque of the spring that opens a part, over its weight's."""
STICKING_FRICTION = 1e4
"""Friction of a joint that no effort can move, N·m or N."""


def dynamics(**terms: Callable[[float], float]) -> Plant:
    """Terms of a joint's dynamics, each from its effective inertia in the overlay beside the URDF, kg·m² or kg."""

    def plant(folder: Path, at: Target) -> PlantedChange:
        overlay = PhysicsOverlay.model_validate_json((folder / "overlay.json").read_bytes())
        inertia = next(joint.effective_inertia for joint in overlay.joints if joint.name == at.joint)
        values = {key: value_of(inertia) for key, value_of in terms.items()}
        with edited_part(folder, "joint", at.joint, "dynamics") as element:
            element.attrib.pop("geared_stiffness", "")
            for key, value in values.items():
                write(element, key, value)
        said = ", ".join(f"{key} {value:.3g}" for key, value in values.items())
        return PlantedChange(f"'{at.joint}' has {said}", joints=(at.joint,))

    return plant


damping_unstable = dynamics(damping=lambda inertia: UNSTABLE_FACTOR * inertia / STEP_S)
"""Damping far above the stability limit of an explicit step: a value for another object."""
damping_negative = dynamics(damping=lambda inertia: -10.0 * inertia)
"""Negative damping, which adds energy: a wrong sign."""
spring_undamped = dynamics(
    spring_stiffness=lambda inertia: RINGING_RAD_S**2 * inertia, damping=lambda _: 0.0, friction=lambda _: 0.0
)
"""A spring without damping or friction."""
stiffness_unstable = dynamics(spring_stiffness=lambda inertia: UNSTABLE_FACTOR * inertia / STEP_S**2)
"""A spring that is too stiff for any usual time step."""
friction_sticks = dynamics(friction=lambda _: STICKING_FRICTION)
"""Friction that is too high to overcome."""
friction_negative = dynamics(friction=lambda inertia: -inertia)
"""Friction with a wrong sign."""


def friction_times(factor: float) -> Plant:
    """A joint's friction as what its part's weight needs at its worst, times ``factor``: more than a hand is for."""

    def plant(folder: Path, at: Target) -> PlantedChange:
        overlay = PhysicsOverlay.model_validate_json((folder / "overlay.json").read_bytes())
        load = abs(next(joint.gravity_load for joint in overlay.joints if joint.name == at.joint))
        with edited_part(folder, "joint", at.joint, "dynamics") as element:
            write(element, "friction", factor * load)
        return PlantedChange(f"'{at.joint}' has friction {factor * load:.3g}", joints=(at.joint,))

    return plant


def spring_opens(folder: Path, at: Target) -> PlantedChange:
    """A spring that lifts a closed part: its relaxed position was stated from the other end of the range."""
    overlay = PhysicsOverlay.model_validate_json((folder / "overlay.json").read_bytes())
    joint = next(joint for joint in overlay.joints if joint.name == at.joint)
    stiffness = OPENING_LOADS * abs(joint.gravity_load) / abs(joint.open - joint.closed)
    with edited_part(folder, "joint", at.joint, "dynamics") as element:
        element.attrib.pop("geared_stiffness", "")
        write(element, "spring_stiffness", stiffness)
        write(element, "spring_reference", joint.open)
        write(element, "friction", 0.0)
    return PlantedChange(f"'{at.joint}' has a spring that opens it", joints=(at.joint,))


def effort_zero(folder: Path, at: Target) -> PlantedChange:
    """An effort limit of zero, as some exporters write for an unknown one."""
    with edited_part(folder, "joint", at.joint, "limit") as limit:
        write(limit, "effort", 0.0)
    return PlantedChange(f"'{at.joint}' has an effort limit of 0", joints=(at.joint,))


def axis_times(factor: float) -> Plant:
    """A joint's axis times ``factor``: -1 turns it round, 0 leaves no direction, 3 is not of unit length."""

    def plant(folder: Path, at: Target) -> PlantedChange:
        with edited_part(folder, "joint", at.joint, "axis") as axis:
            write(axis, "xyz", numbers(axis, "xyz") * factor)
            said = axis.get("xyz")
        return PlantedChange(f"axis of '{at.joint}' is {said}", joints=(at.joint,))

    return plant


def limits_crossed(folder: Path, at: Target) -> PlantedChange:
    """The lower limit above the upper one."""
    with edited_part(folder, "joint", at.joint, "limit") as limit:
        lower, upper = str(limit.get("lower")), str(limit.get("upper"))
        limit.set("lower", upper)
        limit.set("upper", lower)
    return PlantedChange(f"'{at.joint}' goes from {upper} to {lower}", joints=(at.joint,))


def limits_in_degrees(folder: Path, at: Target) -> PlantedChange:
    """A hinge's limits in degrees."""
    with edited_part(folder, "joint", at.joint, "limit") as limit:
        for key in LIMIT_KEYS:
            write(limit, key, math.degrees(float(str(limit.get(key)))))
        said = f"{limit.get('lower')} to {limit.get('upper')}"
    return PlantedChange(f"'{at.joint}' goes from {said} rad", joints=(at.joint,))


def limits_missing(folder: Path, at: Target) -> PlantedChange:
    """A revolute joint without limits."""
    with edited_part(folder, "joint", at.joint, "limit") as limit:
        for key in LIMIT_KEYS:
            del limit.attrib[key]
    return PlantedChange(f"'{at.joint}' states no limits", joints=(at.joint,))


def zero_outside_limits(folder: Path, at: Target) -> PlantedChange:
    """Limits that exclude zero, where every engine starts."""
    with edited_part(folder, "joint", at.joint, "limit") as limit:
        lower, upper = (float(str(limit.get(key))) for key in LIMIT_KEYS)
        write(limit, "lower", lower + 0.4 * (upper - lower) if lower <= 0.0 else 0.0)
        said = f"{limit.get('lower')} to {limit.get('upper')}"
    return PlantedChange(f"'{at.joint}' goes from {said}, and zero is outside", joints=(at.joint,))


def shifted_by(x: float, y: float, z: float) -> Plant:
    """A link moved by (x, y, z) metres in its parent's frame, into something else."""

    def plant(folder: Path, at: Target) -> PlantedChange:
        with edited_part(folder, "joint", at.joint, "origin") as origin:
            write(origin, "xyz", numbers(origin, "xyz") + np.array([x, y, z]))
        return PlantedChange(f"'{at.link}' shifted by ({x:g}, {y:g}, {z:g}) m", links=(at.link,), joints=(at.joint,))

    return plant


def pivot_moved_by(x: float, y: float, z: float) -> Plant:
    """A hinge moved by (x, y, z) metres in its parent's frame, the part that it turns left where it is."""

    def plant(folder: Path, at: Target) -> PlantedChange:
        offset = np.array([x, y, z])
        with edited(folder) as robot:
            origin = named(robot, "joint", at.joint, "origin")
            if origin.get("rpy") not in (None, "0 0 0"):
                raise KeyError(f"joint '{at.joint}' is turned: its part cannot be left in place by a shift")
            write(origin, "xyz", numbers(origin, "xyz") + offset)
            link = named(robot, "link", at.link)
            for item in [*link.findall("visual"), *link.findall("collision"), *link.findall("inertial")]:
                if item.find("origin") is None:
                    item.insert(0, item.makeelement("origin", {"xyz": "0 0 0"}))
                shifted = part(item, "origin")
                write(shifted, "xyz", numbers(shifted, "xyz") - offset)
        said = f"hinge '{at.joint}' moved by ({x:g}, {y:g}, {z:g}) m"
        return PlantedChange(said, links=(at.link,), joints=(at.joint,))

    return plant


def duplicate_link(folder: Path, at: Target) -> PlantedChange:
    """A second link of the same name."""
    with edited(folder) as robot:
        robot.append(copy.deepcopy(named(robot, "link", at.link)))
    return PlantedChange(f"two links are called '{at.link}'", links=(at.link,))


def two_parents(folder: Path, at: Target) -> PlantedChange:
    """A link that two joints move: a loop, as CAD assemblies have."""
    with edited(folder) as robot:
        second = copy.deepcopy(named(robot, "joint", at.joint))
        second.set("name", f"{at.joint}_again")
        robot.append(second)
    return PlantedChange(f"'{at.link}' is the child of two joints", links=(at.link,), joints=(at.joint,))


def unnamed_joint(folder: Path, at: Target) -> PlantedChange:
    """A joint without a name."""
    with edited(folder) as robot:
        named(robot, "joint", at.joint).attrib.pop("name")
    return PlantedChange(f"the joint that moves '{at.link}' has no name", links=(at.link,), joints=(at.joint,))
