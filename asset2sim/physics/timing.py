"""Joint terms from what a person can name: how far it glides, how long it takes to fall shut or spring back.

Everything is the motion of one coordinate, the root held: I q̈ = F(q) - c q̇ - f, with damping c and dry friction f.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from asset2sim.physics.arrays import Array
from asset2sim.physics.terms import JointLoad
from schemas.overlay import JointProposal
from schemas.settings import PhysicsSettings

ARRIVED_SHARE = 0.1
"""Share of the way that may be left when a part counts as shut or returned: the last bit has no visible end."""
RETURN_CRITICAL = 3.8897
"""ω t at which a critically damped spring has a tenth of its way left: (1 + x) exp(-x) = 0.1."""
EVEN_SHARE = 1.0 - math.log(2.0)
"""Distance over v₀ τ where damping and friction brake equally at first: τ v₀ (1 - a τ / v₀ ln(1 + v₀ / (a τ)))."""
STEPS = 240
"""Time steps of one trial motion: exact for a constant force, and a lid's gravity changes slowly."""
GRID, ROUNDS = 65, 2
"""Trial values a round and rounds: together they find a value between bounds 300 times apart to 0.1 %."""
LONGEST_S = 60.0
"""Longest motion that is simulated, s."""

Force = Callable[[Array], Array]
"""(n,) distances left (rad or m) → (n,) force towards the end (N·m or N), friction and damping left out."""


@dataclass(frozen=True)
class Brake:
    """Damping (N·m·s/rad or N·s/m) and dry friction (N·m or N), and what they achieve (s, rad or m)."""

    damping: float
    friction: float
    achieved: float


def glide_distance(speed: float, decay_s: float, deceleration: float) -> float:
    """How far (m or rad) a part with this speed goes: τ v₀ - a τ² ln(1 + v₀ / (a τ)); v₀ τ without friction.
    ``decay_s`` is τ = I / c, ``deceleration`` a = f / I; v₀² / (2 a) without damping."""
    if deceleration <= 0.0:
        return speed * decay_s
    if decay_s > 1e6 * speed / deceleration:  # the logarithm's first terms cancel
        return speed**2 / (2.0 * deceleration)
    ratio = speed / (deceleration * decay_s)
    return decay_s * speed - deceleration * decay_s**2 * math.log1p(ratio)


def stopping_dynamics(
    inertia: float, speed: float, distance: float, largest_damping: float, friction: float | None, least_friction: float
) -> Brake:
    """Damping and friction that stop ``inertia`` from ``speed`` within ``distance`` on a level path.

    Where no friction is stated both brake equally at first: c = (1 - ln 2) I v₀ / d and f = c v₀. Friction is at least
    ``least_friction``, which may stop it sooner; where damping is at its bound, friction does the rest.
    """
    decay = distance / (EVEN_SHARE * speed)
    shortest = inertia / largest_damping
    wanted = friction if friction is not None else max(least_friction, inertia * speed / decay)
    if friction is None and decay < shortest:
        low, high = 0.0, speed**2 / (2.0 * distance)
        for _ in range(60):
            middle = (low + high) / 2.0
            far = glide_distance(speed, shortest, middle) > distance
            low, high = (middle, high) if far else (low, middle)
        wanted = max(least_friction, high * inertia)
    deceleration = wanted / inertia
    if deceleration > 0.0 and speed**2 / (2.0 * deceleration) <= distance:
        # Friction alone stops it: a tenth of the usual damping is left, so that nothing rings.
        damping = min(ARRIVED_SHARE * inertia / decay, largest_damping)
    else:
        low, high = shortest, max(shortest, decay) * 1e3
        for _ in range(80):
            middle = math.sqrt(low * high)
            low, high = (middle, high) if glide_distance(speed, middle, deceleration) < distance else (low, middle)
        damping = inertia / low
    return Brake(damping, wanted, glide_distance(speed, inertia / damping, deceleration))


def distance_left(
    seconds: float, way: float, force: Force, inertia: float, damping: Array, friction: Array
) -> tuple[Array, Array]:
    """(n,) distance left after so many seconds from rest, and (n,) time of arrival (inf: not yet), for n trials. Each
    step is exact for a constant force: v decays with c / I towards (F - f) / c. The part stops at the end."""
    step = seconds / STEPS
    x = np.maximum(damping * step / inertia, 1e-6)
    keep = np.exp(-x)
    first = -np.expm1(-x) / x
    second = (1.0 - first) / x
    left, speed = np.full(x.shape, way), np.zeros(x.shape)
    arrived = np.full(x.shape, np.inf)
    goal = ARRIVED_SHARE * way
    for index in range(STEPS):
        push = force(left)
        # Friction acts against the motion, and holds what is at rest.
        net = np.where((speed > 0.0) | (push > friction), push - friction, np.minimum(push + friction, 0.0))
        before = left
        left = np.maximum(left - speed * step * first - net / inertia * step**2 * second, 0.0)
        after = speed * keep + net / inertia * step * first
        speed = np.where((speed > 0.0) & (after < 0.0), 0.0, after)
        now = np.isinf(arrived) & (left <= goal)
        share = (before - goal) / np.maximum(before - left, 1e-30)
        arrived = np.where(now, (index + share) * step, arrived)
    return left, arrived


def arrival_s(way: float, force: Force, inertia: float, damping: float, friction: float) -> float:
    """Time until a part released at rest, ``way`` from its end, has a tenth of it left, s; inf where it gets stuck."""
    seconds = 0.25
    while seconds <= LONGEST_S:
        _, arrived = distance_left(seconds, way, force, inertia, np.array([damping]), np.array([friction]))
        if np.isfinite(arrived[0]):
            return float(arrived[0])
        seconds *= 2.0
    return math.inf


def brake_to_arrive(
    seconds: float,
    way: float,
    force: Force,
    inertia: float,
    damping: tuple[float, float],
    friction: tuple[float, float],
) -> Brake:
    """Damping, and where its bound is too low friction, with which a part arrives after ``seconds``. ``damping`` and
    ``friction`` are the least and the largest allowed. If they forbid it, the nearest is taken."""
    goal = ARRIVED_SHARE * way

    def by_damping(trial: Array) -> Array:
        return distance_left(seconds, way, force, inertia, trial, np.full(len(trial), friction[0]))[0]

    def by_friction(trial: Array) -> Array:
        return distance_left(seconds, way, force, inertia, np.full(len(trial), damping[1]), trial)[0]

    found, met = solve_increasing(damping, by_damping, goal)
    if met:
        return Brake(found, friction[0], seconds)
    if found == damping[1] and friction[1] > friction[0]:
        found, met = solve_increasing(friction, by_friction, goal)
        achieved = seconds if met else arrival_s(way, force, inertia, damping[1], found)
        return Brake(damping[1], found, achieved)
    return Brake(found, friction[0], arrival_s(way, force, inertia, found, friction[0]))


def solve_increasing(bounds: tuple[float, float], left: Callable[[Array], Array], goal: float) -> tuple[float, bool]:
    """The bounded value at which ``left``, rising with it, is ``goal``, and whether there is one; else the nearest."""
    low, high = bounds
    if not high > low > 0.0:
        return high, False
    for _ in range(ROUNDS):
        trial = np.geomspace(low, high, GRID)
        above = np.flatnonzero(left(trial) > goal)
        if not len(above):
            return bounds[1], False
        if above[0] == 0:
            return bounds[0], False
        low, high = float(trial[above[0] - 1]), float(trial[above[0]])
    return math.sqrt(low * high), True


START_OPENING = 0.5
"""Share of the way from closed to open at which a lid is let go."""
LEAST_WAY = 0.25
"""Share of that way over which gravity must pull a lid shut for it to count as one that gravity shuts."""
WEAK_SHARE = 0.1
"""Share of gravity's largest pull on the way below which a lid is balanced rather than falling."""
STUCK_MARGIN = 0.8
"""Most friction on a falling lid, as a share of gravity's least pull on the way: it must fall in every engine."""
LONGEST_COAST_S = 10.0
"""Weakest damping that a wish may give, as a time constant, s: no damping at all never comes to rest."""
LARGEST_SOFTENING = 10.0
"""How many times softer than a critically damped one a timed spring may be, where gravity does part of its work."""
SAMPLES = 65
"""Positions on the way at which gravity is evaluated."""


def largest_damping(moved: JointLoad, settings: PhysicsSettings) -> float:
    """The damping that an explicit step bears, N·m·s/rad or N·s/m."""
    return settings.max_damping_step * moved.least / settings.coarse_timestep_s


def closing_brake(proposal: JointProposal, moved: JointLoad, settings: PhysicsSettings) -> Brake | None:
    """Damping, and friction where that is not enough, with which gravity shuts the joint from half open (or from as far
    as it does at all) in ``closes_s``. None where gravity does not shut it."""
    way = shut_by_gravity(moved)
    if way is None or proposal.closes_s is None:
        return None
    inward = math.copysign(1.0, moved.closed - moved.open)

    def force(left: Array) -> Array:
        pulled: Array = inward * moved.pull.at(moved.closed - inward * left)
        return pulled

    weakest = float(force(np.linspace(ARRIVED_SHARE * way, way, SAMPLES)).min())
    usual = settings.default_friction_m_s2 if moved.prismatic else settings.default_friction_rad_s2
    least = min(settings.free_friction_share * usual * moved.held, WEAK_SHARE * weakest)
    friction = (least, STUCK_MARGIN * weakest) if proposal.friction is None else (proposal.friction,) * 2
    largest = largest_damping(moved, settings)
    damping = (min(moved.held / LONGEST_COAST_S, largest), largest)
    return brake_to_arrive(proposal.closes_s, way, force, moved.held, damping, friction)


def shut_by_gravity(moved: JointLoad) -> float | None:
    """How far from closed, at most half open, gravity pulls the joint shut all the way (rad or m); None where not."""
    half = START_OPENING * abs(moved.open - moved.closed)
    if half <= 0.0:
        return None
    inward = math.copysign(1.0, moved.closed - moved.open)
    left = np.linspace(ARRIVED_SHARE * half, half, SAMPLES)
    pull = inward * moved.pull.at(moved.closed - inward * left)
    falls = pull > WEAK_SHARE * max(float(pull.max()), 0.0)
    reach = float(left[-1] if falls.all() else left[int(np.argmin(falls))])
    return reach if falls[0] and reach >= LEAST_WAY * half else None


def gliding_brake(proposal: JointProposal, moved: JointLoad, holds: bool, settings: PhysicsSettings) -> Brake:
    """Damping and friction that stop the joint from a hand's usual speed within ``stops_within``, on the level."""
    speed = settings.usual_speed_m_s if moved.prismatic else settings.usual_speed_rad_s
    least = moved.hold_friction
    stated = None if proposal.friction is None else max(proposal.friction, least)
    distance = proposal.stops_within or 0.0
    return stopping_dynamics(moved.held, speed, distance, largest_damping(moved, settings), stated, least)


def relaxed_position(moved: JointLoad, stiffness: Array | float, margin: float) -> Array:
    """Relaxed position (rad or m) of springs of this stiffness that carry ``margin`` times gravity's pull at rest."""
    reference: Array = moved.rest - margin * moved.rest_load / np.asarray(stiffness)
    return reference


def timed_return(
    proposal: JointProposal, moved: JointLoad, stiffness: float, margin: float, settings: PhysicsSettings
) -> tuple[float, Brake]:
    """The spring's stiffness (N·m/rad or N/m), and damping with which it brings the joint back from its far end in
    ``returns_s``, its preload and gravity counted; never less than what keeps it from ringing. Where the part returns
    too soon at any damping, because its weight helps, the spring is made softer."""
    outward, way = math.copysign(1.0, moved.far), abs(moved.far)

    def force(left: Array, spring: Array | float = stiffness) -> Array:
        position = moved.rest + outward * left
        sprung = spring * (relaxed_position(moved, spring, margin) - position)
        back: Array = -outward * (sprung + moved.pull.at(position))
        return back

    largest = largest_damping(moved, settings)
    least = min(2.0 * settings.spring_damping_ratio * math.sqrt(stiffness * moved.inertia), largest)
    friction, seconds = proposal.friction or 0.0, proposal.returns_s or 0.0
    found = brake_to_arrive(seconds, way, force, moved.held, (least, largest), (friction, friction))
    if found.damping < largest or found.achieved >= seconds or proposal.stiffness is not None:
        return stiffness, found

    def by_softness(softness: Array) -> Array:
        same = np.ones(len(softness))
        return distance_left(
            seconds, way, lambda left: force(left, stiffness / softness), moved.held, largest * same, friction * same
        )[0]

    softness, met = solve_increasing((1.0, LARGEST_SOFTENING), by_softness, ARRIVED_SHARE * way)
    softer = stiffness / softness
    achieved = seconds
    if not met:
        achieved = arrival_s(way, lambda left: force(left, softer), moved.held, largest, friction)
    return softer, Brake(largest, friction, achieved)
