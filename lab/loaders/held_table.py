"""The table of what holds: the refined samples in every engine, by the engine's own URDF loader and through
``asset2sim.load``. ``make held`` writes it.

An engine that is not installed beside us is looked for in ``.venv-load``, which ``make held`` sets up: Newton's extra
pins another MuJoCo than ours, and Genesis brings torch.
"""

import json
import math
import subprocess
import sys
import textwrap
from collections.abc import Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import asset2sim.load
from asset2sim.assets.folder import LOADER_NAME
from asset2sim.catalog.index import loader_source
from asset2sim.catalog.text import markdown_table
from asset2sim.engines.registry import engine_version, installed
from lab.loaders import hold
from lab.loaders.loaded import Setting
from lab.loaders.loader_table import MODULES
from schemas.errors import UsageError
from schemas.vocabulary import Engine

BLOCK = "held"
ENGINES = (*(engine.value for engine in MODULES), *hold.PLAIN)
PACKAGES = {engine: engine for engine in hold.PLAIN} | {"genesis": "genesis-world"}
"""Engine that is not ours → the package whose version is told."""
OTHER_PYTHON = Path(".venv-load/bin/python")
TIME_LIMIT_S = 3600.0
"""For all objects in one engine that is not ours: Genesis compiles its kernels for each."""
WAYS = {"as_loaded": "its URDF, as loaded", "put": "its URDF, put into the state by hand", "load": "`asset2sim.load`"}


@dataclass(frozen=True)
class Held:
    """One engine's answers, an object each, as ``hold`` prints them; None where it is not installed anywhere here."""

    engine: str
    version: str
    objects: tuple[dict[str, Any], ...] | None

    def holding(self, way: str) -> int:
        """How many objects hold their asked state."""
        return sum(one[way] is not None and one[way] <= 1.0 for one in self.objects or ())

    def cell(self, way: str) -> str:
        """How many hold, and the worst of all as a share of its bound."""
        if self.objects is None:
            return "not installed here"
        failed = sum(one[way] is None for one in self.objects)
        worst = max((one[way] for one in self.objects if one[way] is not None), default=math.nan)
        refused = f", {failed} refused" if failed else ""
        return f"{self.holding(way)} of {len(self.objects)}; worst {worst:.2g}{refused}"


def python_of(engine: str) -> tuple[str, str] | None:
    """A Python that has an engine, and the engine's version; None where there is none."""
    code = f"import importlib.metadata as m; print(m.version({PACKAGES[engine]!r}))"
    for python in (sys.executable, str(OTHER_PYTHON.absolute())):
        if Path(python).is_file():
            asked = subprocess.run([python, "-c", code], capture_output=True, text=True, check=False, timeout=300)
            if asked.returncode == 0:
                return python, asked.stdout.strip()
    return None


def measured_here(engine: Engine, folder: Path) -> dict[str, Any]:
    """The answers of an engine of ours for one refined object, as ``hold`` gives them."""
    about, loader = asset2sim.load.describe(folder), import_module(MODULES[engine]).LOADERS[0]
    # MuJoCo holds a URDF's root where it is, which is in a floor.
    place = Setting() if engine is Engine.MUJOCO else Setting(floor=True, height_m=about.height_m)
    with ExitStack() as opened:

        def plainly(*, put: bool) -> hold.Moving:
            item = opened.enter_context(loader.open(folder, place))
            if put:
                item.place(about.positions_at(), {})
            return item.positions, lambda: item.step({}), item.timestep_s

        return hold.answers(
            about,
            as_loaded=partial(plainly, put=False),
            put=partial(plainly, put=True),
            load=lambda: hold.through(asset2sim.load, engine.value, folder),
        )


def measure(engine: str, folders: Sequence[Path]) -> Held:
    """One engine's answers for these refined objects. Raises UsageError where it dies before it answered for all."""
    if engine not in hold.PLAIN:
        there = Engine(engine) in installed()
        said = tuple(measured_here(Engine(engine), folder) for folder in folders) if there else None
        return Held(engine, engine_version(Engine(engine)) if there else "", said)
    found = python_of(engine)
    if found is None:
        return Held(engine, "", None)
    python, version = found
    with TemporaryDirectory() as place:  # both by their files: nothing of ours is imported there
        loader = Path(place, LOADER_NAME)
        loader.write_text(loader_source(), encoding="utf-8")
        words = [python, str(hold.__file__), str(loader), engine, *map(str, folders)]
        ended = subprocess.run(words, capture_output=True, text=True, check=False, timeout=TIME_LIMIT_S)
    told = [json.loads(line[5:]) for line in ended.stdout.splitlines() if line.startswith("HELD ")]
    if len(told) != len(folders):
        raise UsageError(f"{engine} ended after {len(told)} of {len(folders)} objects: {ended.stderr[-400:]}")
    return Held(engine, version, tuple(told))


def sample_folders(out: Path) -> list[Path]:
    """The refined objects in OUT that have a joint which holds, by the index. Raises UsageError where there is none."""
    index = out / "assets" / "index.json"
    if not index.is_file():
        raise UsageError(f"no {index}; run make flow")
    entries = json.loads(index.read_text(encoding="utf-8"))["assets"]
    folders = [out / "assets" / entry["path"] for entry in entries if entry["status"] == "ok" and entry["path"]]
    held = [folder for folder in folders if any(joint.holds for joint in asset2sim.load.describe(folder).joints)]
    if not held:
        raise UsageError(f"{out} has no refined object with a joint that holds")
    return held


def held_block(out: Path) -> str:
    """The table with what it is of."""
    folders = [folder.resolve() for folder in sample_folders(out)]
    answers = [measure(engine, folders) for engine in ENGINES]
    rows = [[f"{one.engine} {one.version}".strip(), *(one.cell(way) for way in WAYS)] for one in answers]
    table = markdown_table(("engine", *WAYS.values()), rows)
    about = (
        f"Of the {len(folders)} refined samples with a joint that must hold: how many have every such joint within "
        f"{hold.TURN_RAD:g} rad or {1e3 * hold.SLIDE_M:g} mm of its asked position throughout {hold.HOLD_S:g} s, and "
        "the worst deviation as a share of that. PyBullet's plain loader holds by its hidden motors, and then no push "
        "moves the joint."
    )
    return f"{table}\n\n{textwrap.fill(about, 130, break_long_words=False, break_on_hyphens=False)}"
