"""A check and an engine from one file each outside the package: a refinement measures, judges, mends and shows them."""

import os
import subprocess
import sys
from pathlib import Path

import pyarrow.parquet as pq
import pytest

from asset2sim.checks.declared_check import known_checks, require_bounds
from schemas.declared import VARIABLE
from schemas.errors import UsageError
from schemas.settings import Thresholds
from schemas.thresholds import Bound
from tests.prefect_server import using

ROOT = Path(__file__).resolve().parents[1]
CHECK = '''
"""A toy check: how high the centre of the object's root stands above the plane."""

from schemas.verdict import CheckVerdict
from asset2sim.checks.declared_check import DeclaredCheck
from asset2sim.checks.declared_check import Remedy
from schemas.base import Frozen
from schemas.verdict import Guide
from schemas.thresholds import Bound
from schemas.vocabulary import FailureMode

LOW = FailureMode.add("too_low")
LEAST = Bound("least_height_m", 7.5, "m", "no box is as high as a house, so that it fails")


class Height(Frozen):
    height_m: float


def measure(rig):
    rig.down()
    world = rig.resting_world.sound()
    world.place(rig.item.start)
    return {"heights": (Height(height_m=float(world.root_center()[2])),)}


def judge(seen, joints, limits):
    return [
        CheckVerdict(LOW, "root", item.height_m >= limits.of(LEAST), item.height_m, limits.of(LEAST), "toy: it is low")
        for item in seen.records("heights", Height)
    ]


def rougher(case, overlay):
    return overlay.model_copy(update={"contact_friction": 0.987})


CHECK = DeclaredCheck(
    name="height",
    modes={LOW: Guide("The toy check finds it low", "build a tower")},
    done="looked at",
    holds="it is high",
    bounds=(LEAST,),
    measure=measure,
    judge=judge,
    on_plane=True,
    turn=45,
    remedies=(Remedy("toy remedy", rougher),),
)
'''
ENGINE = '''
"""A toy engine: PyBullet under another name."""

from contextlib import contextmanager

from asset2sim.engines import pybullet_world
from asset2sim.engines.world import DeclaredEngine
from schemas.vocabulary import Engine

TOY = Engine.add("toybox")


class ToyWorld(pybullet_world.PyBulletWorld):
    engine = TOY


@contextmanager
def open_toy(urdf, **options):
    with pybullet_world.open_pybullet(urdf, **options) as world:
        world.engine = TOY
        yield world


ENGINE = DeclaredEngine(TOY, open_toy, started=(ToyWorld, "__init__"), package="pybullet", version="0.1")
'''


@pytest.mark.system
def test_a_toy_check_and_a_toy_engine_are_in_tables_report_and_verdict(tmp_path: Path, prefect_server: str) -> None:
    files = {"toy_check.py": CHECK, "toy_engine.py": ENGINE}
    for name, text in files.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    declared = os.pathsep.join(str(tmp_path / name) for name in files)
    out = tmp_path / "out"
    command = [sys.executable, "-m", "flows.command", "refine", "data/raw", "--out", str(out), "--assets", "box_wooden"]
    command += ["--engines", "mujoco,toybox", "--workers", "1", "--no-views"]
    environment = using(prefect_server, tmp_path / "prefect") | {VARIABLE: declared}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=400)
    assert (out / "catalog" / "assets.parquet").is_file(), done.stdout + done.stderr

    (asset,) = pq.read_table(out / "catalog" / "assets.parquet").to_pylist()
    assert (asset["status"], asset["failure_mode"], asset["reason"]) == ("failed", "too_low", "toy: it is low")
    measured = pq.read_table(out / "catalog" / "measurements.parquet").to_pylist()
    assert {row["engine"]: row["engine_version"] == "0.1" for row in measured} == {"mujoco": False, "toybox": True}
    rows = pq.read_table(out / "catalog" / "interactions.parquet").to_pylist()
    own = [row for row in rows if row["test"] == "too_low"]
    assert {row["engine"] for row in own} == {"mujoco", "toybox"}
    assert all(not row["passed"] and row["limit_value"] == 7.5 and 0.0 < row["value"] < 1.0 for row in own)
    assert all(row["passed"] for row in rows if row["engine"] == "toybox" and row["test"] == "drop")
    trace = pq.read_table(out / "catalog" / "trace.parquet").to_pylist()
    assert any(row["reason"].startswith("toy remedy") and not row["accepted"] for row in trace)
    page = "".join(file.read_text(encoding="utf-8") for file in (out / "report").rglob("*.html"))
    assert "build a tower" in page and "toy: it is low" in page and "toybox" in page


def test_a_bound_that_no_check_declares_is_refused() -> None:
    require_bounds(Thresholds())
    with pytest.raises(UsageError, match="least_hight_m"):
        require_bounds(Thresholds(further={"least_hight_m": 0.1}))
    bound = Bound("least_height_m", 7.5, "m", "as high as a house")
    assert Thresholds().of(bound) == 7.5 and Thresholds(further={"least_height_m": 0.1}).of(bound) == 0.1


def test_every_bound_of_the_settings_is_of_a_check_that_states_it() -> None:
    stated = {bound for check in known_checks() for bound in check.bounds if isinstance(bound, str)}
    elsewhere = {"further"}
    assert stated | elsewhere == set(Thresholds.model_fields)
    modes = [mode for check in known_checks() for mode in check.modes]
    assert len(set(modes)) == len(modes)
    assert len({check.place for check in known_checks()}) == len(known_checks())
