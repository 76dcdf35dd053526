"""Simulated objects: a refined object, or a raw one as it came, with the state in which it starts."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import yourdfpy
from pydantic import ValidationError

from asset2sim.assets.authored import REFINED_NAME, read_overlay
from asset2sim.assets.extract import DescriptionFile
from asset2sim.assets.folder import URDF_NAME
from asset2sim.assets.urdf.read import Dynamics, read_dynamics, read_urdf, root_of, tree_joint
from asset2sim.intake.origin import open_origin
from asset2sim.physics.kinematics import TreeJoint, parents_first, rigid_links
from schemas.errors import AssetError
from schemas.overlay import JointPhysics
from schemas.settings import PhysicsSettings
from schemas.support import SupportKind
from schemas.vocabulary import FailureMode

TURN_RAD = np.pi
"""Half of the range that a slider has for a joint without limits, rad."""
EFFORT_SHARE = 4.0
"""End of an effort slider, as a multiple of what moves the joint against friction, gravity and spring."""
LEAST_EFFORT = {"prismatic": 1.0, "revolute": 0.1, "continuous": 0.1}
"""Least end of an effort slider, N or N·m."""


@dataclass(frozen=True)
class Movable:
    """One movable joint: its range (rad or m), its start, and the effort (N·m or N) at the end of its slider.
    ``inertia`` is what an effort on it accelerates (kg·m² or kg; 0 where not known), ``needed`` the effort that
    friction, gravity and spring together may ask of a hand."""

    tree: TreeJoint
    label: str
    lower: float
    upper: float
    start: float
    terms: Dynamics
    inertia: float = 0.0
    needed: float = 0.0

    @property
    def name(self) -> str:
        """The joint's name."""
        return self.tree.name

    @property
    def slides(self) -> bool:
        """Whether it is prismatic."""
        return self.tree.type == "prismatic"

    @property
    def unit(self) -> str:
        """Of its positions: m or rad."""
        return "m" if self.slides else "rad"

    @property
    def effort(self) -> float:
        """The largest effort of its slider, N or N·m."""
        return max(EFFORT_SHARE * self.needed, LEAST_EFFORT[self.tree.type])


@dataclass(frozen=True)
class ViewedObject:
    """A URDF with the state in which it starts: ``held`` says that its root is fixed to the world, ``in_hand`` that the
    other hand bears what a part is pulled with; ``scale`` is that of its authored size; ``source`` keeps a URDF alive
    that was made of another format."""

    urdf: Path
    root: str
    tree: tuple[TreeJoint, ...]
    joints: tuple[Movable, ...]
    contact_friction: float
    held: bool
    scale: float = 1.0
    in_hand: bool = False
    source: DescriptionFile | None = field(default=None, repr=False)

    @property
    def start(self) -> dict[str, float]:
        """Joint → its initial position, rad or m."""
        return {joint.name: joint.start for joint in self.joints}

    def moved_by(self, link: str) -> TreeJoint | None:
        """The nearest joint towards the root that moves the link; None where the root bears it."""
        parents = {joint.child: joint for joint in self.tree}
        while link in parents:
            if parents[link].type != "fixed":
                return parents[link]
            link = parents[link].parent
        return None

    def carried(self, link: str) -> tuple[str, ...]:
        """The links that move with one: those beyond the joint that moves it, or all."""
        joint = self.moved_by(link)
        return (self.root, *(item.child for item in self.tree)) if joint is None else rigid_links(self.tree, joint.name)


def refined_subject(folder: Path) -> ViewedObject:
    """A refined object in its asked state. Raises AssetError without a readable URDF or overlay."""
    file = folder / REFINED_NAME
    try:
        overlay = read_overlay(folder)
    except (OSError, ValidationError) as error:
        reason = str(error).splitlines()[0]
        raise AssetError(
            FailureMode.UNREADABLE_ASSET, "no_overlay", f"{file}: {reason}; refine the asset again (--force)"
        ) from error
    known = {joint.name: joint for joint in overlay.all_joints}
    found = _subject(folder / URDF_NAME, known, contact_friction=overlay.contact_friction, held=overlay.support.fixed)
    light = overlay.mass_kg < PhysicsSettings().held_by_hand_kg
    in_hand = not overlay.support.fixed and (light or overlay.support.kind is SupportKind.HANDHELD)
    return replace(found, scale=overlay.scale, in_hand=in_hand)


def raw_subject(folder: Path, *, held: bool) -> ViewedObject:
    """An object as it came, joints at zero or the nearest limit. Raises AssetError where no engine could read it."""
    source = open_origin(folder)
    friction = PhysicsSettings().contact_friction
    return replace(_subject(source.urdf, {}, contact_friction=friction, held=held), source=source)


def _subject(urdf: Path, known: Mapping[str, JointPhysics], *, contact_friction: float, held: bool) -> ViewedObject:
    robot = read_urdf(urdf)
    terms = read_dynamics(urdf)
    tree = parents_first([tree_joint(joint) for joint in robot.joints])
    limits = {joint.name: joint.limit for joint in robot.joints}
    joints = tuple(
        _movable(joint, limits[joint.name], terms[joint.name], known.get(joint.name))
        for joint in tree
        if joint.type != "fixed" and joint.mimic is None
    )
    return ViewedObject(urdf, root_of(robot), tree, joints, contact_friction, held)


def _movable(
    joint: TreeJoint, limit: "yourdfpy.Limit | None", terms: Dynamics, physics: JointPhysics | None
) -> Movable:
    lower, upper = (None, None) if limit is None else (limit.lower, limit.upper)
    stated = lower is not None and upper is not None and lower < upper and joint.type != "continuous"
    start = 0.0 if physics is None else physics.initial_position
    if lower is None or upper is None or not stated:
        lower, upper = start - TURN_RAD, start + TURN_RAD
    if physics is None:
        return Movable(joint, joint.name, lower, upper, float(np.clip(start, lower, upper)), terms)
    reach = max(abs(end - terms.spring_reference) for end in (lower, upper))
    needed = terms.friction + abs(physics.gravity_load) + terms.stiffness * reach
    inertia = (physics.least_inertia or physics.effective_inertia) + terms.armature
    return Movable(joint, physics.label or joint.name, lower, upper, start, terms, inertia, needed)
