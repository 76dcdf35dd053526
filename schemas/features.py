"""Features extracted from an asset: links, joints, meshes and boxes, at the authored scale and in SI units."""

import math

from pydantic import Field

from schemas.base import Finite, Fraction, Frozen, Inertia6, NonNegative, Vector3
from schemas.vocabulary import VolumeSource


class MeshFeatures(Frozen):
    """One mesh reference of one link. A record holds hundreds of these, so only these few fields are kept."""

    file: str
    role: str
    watertight: bool
    flat: bool
    n_faces: int


class LinkInertial(Frozen):
    """An inertial as the URDF states it: mass, centre of mass and inertia about it, in the link's frame."""

    mass_kg: NonNegative
    com: Vector3
    inertia: Inertia6


class LinkContact(Frozen):
    """Contacts of a link as its file states them: Coulomb coefficient, and restitution from 0 (dead) to 1."""

    friction: Finite | None = None
    restitution: Finite | None = None


class LinkFeatures(Frozen):
    """One link: name, label, meshes, and the properties of their union in the link's frame. ``unit_inertia`` is the
    inertia about ``center`` divided by the mass (m²), of the link's own shape at uniform density; ``volume_m3`` is the
    sum over its convex pieces or watertight meshes. ``shell_center`` and ``shell_inertia`` are the same of a wall of
    even thickness along its faces, and ``outer_m2`` the area that it shows to the outside, a sheet with both sides. All
    at the authored scale. ``materials`` says what covers it, in words: part, colour, share of its area."""

    name: str
    label: str
    joint_kind: str
    meshes: tuple[MeshFeatures, ...]
    volume_m3: NonNegative
    volume_source: VolumeSource
    hull_volume_m3: NonNegative
    area_m2: NonNegative
    outer_m2: NonNegative = 0.0
    box_min: Vector3
    box_max: Vector3
    center: Vector3
    unit_inertia: Inertia6
    shell_center: Vector3 = (0.0, 0.0, 0.0)
    shell_inertia: Inertia6 = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    materials: tuple[str, ...]
    inertial: LinkInertial | None
    contact: LinkContact | None = Field(None, exclude_if=lambda stated: stated is None)
    shapes_doubt: str = Field("", exclude_if=lambda doubt: not doubt)
    """Why its collision shapes are not used as its file has them; empty where they are, or where it has none."""

    @property
    def box_size(self) -> Vector3:
        """(3,) edge lengths of the link's box in its own frame, m."""
        low, high = self.box_min, self.box_max
        return (high[0] - low[0], high[1] - low[1], high[2] - low[2])

    @property
    def diagonal_m(self) -> float:
        """Diagonal of the link's box, m."""
        return math.hypot(*self.box_size)

    @property
    def has_shapes(self) -> bool:
        """Whether its file gives it collision shapes of its own."""
        return any(mesh.role == "collision" for mesh in self.meshes)

    @property
    def has_geometry(self) -> bool:
        """Whether any mesh or primitive belongs to the link."""
        return self.hull_volume_m3 > 0.0 or self.area_m2 > 0.0


class Mimic(Frozen):
    """How a joint follows another: its position is ``multiplier`` × that of ``joint`` + ``offset``, rad or m. Chains
    are resolved: ``joint`` itself follows none."""

    joint: str
    multiplier: Finite = 1.0
    offset: Finite = 0.0

    def at(self, leader: float) -> float:
        """The follower's position where its leader is at ``leader``."""
        return self.multiplier * leader + self.offset

    def leader_at(self, follower: float) -> float:
        """The leader's position where its follower is at ``follower``."""
        return (follower - self.offset) / self.multiplier


class JointFeatures(Frozen):
    """One joint as authored, with which end of its range is closed and which is open.

    Positions are radians (revolute, continuous) or metres (prismatic). ``closed`` and ``open`` are None for fixed
    joints; for continuous joints both are the authored zero. ``openness_confidence`` is 0 (a guess) to 1.
    ``axis`` is in the joint's frame, ``axis_in_root`` in the root link's frame at the rest pose.
    """

    name: str
    type: str
    parent: str
    child: str
    origin_xyz: Vector3
    origin_rpy: Vector3
    axis: Vector3
    axis_in_root: Vector3
    lower: Finite | None
    upper: Finite | None
    effort: Finite | None
    velocity: Finite | None
    damping: Finite | None
    friction: Finite | None
    mimic: Mimic | None
    closed: Finite | None
    open: Finite | None
    openness_confidence: Fraction
    other_reading: str = Field("", exclude_if=lambda means: not means)
    """Consequence if a guessed end were the other, in words; "" where its shape tells."""
    stiffness: Finite | None = Field(None, exclude_if=lambda stated: stated is None)
    """Of its spring, N·m/rad or N/m; None where the file states none."""
    start: Finite | None = Field(None, exclude_if=lambda stated: stated is None)
    """Where the file says that it starts, rad or m from the zero at which it is drawn; None where it does not."""

    @property
    def movable(self) -> bool:
        """Whether the joint has a degree of freedom that can be given a position."""
        return self.type in ("revolute", "continuous", "prismatic")

    @property
    def prismatic(self) -> bool:
        """Whether positions are metres."""
        return self.type == "prismatic"


class RestOverlap(Frozen):
    """Two links that overlap as drawn, every joint at position 0, and how deep at most, as a share of the closed
    object's longest edge; None: deeper than was looked for."""

    link_a: str
    link_b: str
    depth_share: NonNegative | None


class Features(Frozen):
    """All extracted features of one asset (I = {M, G, S, A}; the views V are rendered on demand).

    ``rest_box_min`` and ``rest_box_max`` bound the object at its rest pose in the root link's frame, m.
    ``closed_size`` is the edges of its upright box with every joint closed, m; ``link_centers`` maps each link with
    geometry to the centre of its box at rest in the root link's frame, m, and ``link_boxes`` to that box's edges along
    the axes of that frame; ``link_feet`` has the middle of its lowest points in that box seen from above, as shares,
    where it is far from the box's own: an arc lamp's. All at the authored scale. ``front`` is the horizontal unit
    direction in the root link's frame that the object faces.
    """

    asset_id: str
    category: str
    urdf_file: str
    root: str
    links: tuple[LinkFeatures, ...]
    joints: tuple[JointFeatures, ...]
    rest_box_min: Vector3
    rest_box_max: Vector3
    closed_size: Vector3
    link_centers: dict[str, Vector3]
    link_boxes: dict[str, Vector3]
    link_feet: dict[str, tuple[float, float]] = Field(default_factory=dict, exclude_if=lambda feet: not feet)
    content_hash: str
    front: Vector3 = (-1.0, 0.0, 0.0)
    metric: str = ""
    """Why its lengths are metres as authored; empty where nothing says so, as of normalised meshes."""
    keep: tuple[str, ...] = ("plausible",)
    """Which of its file's numbers stay, in the words of ``--keep``."""
    hangs: str = Field("", exclude_if=lambda why: not why)
    """Evidence of its shape, in words, that it hangs on a wall; empty where there is none."""

    @property
    def rest_size(self) -> Vector3:
        """(3,) edge lengths of the object's box at the rest pose, m at scale 1."""
        low, high = self.rest_box_min, self.rest_box_max
        return (high[0] - low[0], high[1] - low[1], high[2] - low[2])

    @property
    def movable_joints(self) -> tuple[JointFeatures, ...]:
        """The joints that have a position."""
        return tuple(joint for joint in self.joints if joint.movable)

    def link(self, name: str) -> LinkFeatures:
        """The link of that name; KeyError if there is none."""
        for link in self.links:
            if link.name == name:
                return link
        raise KeyError(name)

    def joint(self, name: str) -> JointFeatures:
        """The joint of that name; KeyError if there is none."""
        for joint in self.joints:
            if joint.name == name:
                return joint
        raise KeyError(name)
