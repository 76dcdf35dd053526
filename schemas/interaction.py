"""Records of one engine's interaction checks (drop, nudge, sweep, hold, release, opening, reset); no verdicts."""

from typing import TypeVar

from pydantic import Field, JsonValue

from schemas.base import Frozen, NonNegative, Positive, Vector3
from schemas.verdict import Judged
from schemas.vocabulary import Engine, OverlapCause


class ContactPair(Frozen):
    """Two links that overlap, with the deepest point and the sum over their contact points, m."""

    link_a: str
    link_b: str
    depth_m: NonNegative
    penetration_m: NonNegative
    n_points: int


class JointMotion(Frozen):
    """One joint's motion without actuation: A = max q − min q and the sign changes of Δq (paper, section 1)."""

    name: str
    amplitude: NonNegative
    sign_changes: int
    final_position: float


class Measurement(Frozen):
    """One engine's record of one asset.

    ``penetration_m`` is Φ(q) at the initial position under the engine's default contact filter. Drift and joint motion
    are taken over the test that follows settling, on a plane with a free base and no actuation. ``peak_speed_m_s``
    is the fastest link over settling and test; ``settle_motion`` each joint's furthest from its initial position.
    """

    engine: str
    engine_version: str
    timestep_s: float
    settle_s: float
    test_s: float
    penetration_m: NonNegative
    pairs: tuple[ContactPair, ...]
    drift_m: NonNegative
    drift_rad: NonNegative
    peak_speed_m_s: NonNegative
    joints: tuple[JointMotion, ...]
    settle_motion: dict[str, float]
    finite: bool
    console: tuple[str, ...] = ()


Record = TypeVar("Record", bound=Frozen)


class Drop(Frozen):
    """The object dropped on a plane in its initial state; ``sink_m`` is how far its lowest point ends below it."""

    timestep_s: float
    height_m: NonNegative
    seconds: NonNegative
    peak_speed_m_s: NonNegative
    final_speed_m_s: NonNegative
    sink_m: NonNegative
    finite: bool


class Nudge(Frozen):
    """One joint set in motion at ``speed`` (rad/s or m/s) and left alone, the root held. ``final_speed`` is the joint's
    own after ``seconds``, ``peak_speed_m_s`` that of the fastest link on the way."""

    joint: str
    speed: float
    final_speed: NonNegative
    peak_speed_m_s: NonNegative
    seconds: NonNegative
    finite: bool


class Obstacle(Frozen):
    """Obstacle to a joint at ``position`` (rad or m): the two links that overlap there, by how much, and why."""

    position: float
    link_a: str
    link_b: str
    depth_m: NonNegative
    cause: OverlapCause


class Sweep(Frozen):
    """One joint over its whole range, the others where they leave it most room (``others``, rad or m).

    ``free_share`` is the share of the range, 0 to 1, in one piece with the initial position, in which no two links
    overlap more than they do initially: the stretch from ``free_lower`` to ``free_upper``. ``start`` is the initial
    position; ``lower`` to ``upper`` is one turn about it where the joint has no limits.
    """

    joint: str
    lower: float
    upper: float
    free_share: float
    start: float = 0.0
    free_lower: float | None = None
    free_upper: float | None = None
    others: dict[str, float] = Field(default_factory=dict)
    obstacles: tuple[Obstacle, ...] = ()


class Hold(Frozen):
    """A joint that must stay where it is placed: how far it went in ``seconds``, the root held (rad or m)."""

    joint: str
    position: float
    moved: NonNegative
    seconds: NonNegative


class Release(Frozen):
    """A joint released away from the position to which gravity or its spring (``by``) moves it, the root held.

    ``start``, ``target`` and ``end`` are positions (rad or m); ``seconds`` the time until it was within a tenth of the
    way of ``target``, None if it never was. Friction can stop the joint anywhere between
    ``target`` (reached slowly) and ``far`` (reached from beyond); ``far`` is None where the two are the same.
    """

    joint: str
    by: str
    start: float
    target: float
    end: float
    seconds: float | None
    far: float | None = None

    @property
    def left(self) -> float:
        """Distance left at the end over the whole distance; 0 between ``target`` and ``far``."""
        return share_left(self.end, self.start, self.target, self.far)


def share_left(position: float, start: float, target: float, far: float | None) -> float:
    """Distance of a position from the interval ``target`` to ``far``, over the way from ``start`` to ``target``."""
    low, high = sorted((target, target if far is None else far))
    way = abs(target - start)
    return max(low - position, position - high, 0.0) / way if way > 0.0 else 0.0


class Opening(Frozen):
    """The least effort (N·m or N) that moves a joint from its initial position towards its open end, and towards its
    closed one; None where no effort up to its limit does, or where it is at that end. ``stuck`` says that no effort up
    to ``effort_limit`` moved it in a direction in which it has room."""

    joint: str
    opening: NonNegative | None
    closing: NonNegative | None
    effort_limit: NonNegative | None = None
    stuck: bool = False


class Stand(Frozen):
    """The object set down undisturbed, root free, in its initial state, until it rests.

    ``tilt_rad`` and ``travel_m`` are the furthest that the root's up axis turned and its centre of mass moved from how
    it was set down, ``peak_speed_m_s`` that of the root's centre of mass. At rest it tips over its nearest edge when
    turned by ``margin_rad``, which takes ``tip_energy_j``; both 0 where it stands on less than a triangle.
    """

    tilt_rad: NonNegative
    travel_m: NonNegative
    peak_speed_m_s: NonNegative
    seconds: NonNegative
    margin_rad: NonNegative
    tip_energy_j: NonNegative
    rest_turn_rad: Vector3 = (0.0, 0.0, 0.0)
    """Rotation vector, level and in the root's frame, that turns it from how it is set down to how it rests."""
    finite: bool


class SettledJoint(Frozen):
    """A joint of which a position is asked: that position and where it settled, rad or m; ``share`` is the distance
    between them over the joint's range."""

    joint: str
    asked: float
    settled: float
    share: NonNegative


class Effort(Frozen):
    """Effort that a hand needs to move a joint at its part's edge, as the object stands on the plane.

    ``effort`` (N·m or N) is the least that moves it ``way``, "opening" or "closing". A hinge's edge is at ``lever_m``
    from its axis; a slider's is 1. Pushed there in the direction of its motion, the object tips at ``tips_at_n`` and
    slides at ``slides_at_n`` (N; None where no force does).
    """

    joint: str
    way: str
    effort: NonNegative
    lever_m: Positive
    tips_at_n: NonNegative | None
    slides_at_n: NonNegative | None
    on_floor: bool = False
    """Whether the part is on the floor, so that the effort is the larger of that with the root held and that there."""

    @property
    def force_n(self) -> float:
        """The force at the part's edge that moves it, N."""
        return self.effort / self.lever_m


class Reset(Frozen):
    """One start from a perturbed pose: shifted by ``offset_m``, turned by ``tilt_rad`` (a rotation vector), or on a
    held base with every joint moved by ``joint_share``."""

    offset_m: Vector3
    tilt_rad: Vector3
    peak_speed_m_s: NonNegative
    final_speed_m_s: NonNegative
    turned_rad: NonNegative
    """Angle between the root's up axis at the end and at undisturbed rest, rad."""
    joint_motion: NonNegative
    """Largest distance between a holding joint's end and its undisturbed rest, as a share of its range; 0 where it is
    within the tolerance of the hold check."""
    joint: str | None = None
    """The joint of ``joint_motion``; None where that is 0."""
    joint_share: NonNegative = 0.0
    """How far every joint started from its initial position, as a share of its range: where the base is held."""
    slip_given: NonNegative = 0.0
    """Share of its range over which that joint's friction brakes the fall that the start gives its part."""
    finite: bool


class OverlapPair(Frozen):
    """Two links that overlap in the initial state, parent and child included, and why."""

    pair: ContactPair
    related: bool
    """Whether one is the other's parent: engines do not see such overlaps by default."""
    cause: OverlapCause


class Interaction(Frozen):
    """All interaction checks of one asset in one engine."""

    engine: Engine
    stand: Stand | None = None
    settled: tuple[SettledJoint, ...] = ()
    efforts: tuple[Effort, ...] = ()
    drops: tuple[Drop, ...] = ()
    nudges: tuple[Nudge, ...] = ()
    sweeps: tuple[Sweep, ...] = ()
    holds: tuple[Hold, ...] = ()
    releases: tuple[Release, ...] = ()
    openings: tuple[Opening, ...] = ()
    resets: tuple[Reset, ...] = ()
    tip_rise_m: NonNegative | None = None
    """The least rise of the centre of mass that topples the object from where it rests, m; None where not computed."""
    support_m: NonNegative = 0.0
    """Largest horizontal distance from its centre of mass to an edge of what it stands on, m."""
    further: dict[str, tuple[dict[str, JsonValue], ...]] = Field(default_factory=dict, exclude_if=lambda kept: not kept)
    """Records of checks from outside the package, by the names that they give them."""

    def records(self, name: str, kind: type[Record]) -> tuple[Record, ...]:
        """The records in ``further`` of that name."""
        return tuple(kind.model_validate(item) for item in self.further.get(name, ()))


class EngineReport(Frozen):
    """One engine's measurements of one asset. ``problem`` says why a part is missing: the engine ``refused`` the asset,
    needed too much memory (``starved``), or its process ``died``, by a crash or a hang (``timed_out``)."""

    engine: Engine
    engine_version: str
    measurement: Measurement | None = None
    interaction: Interaction | None = None
    problem: str | None = None
    timed_out: bool = False
    died: bool = False
    refused: bool = False
    starved: bool = False
    seconds: NonNegative = 0.0
    judged: Judged | None = None
    """The verdict, computed once, when the engine has measured."""
