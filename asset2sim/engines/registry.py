"""Which engines are installed, and one way to open a world in any of them."""

from collections.abc import Iterable
from contextlib import AbstractContextManager, suppress
from functools import cache
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from importlib.util import find_spec
from pathlib import Path
from pkgutil import iter_modules

from asset2sim.engines.world import DeclaredEngine, World
from asset2sim.physics.mass_matrix import GRAVITY_M_S2
from schemas.declared import ENGINE, declared
from schemas.errors import UsageError
from schemas.vocabulary import Engine

PACKAGE, ENDING = "asset2sim.engines", "_world"
"""An engine's module in here is named for it, and it for the package that it needs: ``mujoco_world``."""
HOW_TO_INSTALL = "pip install 'asset2sim[bullet,engines]'"

OWN = tuple(
    Engine.add(item.name.removesuffix(ENDING))
    for item in iter_modules(import_module(PACKAGE).__path__)
    if item.name.endswith(ENDING)
)
"""The engines that have a module in here."""


@cache
def outside_engines() -> dict[Engine, DeclaredEngine]:
    """The engines that modules from outside the package declare."""
    found = declared(ENGINE)
    return {item.engine: item for item in found if isinstance(item, DeclaredEngine)}


def known_engines() -> tuple[Engine, ...]:
    """All engines, in the vocabulary's order, installed or not; nothing of theirs is imported."""
    return tuple(engine for engine in Engine if engine in OWN or engine in outside_engines())


def declared_engine(engine: Engine) -> DeclaredEngine:
    """The declaration of an engine; its package is imported. Raises ImportError where that is not installed."""
    if engine in outside_engines():
        return outside_engines()[engine]
    found: DeclaredEngine = import_module(f"{PACKAGE}.{engine}{ENDING}").ENGINE
    return found


def package_of(engine: Engine) -> str:
    """The package that an engine needs."""
    return (outside_engines()[engine].package if engine in outside_engines() else "") or engine.value


def modules_of(engine: Engine) -> tuple[str, ...]:
    """The modules that a child process should find loaded to open a world in an engine."""
    return (package_of(engine), *((f"{PACKAGE}.{engine}{ENDING}",) if engine in OWN else ()))


def installed() -> tuple[Engine, ...]:
    """The engines whose packages are installed here, in the vocabulary's order; nothing is imported."""
    return tuple(engine for engine in known_engines() if find_spec(package_of(engine)) is not None)


def engine_version(engine: Engine) -> str:
    """The version of an installed engine."""
    return (
        (outside_engines()[engine].version if engine in outside_engines() else "")
        or version_of(package_of(engine))
        or ""
    )


@cache
def version_of(package: str) -> str | None:
    """The version of an installed package, None where it is not; looked up once a process, in 3 to 20 ms."""
    with suppress(PackageNotFoundError):
        return version(package)
    return None


def versions_of(packages: Iterable[str]) -> dict[str, str]:
    """Package → version, of those that are installed."""
    return {name: found for name in packages if (found := version_of(name)) is not None}


def require(engine: Engine) -> None:
    """Raise UsageError where the engine is not installed, with what to install."""
    if find_spec(package_of(engine)) is None:
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
    return declared_engine(engine).open(
        urdf, plane=plane, timestep_s=timestep_s, contact_friction=contact_friction, gravity_m_s2=gravity_m_s2
    )
