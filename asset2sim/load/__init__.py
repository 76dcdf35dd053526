"""Load a refined object into an engine with everything set that a URDF cannot say; alike in six engines.

A run writes this package as one file beside its objects, ``OUT/assets/load.py``. It imports the standard library,
numpy, and the engine that is asked for::

    from load import describe, load

    print(describe("OUT/assets/7236"))                   # joints, ranges, what holds, where to pull, support, verdict
    item = load("OUT/assets/7236", engine="mujoco", state={"joint_0": 0.3})  # 30 % of the way from closed to open
    item.apply_effort({"joint_0": 4.0})                  # N or N·m, in every step until it is given anew
    item.step()                                          # item.positions(), velocities(), link_poses(), contacts()
    item.set_targets({"joint_0": 0.2})                   # a servo, rad or m
    item.reset("closed")                                 # or "open", or "random" with seed=7

Set are: initial state, no motors, joint damping, dry friction, springs and references, armature, friction and rolling
friction of contacts (as far as the engine has it), the base (held where the object is fixed to something), and, in a
world that ``load`` makes, a floor at z = 0, gravity, and the time step and solver under which the object stays as it is
asked to be. ``into`` puts it into a world of yours, whose floor, gravity, time step and solver stay: call ``drive()``
before each step that you make there. Lengths are in m, angles in rad, quaternions wxyz.

| engine | the handles of what you get | ``into`` takes | and then |
|---|---|---|---|
| pybullet | ``client``, ``body``, ``joints`` (name → index) | a client's id | |
| mujoco | ``spec``, ``model``, ``data`` | an ``MjSpec`` | ``finish(model, data)`` once you compiled it |
| sapien | ``scene``, ``articulation`` | a ``Scene`` | |
| drake | ``plant``, ``instance``, ``diagram``, ``simulator`` | (builder, plant) | ``finish()`` after ``Finalize()`` |
| genesis | ``scene``, ``entity`` | a ``Scene`` | ``finish()`` after ``scene.build()`` |
| newton | ``builder``, ``model``, ``solver``, ``states`` | a ``ModelBuilder`` | ``finish(model, solver, …)`` |
"""

import math
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal, TypedDict, Unpack, overload

from asset2sim.load.description import Description, Joint, State, describe
from asset2sim.load.in_drake import DrakeObject
from asset2sim.load.in_genesis import GenesisObject
from asset2sim.load.in_mujoco import MuJoCoObject
from asset2sim.load.in_newton import NewtonObject
from asset2sim.load.in_pybullet import PyBulletObject
from asset2sim.load.in_sapien import SapienObject
from asset2sim.load.loaded import Contact, Loaded, Root
from asset2sim.load.shapes import LoadError, finite_numbers, mesh_points

__all__ = [
    "ENGINES", "GAP_M", "Contact", "Description", "Joint", "LoadError", "Loaded", "describe", "load", "mesh_points",
]  # fmt: skip
KINDS: tuple[type[Any], ...] = (PyBulletObject, MuJoCoObject, SapienObject, DrakeObject, GenesisObject, NewtonObject)
ENGINES: dict[str, type[Any]] = {kind.engine: kind for kind in KINDS}
GAP_M = 0.01  # under what is fixed, as in the exports: a door that reaches down to the floor itself would scrape on it


class LoadOptions(TypedDict, total=False):
    """Options of ``load`` beside folder and engine."""

    into: Any
    name: str | None
    position: Sequence[float]
    yaw: float
    fixed: bool | None
    state: State
    seed: int
    timestep_s: float
    strict: bool


@overload
def load(folder: str | Path, engine: Literal["pybullet"] = ..., **options: Unpack[LoadOptions]) -> PyBulletObject: ...
@overload
def load(folder: str | Path, engine: Literal["mujoco"], **options: Unpack[LoadOptions]) -> MuJoCoObject: ...
@overload
def load(folder: str | Path, engine: Literal["sapien"], **options: Unpack[LoadOptions]) -> SapienObject: ...
@overload
def load(folder: str | Path, engine: Literal["drake"], **options: Unpack[LoadOptions]) -> DrakeObject: ...
@overload
def load(folder: str | Path, engine: Literal["genesis"], **options: Unpack[LoadOptions]) -> GenesisObject: ...
@overload
def load(folder: str | Path, engine: Literal["newton"], **options: Unpack[LoadOptions]) -> NewtonObject: ...
@overload
def load(folder: str | Path, engine: str, **options: Unpack[LoadOptions]) -> Loaded: ...
def load(
    folder: str | Path, engine: str = "pybullet", *, into: Any = None, name: str | None = None,
    position: Sequence[float] = (0.0, 0.0), yaw: float = 0.0, fixed: bool | None = None, state: State = None,
    seed: int = 0, timestep_s: float = 1.0 / 240.0, strict: bool = False,
) -> Loaded:  # fmt: skip
    """A refined object in an engine, in its initial state, with the engine's own handles (see the module).

    ``position`` is (x, y), the object standing on z = 0, a fixed one 1 cm over it, or (x, y, z) of its root's origin;
    ``yaw`` turns it about the vertical, rad. ``fixed`` holds the root or frees it; None does as the object's support
    says. ``state`` is another than the initial one, in which no links are in each other: "closed", "open", "random",
    the same for a ``seed`` in every engine, or for joints by name a share of the way from closed to open. ``name``
    tells objects in a world of yours apart; without one it is the asset's, numbered where that
    is taken. An object that failed warns with its reason, or with ``strict`` raises. Raises LoadError for a folder,
    engine, name, state or number that is none, ImportError where the engine is not installed. Checked at the default
    time step."""
    kind = ENGINES.get(str(engine).strip().lower())
    if kind is None:
        raise LoadError(f"no engine '{engine}'; choose one of {', '.join(ENGINES)}")
    x, y, *given_z = finite_numbers("position", position, (2, 3))
    (turned,), (step_s,) = finite_numbers("yaw", yaw, (1,)), finite_numbers("timestep_s", timestep_s, (1,))
    if step_s <= 0.0:
        raise LoadError(f"timestep_s: {timestep_s} is no time step; it is over 0, in s")
    if name is not None and not (isinstance(name, str) and name.strip()):
        raise LoadError(f"name: {name!r} is no name")
    if fixed not in (None, True, False):
        raise LoadError(f"fixed: {fixed!r} is not True, False or None")
    world, attribute = kind.takes
    if into is not None and not hasattr(into, attribute):
        raise LoadError(f"into: {into!r} is not {world}, which {kind.engine} takes")
    about = describe(folder)
    if about.verdict not in ("ok", "unknown"):
        said = f"{about.asset_id} failed its checks: {about.verdict}: {about.reason}"
        if strict:
            raise LoadError(said)
        warnings.warn(said, stacklevel=2)
    if state is not None:
        about = about.in_state(state, seed)
    held = about.support == "fixed" if fixed is None else fixed
    gap = GAP_M if held and about.support == "fixed" else 0.0
    wxyz = (math.cos(turned / 2.0), 0.0, 0.0, math.sin(turned / 2.0))
    item: Loaded = kind(about, Root(held, (x, y, (*given_z, about.height_m + gap)[0]), wxyz, name), into, step_s)
    return item
