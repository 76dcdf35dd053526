"""The numbers of an SDF model, and the poses of its links, joints and frames."""

import math
from pathlib import Path

import numpy as np
from lxml import etree
from lxml.etree import _Element as Element
from scipy.spatial.transform import Rotation

from asset2sim.assets.urdf.edit import short_numbers
from asset2sim.intake.formats.format import unconvertible_error
from asset2sim.intake.formats.sdf_includes import FRAMED_AXES
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import origin_transform
from schemas.errors import AssetError

CLOSING = "closing-joint"
"""Tag of a joint that would close a loop of the tree."""
UNLIMITED = 1e15
"""SDF writes ±1e16 for a joint without limits."""


class SdfModel:
    """One flat model in a ``version`` of SDF. Poses are (4, 4) in the model's frame. Raises AssetError
    (unreadable_asset) for two links or joints of one name, and later for what is no number or no frame."""

    def __init__(self, file: Path, model: Element, version: tuple[int, ...]) -> None:
        self.file, self.model, self.version = file, model, version
        self.links = [str(link.get("name")) for link in model.findall("link")]
        for kind, names in (
            ("link", self.links),
            ("joint", [str(item.get("name")) for item in model.findall("joint")]),
        ):
            if twice := next((name for name in names if names.count(name) > 1), None):
                raise self.refused("sdf_name", f"two of its {kind}s are called '{twice}': rename one")
        kinds = ("link", "joint", "frame", CLOSING)
        self.named = {str(item.get("name")): item for kind in kinds for item in model.findall(kind)}
        self.poses: dict[str, Array] = {}

    def refused(self, code: str, problem: str) -> AssetError:
        """The error that names the file."""
        return unconvertible_error(self.file, code, problem)

    def text(self, element: Element, path: str, default: str = "") -> str:
        """The stripped text below an element, the ``default`` where it is empty, as Gazebo has it."""
        return (element.findtext(path) or "").strip() or default

    def numbers(self, element: Element, path: str, default: str) -> list[float]:
        """The numbers below an element."""
        try:
            return [float(word) for word in self.text(element, path, default).split()]
        except ValueError as error:
            raise self.unreadable(element, path, str(error)) from error

    def unreadable(self, element: Element, path: str, problem: str) -> AssetError:
        """The error of what is no number below an element, with what holds it and its line."""
        named = next((item for item in (element, *element.iterancestors()) if item.get("name")), self.model)
        line = getattr(element.find(path), "sourceline", None)
        of = f"of {named.tag} '{named.get('name')}'" + ("" if line is None else f", line {line}")
        return self.refused("sdf_number", f"<{path}> {of}: {problem}")

    def own_pose(self, element: Element) -> Array:
        """An element's <pose>, in whatever frame it is stated."""
        pose = element.find("pose")
        values = self.numbers(element, "pose", "0 0 0 0 0 0")
        if pose is not None and pose.get("rotation_format") == "quat_xyzw":
            found = origin_transform(values[:3])
            found[:3, :3] = Rotation.from_quat(values[3:7]).as_matrix()
            return found
        if len(values) != 6:
            raise self.unreadable(element, "pose", f"it has {len(values)} numbers of 6")
        degrees = pose is not None and pose.get("degrees") == "true"
        return origin_transform(values[:3], [math.radians(v) if degrees else v for v in values[3:]])

    def pose(self, name: str, asked: tuple[str, ...] = ()) -> Array:
        """The pose of a link, joint or frame in the model's frame."""
        if name in ("", "__model__", "world"):
            return np.eye(4)
        if name not in self.named or name in asked:
            problem = "which is not in the model" if name not in self.named else "which is stated relative to itself"
            raise self.refused("sdf_frame", f"a pose is relative to '{name}', {problem}")
        if name not in self.poses:
            element = self.named[name]
            stated = element.find("pose")
            relative = "" if stated is None else str(stated.get("relative_to") or stated.get("frame") or "")
            if not relative and element.tag in ("joint", CLOSING):
                relative = self.text(element, "child")
            elif not relative and element.tag == "frame":
                relative = str(element.get("attached_to") or "")
            self.poses[name] = self.pose(relative, (*asked, name)) @ self.own_pose(element)
        return self.poses[name]

    def turn_axis(self, joint: Element, tag: str = "axis") -> Array:
        """(3,) an axis of a joint in the model's frame; z where it states none."""
        pose, axis = self.pose(str(joint.get("name"))), joint.find(tag)
        stated = etree.Element("axis") if axis is None else axis
        turned: Array = pose[:3, :3] @ self.axis_in_joint(stated, pose)
        return turned

    def limit(self, axis: Element) -> dict[str, str]:
        """The limits that an axis states, by URDF's names."""
        paths = {key: f"limit/{key}" for key in ("lower", "upper", "effort", "velocity")}
        stated = {key: self.numbers(axis, path, "0")[0] for key, path in paths.items() if axis.find(path) is not None}
        if not all(abs(stated.get(key, UNLIMITED)) < UNLIMITED for key in ("lower", "upper")):
            stated = {key: value for key, value in stated.items() if key not in ("lower", "upper")}
        return {key: short_numbers([value]) for key, value in stated.items()}

    def axis_in_joint(self, axis: Element, joint_pose: Array) -> Array:
        """(3,) the axis in the joint's frame: up to SDF 1.4 it is stated in the model's frame, to 1.6 there on request,
        since then in any frame."""
        stated = axis.find("xyz")
        direction = np.array(self.numbers(axis, "xyz", "0 0 1"))
        if direction.shape != (3,) or not np.isfinite(direction).all():
            raise self.unreadable(axis, "xyz", "it is not three finite numbers")
        expressed = "" if stated is None else str(stated.get("expressed_in") or "")
        in_model = self.text(axis, "use_parent_model_frame") in ("1", "true") or self.version <= FRAMED_AXES
        if expressed or in_model:
            direction = joint_pose[:3, :3].T @ self.pose(expressed)[:3, :3] @ direction
        return direction
