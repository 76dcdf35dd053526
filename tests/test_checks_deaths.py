"""An engine that dies of a part of an object: the part is named, a collision shape becomes its box, others decide."""

from collections.abc import Iterator
from pathlib import Path

import mujoco
import pytest
import trimesh

from asset2sim.assets.meshes.load import mesh_points
from asset2sim.assets.urdf.read import read_urdf
from asset2sim.assets.urdf.references import find_mesh
from asset2sim.checks.known_reports import comparable
from asset2sim.engines import registry
from asset2sim.load import load
from schemas.asset import AssetRef
from schemas.declared import VARIABLE
from schemas.settings import EngineSettings
from schemas.vocabulary import Engine, Export, FailureMode, Method, Status
from tasks.pipeline import refine_asset
from tests.assets import NO_VIEWS, joint, link, mesh, prior, robot, written

pytest.importorskip("pxr", reason="usd-core is not installed")
from pxr import Usd, UsdGeom, UsdPhysics

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


def collides_as_its_box(folder: Path) -> None:
    """Assert that no collision mesh of what was written, is loaded or exported has the corners that are fatal."""
    shapes = [shape for link in read_urdf(folder / "mobility.urdf").links for shape in link.collisions]
    files = [find_mesh(shape.geometry.mesh.filename, folder) for shape in shapes if shape.geometry.mesh is not None]
    assert files and all(file is not None and len(mesh_points(file)) == 8 for file in files)
    item = load(folder, "mujoco")
    item.step()
    model = item.model
    for compiled in (model, mujoco.MjModel.from_xml_path(str(next(folder.rglob("*.xml"))))):
        solid = {int(compiled.geom_dataid[geom]) for geom in range(compiled.ngeom) if compiled.geom_contype[geom]}
        assert solid - {-1} and all(compiled.mesh_vertnum[mesh] == 8 for mesh in solid - {-1})
    stage = Usd.Stage.Open(str(next(folder.rglob("*.usd*"))))
    meshes = [UsdGeom.Mesh(prim) for prim in Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies())
              if prim.IsA(UsdGeom.Mesh) and prim.HasAPI(UsdPhysics.CollisionAPI)]  # fmt: skip
    assert meshes and all(len(mesh.GetPointsAttr().Get()) == 8 for mesh in meshes)


def test_a_shape_of_which_an_engine_dies_is_named_and_boxed(tmp_path: Path, frail: Engine) -> None:
    ref = box_with_a_knob(tmp_path / "knobbed")
    engine = EngineSettings(verify=(Engine.MUJOCO, frail))
    settings = NO_VIEWS.model_copy(update={"engine": engine, "exports": (Export.MJCF, Export.USD)})
    record = refine_asset(ref, tmp_path / "ours", settings, prior)
    (boxed,) = [item for item in record.findings if item.code == "fatal_shape_boxed"]
    assert boxed.link == "knob" and record.status is Status.OK, record.reason
    collides_as_its_box(tmp_path / "ours" / "assets" / "knobbed")

    raw = NO_VIEWS.model_copy(update={"engine": engine, "method": Method.RAW})
    record = refine_asset(ref, tmp_path / "raw", raw, prior)
    (named,) = [item for item in record.findings if item.code == "engine_dies_of"]
    assert named.link == "knob" and "ball.obj" in named.message
    assert [report.died for report in record.reports] == [False, True], "the other engine's verdict stays"

    alone = raw.model_copy(update={"engine": EngineSettings(verify=(Engine.MUJOCO, frail), decide=(Engine.MUJOCO,))})
    record = refine_asset(ref, tmp_path / "alone", alone, prior)
    assert record.failure_mode is not FailureMode.ENGINE_CRASH and len(record.reports) == 2
