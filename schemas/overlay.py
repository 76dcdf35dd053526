"""Overlays: what a model proposes (``Overlay``), and what validation makes of it (``PhysicsOverlay``)."""

from typing import Annotated, Literal

from pydantic import Field

from schemas.authored import Authored
from schemas.base import Finite, Fraction, Frozen, Inertia6, NonNegative, Positive, Vector3
from schemas.features import Mimic
from schemas.mechanism import Bias, EffortRange, MechanismName
from schemas.support import Support, SupportProposal
from schemas.vocabulary import MassRule, Source, VolumeSource

Level = Literal["super low", "low", "medium", "high", "super high"]
"""The paper's words for a place in a range."""

NoteKind = Literal["size", "mass", "motion", "state", "support", "data", "unmet"]
"""Subject of a model's remark: ``data`` is odd about the given object, ``unmet`` cannot be done as asked."""


class ModelNote(Frozen):
    """A model's remark on its answer, kept as a finding: its kind, the link or joint that it is ``about``, and why."""

    kind: NoteKind
    about: str | None = None
    text: str


class Unclear(Frozen):
    """A question that a model could not answer: ``about`` is ``scale``, or a link's or joint's name."""

    about: str
    why: str


class Content(Frozen):
    """Something heavy inside a link: a motor, a battery, a counterweight. ``at`` is the place of its middle in the
    link's box at rest, along the root link's axes (z up), as shares from the lowest corner; it fills the share
    ``extent`` of each edge of that box."""

    name: str
    mass_kg: Positive
    at: tuple[Fraction, Fraction, Fraction] = (0.5, 0.5, 0.5)
    extent: Fraction = 0.4


class LinkProposal(Frozen):
    """A model's proposal for one link. Either ``mass_kg``, or ``density_kg_m3`` with ``wall_m`` (for a shell) or
    ``hollow_factor`` (for what is solid), and ``contents`` beside.

    ``wall_m`` is the thickness of the wall over the link's outer area, m at the final scale; it counts before
    ``hollow_factor``, the share of the link's volume that is material: solid 0.8 to 1, shelled 0.4 to 0.8, thin shell
    0.2 to 0.5, less for hulls that enclose an interior. ``inertia`` and ``com`` are at the final scale, in the link's
    frame. ``appearance`` is what was seen of it: shine, thickness, whether light passes.
    """

    name: str
    appearance: str | None = None
    material: str | None = None
    density_kg_m3: Positive | None = None
    hollow_factor: Fraction | None = None
    wall_m: Positive | None = None
    contents: tuple[Content, ...] = ()
    mass_kg: Positive | None = None
    com: Vector3 | None = None
    inertia: Inertia6 | None = None


class JointProposal(Frozen):
    """A model's proposal for one joint: absolute terms, or what a person feels, from which the terms are derived.

    Absolute: ``damping`` (N·m·s/rad or N·s/m), ``friction`` (N·m or N), ``stiffness`` (N·m/rad or N/m).
    Felt: ``coast_s`` is the time in which a free joint loses 63 % of its speed, ``spring_hz`` the frequency at which a
    spring-loaded part would bounce undamped, ``spring_rest`` the position to which it returns (authored scale),
    ``holds`` whether the joint must stay where it is placed against gravity.
    ``press_start`` and ``press_end`` are the force with which its spring resists as it starts to move away from
    ``spring_rest``, and at the far end: N on a slider, N at the far edge of a hinged part. They count before
    ``spring_hz``.
    Wishes, which count before ``coast_s`` and ``spring_hz``: ``closes_s`` is the time in which gravity shuts the part
    from half open, ``stops_within`` how far it glides (m at the final scale, or rad) when a hand lets it go at its
    usual speed, ``returns_s`` the time in which its spring brings it back from its far end; over 0.2 s it counts before
    the press too. Closed and back are a tenth of the way from it. ``damping_level`` is the user's word for damping,
    which the paper's rule needs. ``mechanism`` is what people would call it; None: as its part usually has it.
    ``effort_n`` and ``effort_nm`` are what the user says that moving the part takes: N at its far edge, N·m about its
    hinge. ``stiff``: the user calls it hard to move.
    """

    name: str
    damping: NonNegative | None = None
    friction: NonNegative | None = None
    stiffness: NonNegative | None = None
    coast_s: Positive | None = None
    spring_hz: Positive | None = None
    spring_rest: Finite | None = None
    press_start: NonNegative | None = None
    press_end: NonNegative | None = None
    holds: bool | None = None
    closes_s: Positive | None = None
    stops_within: Positive | None = None
    returns_s: Positive | None = None
    damping_level: Level | None = None
    mechanism: MechanismName | None = None
    effort_n: Positive | None = None
    effort_nm: Positive | None = None
    stiff: bool = False


class Disagreement(Frozen):
    """A model's objection to a number that a file in metres states: its own ``value`` for the ``quantity`` of the link
    or joint that it is ``about`` (in the unit in which it was told, sizes as a scale), and ``why``."""

    quantity: Literal["size", "mass", "damping", "friction", "springs", "start", "contact"]
    about: str = ""
    value: Finite
    why: str = ""


class MassChange(Frozen):
    """The whole object's mass, kg, as its parts gave it and as it was brought to, and why in words."""

    from_kg: NonNegative
    to_kg: Positive
    why: str
    asked: bool = False
    """Whether the user stated the mass."""


class Overlay(Frozen):
    """A model's whole proposal. ``scale`` is uniform; positions are radians, or metres at the authored scale.

    ``initial_joint_positions`` names only joints for which the user asks a state; every other joint starts closed or at
    its authored zero. ``asked`` names what in the answer came from the user's words: ``scale``, or a joint's name; of
    the user's own numbers also the path, ``links.NAME.mass_kg`` or ``initial_joint_positions.NAME``. ``sigmas`` is the
    model's own standard deviation of a number in the answer, in its unit, by path: ``scale``, ``links.NAME.FIELD``,
    ``joints.NAME.FIELD``, ``initial_joint_positions.NAME``. ``uncertainty`` is that of the numbers that it may be asked
    about again: ``scale`` → relative, a joint's name → of its asked position, rad or m at the authored scale.
    ``mass_change`` says that the links' masses were scaled together. ``size_reason`` is how the scale was found,
    ``findings`` are remarks by kind, ``unclear`` is what could not be told, ``disagrees`` which of a file's own numbers
    it holds to be wrong. ``contact_friction`` and ``restitution``
    are stated only where the user does.
    """

    size_reason: str | None = None
    scale: Positive
    contact_material: str | None = None
    contact_friction: Annotated[float, Field(gt=0.0, le=2.0)] | None = None
    restitution: Fraction | None = None
    support: SupportProposal | None = None
    links: tuple[LinkProposal, ...] = ()
    joints: tuple[JointProposal, ...] = ()
    initial_joint_positions: dict[str, Finite] = Field(default_factory=dict)
    asked: tuple[str, ...] = ()
    sigmas: dict[str, NonNegative] = Field(default_factory=dict)
    uncertainty: dict[str, NonNegative] = Field(default_factory=dict)
    mass_change: MassChange | None = None
    notes: tuple[str, ...] = ()
    findings: tuple[ModelNote, ...] = ()
    unclear: tuple[Unclear, ...] = ()
    disagrees: tuple[Disagreement, ...] = Field((), exclude_if=lambda said: not said)


class LinkPhysics(Frozen):
    """One link's written physics: mass, centre of mass and inertia about it, at the final scale in the link's frame.

    ``mass_rule`` says how the mass was made: ``volume_m3`` × ``density_kg_m3`` × ``hollow_factor``, or ``outer_m2`` ×
    ``wall_m`` × density, and ``contents``. ``wall_m`` is 0 where no wall was proposed."""

    name: str
    label: str
    material: str | None
    density_kg_m3: NonNegative
    hollow_factor: NonNegative
    volume_m3: NonNegative
    volume_source: VolumeSource
    outer_m2: NonNegative = 0.0
    wall_m: NonNegative = 0.0
    contents: tuple[Content, ...] = ()
    mass_rule: MassRule = MassRule.STATED
    mass_kg: Positive
    mass_source: Source
    com: Vector3
    com_source: Source
    inertia: Inertia6
    inertia_source: Source
    shapes_source: Source | None = Field(None, exclude_if=lambda source: source is None)
    """Where its collision shapes come from; None for one without geometry, or that was not validated."""


class JointPhysics(Frozen):
    """One joint's written physics, at the final scale. ``lower`` and ``upper`` are None for continuous joints.

    ``effective_inertia`` (kg·m² or kg) is what a torque or force on this joint alone accelerates, everything free:
    1 / (M⁻¹)ⱼⱼ of the floating-base mass matrix at the initial position. ``gravity_load`` (N·m or N) is gravity's
    pull on the joint there, the object resting as authored. ``least_inertia`` is the smallest effective inertia over
    the joints' ranges, which bounds damping and stiffness under an explicit time step; 0 where not computed.
    """

    name: str
    type: str
    label: str
    damping: NonNegative
    damping_source: Source
    friction: NonNegative
    friction_source: Source
    stiffness: NonNegative
    stiffness_source: Source
    spring_reference: Finite
    lower: Finite | None
    upper: Finite | None
    limits_source: Source
    closed: Finite
    open: Finite
    initial_position: Finite
    position_source: Source
    effective_inertia: NonNegative
    gravity_load: Finite
    holds: bool
    least_inertia: NonNegative = 0.0
    asked_position: Finite | None = None
    """The position that the proposal asks for, rad or m; None without one. The search may leave it slightly."""
    effort_range: EffortRange | None = None
    """What a hand should need at the part's edge; None where not known."""
    armature: NonNegative = 0.0
    """Inertia reflected onto the joint, kg·m² or kg: it resists the joint's own motion and weighs nothing. It lets a
    solver bear a stiff spring on a part of a gram; the effective inertias do not contain it."""
    mimic: Mimic | None = None
    """What the joint follows, at the final scale; None for one with a position of its own."""
    exact: bool = False
    """Whether the user states the initial position as a number, which no search moves."""
    mechanism: MechanismName | None = None
    bias: Bias | None = None
    """Effort of its mechanism besides the spring; None for most."""

    @property
    def unit(self) -> str:
        """Unit of its positions."""
        return "m" if self.type == "prismatic" else "rad"

    def exerted(self, position: float) -> float:
        """Effort of its spring and its mechanism on it at a position (rad or m), N·m or N."""
        spring = self.stiffness * (self.spring_reference - position)
        return spring if self.bias is None else spring + self.bias.at(position)

    def following(self, leader: "JointPhysics") -> "JointPhysics":
        """The joint where its leader has it: position, range and ends."""
        mimic = self.mimic
        assert mimic is not None, "only a joint that follows another has a leader"
        ends: tuple[float | None, float | None] = (None, None)
        if leader.lower is not None and leader.upper is not None and self.type != "continuous":
            first, second = mimic.at(leader.lower), mimic.at(leader.upper)
            ends = min(first, second), max(first, second)
        names = ("initial_position", "closed", "open")
        places = {name: mimic.at(getattr(leader, name)) for name in names}
        return self.model_copy(update={"lower": ends[0], "upper": ends[1], **places})


class PhysicsOverlay(Frozen):
    """A complete overlay: every link and every movable joint, nothing left to an engine's default.

    ``joints`` have positions of their own; ``followers`` are where those have them (``mimic``), and what they state of
    position, range and ends counts only as ``all_joints`` has it."""

    asset_id: str
    scale: Positive
    scale_source: Source
    scale_sigma: NonNegative | None = Field(None, exclude_if=lambda sigma: sigma is None)
    """Relative standard deviation of the size, as its proposal states it; None where it does not."""
    contact_friction: NonNegative
    contact_source: Source | None = Field(None, exclude_if=lambda source: source is None)
    """Where that comes from; None where it was not validated."""
    rolling_friction_m: NonNegative = 0.0
    """Lever of the rolling resistance of every contact, m; engines without rolling resistance ignore it."""
    turned_rad: Vector3 = (0.0, 0.0, 0.0)
    """Rotation vector by which the whole object is turned about its root's origin from how it is authored, rad: what
    does not stand as authored is written as it lies."""
    front: Vector3 | None = Field(None, exclude_if=lambda front: front is None)
    """(3,) the horizontal unit direction in the root's frame in which it faces; None where that was not looked for."""
    support: Support = Support()
    """What carries the object: the root of a fixed one is held to the world."""
    links: tuple[LinkPhysics, ...]
    joints: tuple[JointPhysics, ...]
    followers: tuple[JointPhysics, ...] = ()
    notes: tuple[str, ...] = ()
    passing: tuple[tuple[str, str], ...] = Field((), exclude_if=lambda pairs: not pairs)
    """Pairs of links that pass through each other, since they meet as drawn in every state."""
    authored: tuple[Authored, ...] = Field((), exclude_if=lambda judged: not judged)
    """Numbers of a file in metres, by how far each is believed; one whose source is ``authored`` is kept."""

    @property
    def all_joints(self) -> tuple[JointPhysics, ...]:
        """The joints, and then those that follow them as they stand now."""
        leaders = {joint.name: joint for joint in self.joints}
        follow = [joint.following(leaders[joint.mimic.joint]) for joint in self.followers if joint.mimic is not None]
        return (*self.joints, *follow)

    def with_followers(self) -> "PhysicsOverlay":
        """The overlay whose ``followers`` state what ``all_joints`` has, to be read without this class."""
        return self.model_copy(update={"followers": self.all_joints[len(self.joints) :]})

    @property
    def mass_kg(self) -> float:
        """The mass of the whole object, kg."""
        return sum(link.mass_kg for link in self.links)

    @property
    def initial_positions(self) -> dict[str, float]:
        """Joint name → initial position, radians or metres at the final scale, of the followers too."""
        return {joint.name: joint.initial_position for joint in self.all_joints}
