"""Which engines are installed, and one way to open a world in any of them."""

from contextlib import AbstractContextManager
from functools import cache
from importlib import import_module
from importlib.metadata import version
from importlib.util import find_spec
from pathlib import Path
from typing import cast

from asset2sim.engines.world import Opener, World
from asset2sim.physics.mass_matrix import GRAVITY_M_S2
from schemas.errors import UsageError
from schemas.vocabulary import Engine

OPENERS = {
    Engine.PYBULLET: ("asset2sim.engines.pybullet_world", "open_pybullet"),
    Engine.MUJOCO: ("asset2sim.engines.mujoco_world", "open_mujoco"),
    Engine.SAPIEN: ("asset2sim.engines.sapien_world", "open_sapien"),
}
"""Engine → the module and the function that open a world in it; the engine's package bears the engine's name."""

HOW_TO_INSTALL = "pip install -c constraints.txt -e '.[engines]'"


def installed() -> tuple[Engine, ...]:
    """The engines whose packages are installed here, in the vocabulary's order; nothing is imported."""
    return tuple(engine for engine in Engine if find_spec(engine.value) is not None)


@cache
def engine_version(engine: Engine) -> str:
    """The version of an installed engine's package; looked up once a process, since it takes up to 20 ms."""
    return version(engine.value)


def require(engine: Engine) -> None:
    """Raise UsageError where the engine is not installed, with what to install."""
    if find_spec(engine.value) is None:
        there = ", ".join(installed()) or "none"
        raise UsageError(
            f"the engine '{engine}' is not installed (installed: {there}); "
            f"{HOW_TO_INSTALL}, or choose among those that are"
        )


def open_world(
    engine: Engine,
    urdf: Path,
    *,
    plane: bool,
    timestep_s: float,
    contact_friction: float,
    gravity_m_s2: float = GRAVITY_M_S2,
) -> AbstractContextManager[World]:
    """The object in a world of the named engine, until the context ends (see ``Opener``).

    The engine is imported only here. Raises UsageError where it is not installed, and AssetError (engine_crash) on
    entering where it refuses the URDF.
    """
    require(engine)
    module, name = OPENERS[engine]
    opener = cast(Opener, getattr(import_module(module), name))
    return opener(
        urdf, plane=plane, timestep_s=timestep_s, contact_friction=contact_friction, gravity_m_s2=gravity_m_s2
    )
