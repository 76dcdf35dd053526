"""An engine that dies of a part of an object: the part is named, others decide."""

from collections.abc import Iterator
from pathlib import Path

import pytest
import trimesh

from asset2sim.checks.known_reports import comparable
from asset2sim.engines import registry
from schemas.asset import AssetRef
from schemas.declared import VARIABLE
from schemas.settings import EngineSettings
from schemas.vocabulary import Engine, FailureMode, Method
from tasks.pipeline import refine_asset
from tests.assets import NO_VIEWS, joint, link, mesh, prior, robot, written

pytestmark = pytest.mark.system

FRAIL = '''
"""MuJoCo under another name, which dies of every collision mesh of more than 20 corners."""

import ctypes
from contextlib import contextmanager

from asset2sim.assets.meshes.load import mesh_points
from asset2sim.assets.urdf.read import read_urdf
from asset2sim.assets.urdf.references import find_mesh
from asset2sim.engines import mujoco_world
from asset2sim.engines.world import DeclaredEngine
from schemas.vocabulary import Engine

FRAIL = Engine.add("frail")


class FrailWorld(mujoco_world.MuJoCoWorld):
    engine = FRAIL


@contextmanager
def open_frail(urdf, **options):
    for link in read_urdf(urdf).links:
        for shape in link.collisions:
            if shape.geometry.mesh is not None:
                file = find_mesh(shape.geometry.mesh.filename, urdf.parent)
                if len(mesh_points(file)) > 20:
                    ctypes.string_at(0)
    with mujoco_world.open_mujoco(urdf, **options) as world:
        world.engine = FRAIL
        yield world


ENGINE = DeclaredEngine(FRAIL, open_frail, started=(FrailWorld, "__init__"), package="mujoco", version="0.1")
'''


@pytest.fixture
def frail(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Engine]:
    (tmp_path / "frail.py").write_text(FRAIL, encoding="utf-8")
    monkeypatch.setenv(VARIABLE, str(tmp_path / "frail.py"))
    for members in ("_member_names_", "_member_map_", "_value2member_map_"):  # other tests go over all engines
        monkeypatch.setattr(Engine, members, getattr(Engine, members).copy())
    registry.outside_engines.cache_clear()
    assert registry.outside_engines()
    yield Engine("frail")
    registry.outside_engines.cache_clear()
    comparable.cache_clear()


def box_with_a_knob(folder: Path) -> AssetRef:
    """A box with a round knob on a slide: the knob alone has many corners."""
    box, ball = trimesh.creation.box((0.3, 0.3, 0.2)), trimesh.creation.icosphere(subdivisions=2, radius=0.02)
    files = {name: item.export(file_type="obj") for name, item in {"box.obj": box, "ball.obj": ball}.items()}
    urdf = robot(
        link("body", mesh("box.obj")),
        link("knob", mesh("ball.obj")),
        joint("slide", "prismatic", "body", "knob", xyz="-0.2 0 0", axis="-1 0 0", limit="0 0.02"),
    )
    return AssetRef(asset_id="knobbed", path=str(written(folder, urdf, files)))


def test_a_shape_of_which_an_engine_dies_is_named(tmp_path: Path, frail: Engine) -> None:
    ref = box_with_a_knob(tmp_path / "knobbed")
    engine = EngineSettings(verify=(Engine.MUJOCO, frail))
    raw = NO_VIEWS.model_copy(update={"engine": engine, "method": Method.RAW})
    record = refine_asset(ref, tmp_path / "raw", raw, prior)
    (named,) = [item for item in record.findings if item.code == "engine_dies_of"]
    assert named.link == "knob" and "ball.obj" in named.message
    assert [report.died for report in record.reports] == [False, True], "the other engine's verdict stays"

    alone = raw.model_copy(update={"engine": EngineSettings(verify=(Engine.MUJOCO, frail), decide=(Engine.MUJOCO,))})
    record = refine_asset(ref, tmp_path / "alone", alone, prior)
    assert record.failure_mode is not FailureMode.ENGINE_CRASH and len(record.reports) == 2
