"""Joint terms from what a person can name: how far it glides, how long it takes to fall shut or spring back.

Everything is the motion of one coordinate, the root held: I q̈ = F(q) - c q̇ - f, with damping c and dry friction f.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from asset2sim.physics.arrays import Array

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
