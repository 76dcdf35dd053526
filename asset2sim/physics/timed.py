"""Joint terms for the three wishes: ``closes_s`` (a lid), ``stops_within`` (a drawer), ``returns_s`` (a key)."""

import math

import numpy as np

from asset2sim.physics.arrays import Array
from asset2sim.physics.terms import JointLoad
from asset2sim.physics.timing import (
    ARRIVED_SHARE,
    Brake,
    arrival_s,
    brake_to_arrive,
    distance_left,
    solve_increasing,
    stopping_dynamics,
)
from schemas.overlay import JointProposal
from schemas.settings import PhysicsSettings

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
