"""Behaviour of a loaded object, as numbers: each probe opens it anew, acts on one joint or on the whole, and
watches."""

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from asset2sim.assets.exports.refined_object import ExportJoint, ExportObject
from asset2sim.physics.kinematics import apply
from asset2sim.physics.mass_matrix import GRAVITY_M_S2, Body, joint_space
from lab.loaders.loaded import LoadedObject, Loader, Setting, Vector

WEIGHTLESS: Vector = (0.0, 0.0, 0.0)
FINE_STEP_S = 1.0 / 2400.0
"""Time step of what is read off a single step: short against every time constant of our joints."""
PUSH_S = 0.1
"""How long a joint is pushed to see whether it moves."""
EXCESS = 0.05
"""A joint moves where at least this share of the push accelerates it; slower, it creeps."""
HALVINGS = 16
"""Bisections of a push over seven decades: to 0.1 % of a decade."""
GAIN = 1.0
"""Speed, rad/s or m/s, that a push above the hold gives a joint within one fine step."""
HOLD_S = 3.0
"""How long a held part is left alone."""
SETTLE_S, SLIDE_S = 1.0, 0.5
"""How long an object on a slope settles, and is then watched."""
SLIDING_M = 5e-3
"""Way down a slope, in ``SLIDE_S``, of an object that slides."""
FREE_FALL = 0.25
"""Share by which a fall may differ from a free one: engines' first steps, and a little drag."""
STEEPEST = 2.0
"""The steepest slope that is tried, as its tangent."""


def middle(joint: ExportJoint) -> float:
    """The middle of a joint's range, rad or m."""
    return 0.0 if joint.lower is None or joint.upper is None else 0.5 * (joint.lower + joint.upper)


def wait(loaded: LoadedObject, seconds: float, efforts: Mapping[str, float] | None = None) -> None:
    """Step for so long under these efforts, none by default."""
    for _ in range(round(seconds / loaded.timestep_s)):
        loaded.step(efforts or {})


def stated_inertia(item: ExportObject, joint: ExportJoint, *, own: bool = True) -> float:
    """Inertia that a torque on the joint accelerates while the root is held, by the URDF, kg·m² or kg; without
    ``own``, as if
    every link were a point mass."""
    kept = 1.0 if own else 0.0
    bodies = {body.name: Body(body.mass_kg, body.com, kept * body.inertia) for body in item.bodies.values()}
    space = joint_space([part.tree for part in item.joints], item.root, bodies, {joint.name: middle(joint)})
    return space.held_inertia()[joint.name]


def breakaway(
    loader: Loader, folder: Path, item: ExportObject, joint: ExportJoint, timestep_s: float, *, loose: bool = False
) -> float:
    """The least push, N·m or N, that moves a joint from the middle of its range without gravity; 0 where any does, and
    infinite where none does."""
    start, inertia = middle(joint), stated_inertia(item, joint)
    reach = math.inf if joint.upper is None else 0.9 * (joint.upper - start)
    with loader.open(folder, Setting(timestep_s, WEIGHTLESS, held=True, loose=loose)) as loaded:

        def moves(push: float) -> bool:
            loaded.place({joint.name: start}, {})
            wait(loaded, PUSH_S, {joint.name: push})
            way = abs(loaded.positions()[joint.name] - start)
            return way >= min(reach, 0.5 * EXCESS * push / inertia * PUSH_S**2)

        least = 1e-3 * max(joint.dynamics.friction, inertia)
        low, high = math.log10(least), math.log10(1e7 * least)
        if moves(10.0**low):
            return 0.0
        if not moves(10.0**high):
            return math.inf
        for _ in range(HALVINGS):
            half = 0.5 * (low + high)
            low, high = (low, half) if moves(10.0**half) else (half, high)
    return float(10.0**high)


def gained(
    loader: Loader, folder: Path, joint: ExportJoint, push: float, speed: float = 0.0, *, loose: bool = True
) -> float:
    """Speed, rad/s or m/s, that a joint in the middle of its range gains in one fine step without gravity under a push
    (N·m or N)."""
    with loader.open(folder, Setting(FINE_STEP_S, WEIGHTLESS, held=True, loose=loose)) as loaded:
        loaded.place({joint.name: middle(joint)}, {joint.name: speed})
        loaded.step({joint.name: push})
        return loaded.velocity(joint.name) - speed


def read_inertia(loader: Loader, folder: Path, item: ExportObject, joint: ExportJoint) -> float:
    """The inertia that a push on the joint meets, kg·m² or kg: from two pushes that both exceed what holds it."""
    hold = 1.5 * breakaway(loader, folder, item, joint, FINE_STEP_S, loose=True)
    push = stated_inertia(item, joint) * GAIN / FINE_STEP_S
    first, second = (gained(loader, folder, joint, hold + times * push) for times in (1.0, 2.0))
    return push * FINE_STEP_S / (second - first) if second > first else math.inf


def read_damping(loader: Loader, folder: Path, item: ExportObject, joint: ExportJoint) -> float:
    """The joint's damping, N·m·s/rad or N·s/m: what it loses more at three times the speed, above what holds it."""
    hold = 1.5 * breakaway(loader, folder, item, joint, FINE_STEP_S, loose=True)
    slow, fast = (gained(loader, folder, joint, hold, speed) for speed in (GAIN, 3.0 * GAIN))
    return (slow - fast) / FINE_STEP_S / (2.0 * GAIN) * read_inertia(loader, folder, item, joint)


def push_taken(loader: Loader, folder: Path, joint: ExportJoint, push: float) -> float:
    """The share of a push (N·m or N) that a joint which nothing in the file holds does not get."""
    return 1.0 - gained(loader, folder, joint, push, loose=False) / gained(loader, folder, joint, push)


def spring_share(loader: Loader, folder: Path, item: ExportObject, joint: ExportJoint) -> float:
    """The share of the stated spring's force that a joint feels when it is let go in the middle of its range."""
    terms = joint.dynamics
    stated = terms.stiffness * (terms.spring_reference - middle(joint))
    # What the loader gives it to move, an armature included.
    inertia = read_inertia(loader, folder, item, joint)
    return gained(loader, folder, joint, 0.0, loose=False) / FINE_STEP_S * inertia / stated


def effort_share(loader: Loader, folder: Path, item: ExportObject, joint: ExportJoint) -> float:
    """How much of a push beyond the effort limit gets through: 0 where it is cut off, 1 where nothing limits it."""
    limit = joint.effort or 0.0
    hold = 1.5 * breakaway(loader, folder, item, joint, FINE_STEP_S, loose=True)
    base, twice = (gained(loader, folder, joint, hold + times * limit) for times in (1.0, 2.0))
    return (twice - base) / FINE_STEP_S * read_inertia(loader, folder, item, joint) / limit


def creep(loader: Loader, folder: Path, joint: ExportJoint, state: Mapping[str, float]) -> float:
    """How far, rad or m, a held part moves from its state in ``HOLD_S``, the root held."""
    with loader.open(folder, Setting(held=True)) as loaded:
        loaded.place(state, {})
        wait(loaded, HOLD_S)
        return abs(loaded.positions()[joint.name] - state[joint.name])


def loaded_state(loader: Loader, folder: Path) -> dict[str, float]:
    """Joint → position after loading, rad or m."""
    with loader.open(folder, Setting()) as loaded:
        return loaded.positions()


def root_falls(loader: Loader, folder: Path) -> bool:
    """Whether gravity moves the root, as loaded, with nothing below it."""
    with loader.open(folder, Setting()) as loaded:
        before = loaded.root_position()[2]
        wait(loaded, PUSH_S)
        return bool(before - loaded.root_position()[2] > 1e-3)


def slope_that_holds(loader: Loader, folder: Path, item: ExportObject) -> float:
    """The tangent of the steepest slope that the free object, in its state, stands on: the friction of its contacts
    with a floor as the engine makes one."""
    low, high = 0.0, STEEPEST
    for _ in range(7):
        half = 0.5 * (low + high)
        low, high = (low, half) if slides(loader, folder, item, half) else (half, high)
    return 0.5 * (low + high)


def slides(loader: Loader, folder: Path, item: ExportObject, tangent: float) -> bool:
    """Whether the object slides on a slope; gravity is tilted, along x, in place of the floor."""
    steep = math.atan(tangent)
    gravity = (GRAVITY_M_S2 * math.sin(steep), 0.0, -GRAVITY_M_S2 * math.cos(steep))
    setting = Setting(gravity=gravity, held=False, floor=True, height_m=item.height_to_stand(item.initial))
    with loader.open(folder, setting) as loaded:
        loaded.place(item.initial, {})
        places = []
        for seconds in (SETTLE_S, SLIDE_S):
            wait(loaded, seconds)
            places.append(loaded.root_position())
    return bool(np.linalg.norm(places[1] - places[0]) > SLIDING_M)


def ball_falls_inside(loader: Loader, folder: Path, item: ExportObject) -> bool:
    """Whether a ball let go in the middle of a hollow object, root held, falls as if nothing were there."""
    poses = item.poses(item.initial)
    body = max(item.bodies.values(), key=lambda one: sum(len(shape.points) for shape in one.shapes))
    points = np.vstack([apply(poses[body.name], shape.points) for shape in body.shapes])
    x, y, z = (float(value) for value in 0.5 * (points.min(axis=0) + points.max(axis=0)))
    with loader.open(folder, Setting(held=True, ball=(x, y, z))) as loaded:
        loaded.place(item.initial, {})
        wait(loaded, PUSH_S)
        fallen = z - loaded.ball_position()[2]
    return bool(abs(fallen / (0.5 * GRAVITY_M_S2 * PUSH_S**2) - 1.0) < FREE_FALL)
