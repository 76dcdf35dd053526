"""Thresholds of the verdict, each with its unit and its reason."""

from dataclasses import dataclass

from pydantic import Field

from schemas.base import Fraction, Frozen, NonNegative, Positive


@dataclass(frozen=True)
class Bound:
    """A bound that a check declares itself: its name in ``Thresholds.further``, value, unit, and why it is so."""

    name: str
    value: float
    unit: str
    reason: str


class Thresholds(Frozen):
    """Thresholds of the verdict. The drift and oscillation bounds are the paper's (section 1 of the evaluation)."""

    penetration_m: NonNegative = 0.002
    """Φ above which a state is invalid, m: the paper's refinement approves a state at Φ ≤ 2 mm."""
    drift_m: Positive = 1e-3
    """Furthest the root may move over the test, m."""
    drift_rad: Positive = 1e-2
    """Furthest the root may turn over the test, rad."""
    oscillation_sign_changes: int = Field(3, ge=1)
    """Reversals of a joint that count as oscillation ..."""
    oscillation_rad: Positive = 0.05
    """... where a hinge's amplitude is above this, rad ..."""
    oscillation_m: Positive = 0.005
    """... or a slider's above this, m (the paper states none: 5 mm is as visible as 0.05 rad at 10 cm)."""
    peak_speed_m_s: Positive = 6.0
    """Fastest any link may move, m/s: a drop from 5 cm ends at 1 m/s, so at 6 m/s the simulation adds energy."""
    final_speed_m_s: Positive = 0.05
    """Fastest link at the end of a drop or a perturbed start that counts as at rest, m/s."""
    sink_m: Positive = 5e-3
    """How deep an object may end in the plane, m."""
    stands_rad: Positive = 0.0873
    """Furthest an object may tilt from how it is set down, rad: at five degrees a person sees that it leans."""
    stands_m: Positive = 0.03
    """Furthest the root's centre of mass may travel from where it is set down, m: a hand's thickness."""
    stands_m_s: Positive = 0.5
    """Fastest the root may move while it settles, m/s: as after a fall of 12 mm, which uneven feet explain."""
    stands_margin_rad: Positive = 0.0349
    """Least angle by which an object at rest may be turned until it tips over, rad: two degrees ..."""
    touch_j: Positive = 0.02
    """... unless tipping it over takes more than a touch has, J: a hand of 0.43 kg (0.6 % of a body, de Leva 1996) at
    the 0.3 m/s at which hands let go."""
    held_by_hand_kg: Positive = 1.0
    """Mass below which one hand holds the object while the other presses a part sideways or from below, kg: a remote
    control or a camera. The same as that of ``PhysicsSettings``, which makes springs for it."""
    state_share: Fraction = 0.10
    """Share of its range that a joint may settle away from the position that is asked of it."""
    nudge_remaining: Fraction = 0.1
    """Share of a nudged joint's speed that may be left after the nudge's time."""
    sweep_overlap_m: Positive = 2e-3
    """Overlap beyond the initial one from which a joint counts as jammed, m."""
    sweep_free_share: Fraction = 0.9
    """Share of its range that a joint must move freely, unless authored geometry or the floor stops it."""
    sweep_excused_share: Fraction = 0.3
    """Share of its range that a joint must move freely whatever stops it: a door that opens by 30° lets a hand in, a
    drawer by a third of its depth; what moves less is of no use."""
    hold_rad: Positive = 0.02
    """Furthest that a joint may go that must stay where it is placed, rad (a degree) ..."""
    hold_m: Positive = 2e-3
    """... or m."""
    release_share: Fraction = 0.1
    """Share of its way to rest that a released joint may have left when its time is over."""
    reset_turn_rad: Positive = 0.1
    """Furthest from upright that an object may end after a perturbed start, rad."""
    reset_joint_share: Fraction = 0.10
    """Share of its range that a joint which must hold may move over a perturbed start: as far as the search may go
    without leaving the requested state. A fall from 2 cm jolts any friction hinge."""
    reset_slip_margin: Positive = 1.5
    """How far such a joint may slip over what the energy of the fall takes it against its friction: the object rocks
    and lands more than once. Of 714 slips of 150 objects in three engines the furthest was 1.28 times that."""
    further: dict[str, float] = Field(default_factory=dict)
    """Bounds that further checks declare themselves, where they are to be others: name → value."""

    def of(self, bound: Bound) -> float:
        """The value in force of a bound that a check declares."""
        return self.further.get(bound.name, bound.value)
