"""Friction and springs with which a joint stays where it is left, and no more than a hand can move."""

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from asset2sim.physics.arrays import Array
from asset2sim.physics.mass_matrix import Pull
from asset2sim.validation.handling import SAFE_SHARE, Handling
from asset2sim.validation.limits import Range
from asset2sim.validation.positions import Start
from schemas.finding import Notes
from schemas.mechanism import CAUGHT, STAYS, Bias
from schemas.overlay import JointProposal
from schemas.settings import PhysicsSettings
from schemas.vocabulary import DynamicsRule

HELD_STATE = 0.05
"""Share of its range beyond the closed end from which a requested state counts as open, and so must be held."""
STOP_SHARE = 1e-3
"""Share of its range from a limit within which a joint rests on that stop."""
LEFT_SHARES = (0.25, 0.75)
"""Shares of its range between which a part that is left anywhere is left; near its ends it is put to the end."""
AHEAD_SHARE = 0.05
"""Share of its range from its closed end beyond which a door starts open."""
BALANCED = 0.05
"""Share of a part's largest pull by gravity below which its hinge's own friction keeps it."""
LEFT_SAMPLES = 17
"""Positions between them at which its load is taken."""


@dataclass(frozen=True)
class Balance:
    """A spring that carries a part's weight: ``stiffness`` (N·m/rad) and its relaxed position (rad); or a strut."""

    stiffness: float = 0.0
    reference: float = 0.0
    strut: Bias | None = None

    def at(self, positions: Array | float) -> Array:
        """(n,) its torque at these positions (rad), N·m."""
        places = np.asarray(positions, dtype=float)
        torque: Array = self.stiffness * (self.reference - places)
        return torque if self.strut is None else torque + np.vectorize(self.strut.at)(places)


NO_BALANCE = Balance()


@dataclass(frozen=True)
class Holding:
    """Holding of a joint: the friction (N·m or N) and the spring that carries part of its weight; ``cut`` says that a
    hand, or the object's stand, allows less friction than a bump would need, ``wanted``."""

    friction: float = 0.0
    wanted: float = 0.0
    balance: Balance = NO_BALANCE

    @property
    def cut(self) -> bool:
        """Whether the friction is less than was wanted."""
        return self.friction < 0.999 * self.wanted


def counterbalance(
    start: Start, pull: Pull, kind: Handling, least_inertia: float, settings: PhysicsSettings
) -> Balance:
    """The spring of a door that drops open, fitted over where people leave it, from where it starts or a quarter of its
    way on to its open end: stiffness and relaxed position leave the least worst load there (a line beside a sinusoid:
    7 % of its largest weight over a right angle), wound up by no more than a turn. Below, it pulls the door shut.
    None for a part of another kind, or that gravity does not pull open; but a flap too heavy for a hand, with the
    friction that would hold it, has a spring, whatever it is called."""
    span = start.range
    way, ahead = span.open - span.closed, start.position - span.closed
    if span.joint.prismatic or span.lower is None or way == 0.0:
        return NO_BALANCE
    load = float(pull.at(span.open))
    by_hand = (1.0 + settings.least_hold_margin) * abs(load) <= SAFE_SHARE * kind.lever * kind.range.most_n
    if not kind.counterbalanced and by_hand:
        return NO_BALANCE
    # Upright hinges have no load to carry, and what gravity shuts needs a strut and not this spring.
    if load * way <= 0.0 or abs(load) < settings.bump_share * math.hypot(pull.force, pull.slope):
        return NO_BALANCE
    first = ahead / way if ahead / way > AHEAD_SHARE else LEFT_SHARES[0]
    places = span.closed + way * np.linspace(min(first, LEFT_SHARES[0]), 1.0, LEFT_SAMPLES)
    loads = pull.at(places)
    largest = settings.max_stiffness_step * least_inertia / settings.coarse_timestep_s**2
    softest = min(abs(load) / math.tau, largest)
    fitted = minimize_scalar(
        lambda slope: float(np.ptp(loads - slope * places)),
        bounds=(softest, largest),
        options={"xatol": 1e-6 * largest},
    )
    left = loads - fitted.x * places
    wound = (left.max() + left.min()) / (2.0 * fitted.x) + span.closed
    return Balance(float(fitted.x), float(span.closed - np.clip(wound, -math.tau, math.tau)))


def holding(
    start: Start,
    pull: Pull,
    largest_gravity: float,
    kind: Handling,
    balance: Balance,
    *,
    bump_share: float,
    margin: float,
    settings: PhysicsSettings,
) -> Holding:
    """The friction that holds a joint, ``margin`` times its load, where it starts and where people leave it, bears a
    bump of ``bump_share`` of gravity, and leaves a hand able to move it; at least what holds it where it starts.

    ``largest_gravity`` (N·m or N) is gravity's largest pull on it in any direction.
    """
    here = float(pull.at(start.position) + balance.at(start.position))
    load, bump = abs(here), bump_share * largest_gravity
    if on_stop(start, here):
        load, bump = 0.0, max(bump - abs(here), 0.0)
    least = settings.least_hold_margin * load
    left = float(np.abs(load_where_left(start.range, pull, balance)).max(initial=0.0))
    if kind.anywhere:
        load = max(load, left)
    # What is left anywhere resists a hand both ways, by detents or a brake: a dial, a blade.
    felt = kind.least_effort if kind.anywhere else felt_friction(kind, here)
    if leads_off_its_stop(start, here):
        felt = kind.least_effort + abs(here)
    # What springs leave of a door's weight, and with what they would lift it from its open end.
    felt = max(felt, settings.least_hold_margin * left) if balance.stiffness > 0.0 else felt
    wanted = max(margin * load, bump, felt)
    bearable = min(kind.most_upward + here, kind.most_downward - here)
    return Holding(max(min(wanted, bearable), least), wanted, balance)


def felt_friction(kind: Handling, load: float) -> float:
    """The friction (N·m or N) with which a part takes its kind's least effort the harder way, against its ``load``."""
    return max(kind.least_effort - abs(load), 0.0)


def leads_off_its_stop(start: Start, load: float) -> bool:
    """Whether the joint's load (N·m or N) helps the only way that it has from the stop where it starts."""
    return load != 0.0 and on_stop(start, -load)


def friction_armature(friction: float, least_inertia: float, travel: float, settings: PhysicsSettings) -> float:
    """The armature (kg·m² or kg) with which solvers hold a part still by this friction (N·m or N), 0 for most: the cap
    of a bottle is light beside what its thread resists, and creeps out of it where its ``travel`` (rad or m) is short.
    """
    if settings.dynamics is DynamicsRule.PAPER:
        return 0.0
    most = min(settings.max_friction_step, settings.max_friction_creep * travel)
    return max(friction / most - least_inertia, 0.0)


def load_where_left(span: Range, pull: Pull, balance: Balance) -> Array:
    """(n,) load (N·m or N) on a joint over the middle of its range; over a whole turn where it has no limits."""
    low, high = (-math.pi, math.pi) if span.lower is None or span.upper is None else (span.lower, span.upper)
    shares = (0.0, 1.0) if span.lower is None else LEFT_SHARES
    positions = np.linspace(low + shares[0] * (high - low), low + shares[1] * (high - low), LEFT_SAMPLES)
    return pull.at(positions) + balance.at(positions)


def on_stop(start: Start, load: float) -> bool:
    """Whether the joint starts at the stop against which its load (N·m or N) presses it."""
    stop = start.range.upper if load > 0.0 else start.range.lower
    return stop is not None and abs(start.position - stop) <= STOP_SHARE * start.range.span


def gravity_moves(start: Start, pull: Pull, largest_gravity: float) -> bool:
    """Whether gravity alone would move the joint away from where it starts: it is not near its balance, and no stop is
    in its way. ``largest_gravity`` (N·m or N) is gravity's largest pull on it in any direction."""
    load = float(pull.at(start.position))
    return abs(load) > BALANCED * largest_gravity and not on_stop(start, load)


def must_hold(proposal: JointProposal, start: Start, pull: Pull, largest_gravity: float, notes: Notes) -> bool:
    """Whether a joint must stay where it is placed: as proposed, also by its mechanism, else where it is asked to stand
    open."""
    if proposal.holds is not None:
        return proposal.holds
    if proposal.mechanism is not None and proposal.mechanism not in CAUGHT:
        return proposal.mechanism in STAYS
    holds = start.requested and is_open(start)
    if holds and gravity_moves(start, pull, largest_gravity):
        name = start.range.joint.name
        message = f"joint '{name}': asked to stand at {start.position:.4g}, where its weight would move it: it holds"
        notes.info("holds_implied", message, joint=name, value=start.position)
    return holds


def is_open(start: Start) -> bool:
    """Whether the joint starts open: away from its closed end by more than ``HELD_STATE`` of its range."""
    return abs(start.position - start.range.closed) > HELD_STATE * start.range.span
