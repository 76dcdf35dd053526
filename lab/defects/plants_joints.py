"""Defects of joints: axes, limits, origins, the tree, and damping, friction, springs and efforts."""

import copy
import math
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
from lxml.etree import _Element as Element

from asset2sim.assets.authored import read_overlay
from lab.defects.planting import Plant, PlantedChange, Target, above, changed, edited, named, numbers, part, write
from schemas.overlay import JointPhysics
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


def dynamics(**terms: Callable[[JointPhysics], float]) -> Plant:
    """Terms of a joint's dynamics, each from the joint in the overlay beside the URDF."""

    def plant(folder: Path, at: Target) -> PlantedChange:
        overlay = read_overlay(folder)
        joint = next(joint for joint in overlay.joints if joint.name == at.joint)
        values = {key: value_of(joint) for key, value_of in terms.items()}

        def edit(element: Element) -> str:
            element.attrib.pop("geared_stiffness", "")
            for key, value in values.items():
                write(element, key, value)
            return "has " + ", ".join(f"{key} {value:.3g}" for key, value in values.items())

        return changed("joint", "dynamics", edit)(folder, at)

    return plant


damping_unstable = dynamics(damping=lambda joint: UNSTABLE_FACTOR * joint.effective_inertia / STEP_S)
"""Damping far above the stability limit of an explicit step: a value for another object."""
damping_negative = dynamics(damping=lambda joint: -10.0 * joint.effective_inertia)
"""Negative damping, which adds energy: a wrong sign."""
spring_undamped = dynamics(
    spring_stiffness=lambda joint: RINGING_RAD_S**2 * joint.effective_inertia,
    damping=lambda _: 0.0,
    friction=lambda _: 0.0,
)
"""A spring without damping or friction."""
stiffness_unstable = dynamics(spring_stiffness=lambda joint: UNSTABLE_FACTOR * joint.effective_inertia / STEP_S**2)
"""A spring that is too stiff for any usual time step."""
friction_sticks = dynamics(friction=lambda _: STICKING_FRICTION)
"""Friction that is too high to overcome."""
friction_negative = dynamics(friction=lambda joint: -joint.effective_inertia)
"""Friction with a wrong sign."""
spring_opens = dynamics(
    spring_stiffness=lambda joint: OPENING_LOADS * abs(joint.gravity_load) / abs(joint.open - joint.closed),
    spring_reference=lambda joint: joint.open,
    friction=lambda _: 0.0,
)
"""A spring that lifts a closed part: its relaxed position was stated from the other end of the range."""


def friction_times(factor: float) -> Plant:
    """A joint's friction as what its part's weight needs at its worst, times ``factor``: more than a hand is for."""
    return dynamics(friction=lambda joint: factor * abs(joint.gravity_load))


def effort_zero(limit: Element) -> str:
    """An effort limit of zero, as some exporters write for an unknown one."""
    write(limit, "effort", 0.0)
    return "has an effort limit of 0"


def limits_crossed(limit: Element) -> str:
    """The lower limit above the upper one."""
    lower, upper = (str(limit.get(key)) for key in LIMIT_KEYS)
    limit.set("lower", upper)
    limit.set("upper", lower)
    return f"goes from {upper} to {lower}"


def limits_in_degrees(limit: Element) -> str:
    """A hinge's limits in degrees."""
    for key in LIMIT_KEYS:
        write(limit, key, np.degrees(numbers(limit, key)))
    return f"goes from {limit.get('lower')} to {limit.get('upper')} rad"


def limits_missing(limit: Element) -> str:
    """A revolute joint without limits."""
    for key in LIMIT_KEYS:
        del limit.attrib[key]
    return "states no limits"


def zero_outside_limits(limit: Element) -> str:
    """Limits that exclude zero, where every engine starts."""
    lower, upper = (float(str(limit.get(key))) for key in LIMIT_KEYS)
    write(limit, "lower", lower + 0.4 * (upper - lower) if lower <= 0.0 else 0.0)
    return f"goes from {limit.get('lower')} to {limit.get('upper')}, and zero is outside"


limit = partial(changed, "joint", "limit")
"""A plant that edits a joint's limit."""


def axis_times(factor: float) -> Plant:
    """A joint's axis times ``factor``: -1 turns it round, 0 leaves no direction, 3 is not of unit length."""

    def edit(axis: Element) -> str:
        write(axis, "xyz", numbers(axis, "xyz") * factor)
        return f"has the axis {axis.get('xyz')}"

    return changed("joint", "axis", edit)


def shifted_by(x: float, y: float, z: float) -> Plant:
    """A joint, and the link that it moves, shifted by (x, y, z) metres in the parent's frame, into something else."""

    def edit(origin: Element) -> str:
        write(origin, "xyz", numbers(origin, "xyz") + np.array([x, y, z]))
        return f"is shifted by ({x:g}, {y:g}, {z:g}) m with its link"

    return changed("joint", "origin", edit)


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


def duplicate_link(link: Element) -> str:
    """A second link of the same name."""
    above(link).append(copy.deepcopy(link))
    return "is the name of two links"


def two_parents(joint: Element) -> str:
    """A link that two joints move: a loop, as CAD assemblies have."""
    second = copy.deepcopy(joint)
    second.set("name", f"{joint.get('name')}_again")
    above(joint).append(second)
    return "moves a link that another joint moves, too"


def unnamed_joint(joint: Element) -> str:
    """A joint without a name."""
    joint.attrib.pop("name")
    return "has no name any more"
