"""Defects of axes, limits, origins, and of the tree."""

import copy
import math
from pathlib import Path

import numpy as np
from lxml.etree import _Element as Element

from asset2sim.studies.defects.planting import (
    Plant,
    PlantedChange,
    Target,
    edited,
    edited_part,
    named,
    numbers,
    part,
    write,
)

LIMIT_KEYS = ("lower", "upper")


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
            origin = part(named(robot, "joint", at.joint), "origin")
            if origin.get("rpy") not in (None, "0 0 0"):
                raise KeyError(f"joint '{at.joint}' is turned: its part cannot be left in place by a shift")
            write(origin, "xyz", numbers(origin, "xyz") + offset)
            link = named(robot, "link", at.link)
            for item in [*link.findall("visual"), *link.findall("collision"), *link.findall("inertial")]:
                shift_back(item, offset)
        return PlantedChange(
            f"hinge '{at.joint}' moved by ({x:g}, {y:g}, {z:g}) m", links=(at.link,), joints=(at.joint,)
        )

    return plant


def shift_back(item: Element, offset: np.ndarray) -> None:
    """Move one visual, collision or inertial against a shift of its link."""
    origin = item.find("origin")
    if origin is None:
        origin = item.makeelement("origin", {"xyz": "0 0 0"})
        item.insert(0, origin)
    write(origin, "xyz", numbers(origin, "xyz") - offset)


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
