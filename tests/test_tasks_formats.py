"""The cabinet of every format, refined, exported, and loaded in every engine: the same object in all of them."""

import json
from pathlib import Path

import pytest

from asset2sim.assets.exports.mjcf import SCENE_NAME
from asset2sim.assets.exports.refined_object import USD_NAME
from asset2sim.engines.registry import installed, open_world
from asset2sim.intake.dataset import load_dataset
from schemas.asset import AssetRecord, AssetRef
from schemas.settings import Settings, ViewSettings
from schemas.vocabulary import Export, Method, Status, UpAxis
from tasks.pipeline import refine_asset
from tests.assets import prior, written
from tests.cabinets import FORMATS, SIZE, URDF, written_cabinet

pytestmark = pytest.mark.system
mujoco = pytest.importorskip("mujoco")
pxr = pytest.importorskip("pxr")

EXPORTED = Settings(views=ViewSettings(write=False), exports=(Export.MJCF, Export.USD))
RAW_METHOD = Settings(views=ViewSettings(write=False), method=Method.RAW)
STEP = {"timestep_s": 1.0 / 240.0, "contact_friction": 0.5}
TURNED = (
    '<joint name="y_up" type="fixed"><origin rpy="-1.5707963267948966 0 0"/>'
    '<parent link="file"/><child link="body"/></joint></robot>'
)
Y_UP = URDF.replace('<robot name="thing">', '<robot name="thing"><link name="file"/>').replace("</robot>", TURNED)
"""The cabinet as it comes from a tool in which y is up, its front turned aside."""


@pytest.fixture(scope="module", params=[*FORMATS, "y_up"])
def done(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[AssetRecord, Path]:
    """Its record, and the refined folder."""
    base = tmp_path_factory.mktemp(request.param)
    if request.param == "y_up":
        folder, up = written(base / "one", Y_UP), UpAxis.Y
    else:
        folder, up = written_cabinet(base / "one", request.param), None
    ref = AssetRef(asset_id="one", path=str(folder), category="StorageFurniture", up=up)
    return refine_asset(ref, base / "out", EXPORTED, prior), base / "out" / "assets" / "one"


def test_it_is_refined(done: tuple[AssetRecord, Path]) -> None:
    record, folder = done
    assert record.status is Status.OK, record.reason
    assert record.features is not None and record.features.closed_size[2] == pytest.approx(SIZE[2], rel=1e-6)
    assert (folder / "mobility.urdf").is_file() and "/tmp" not in (folder / "mobility.urdf").read_text()


def test_every_engine_has_it_at_its_size(done: tuple[AssetRecord, Path]) -> None:
    record, folder = done
    assert record.overlay is not None
    body = next(link for link in record.overlay.links if link.name == "body")
    for engine in installed():
        with open_world(
            engine, folder / "mobility.urdf", plane=True, timestep_s=1 / 240, contact_friction=0.5
        ) as world:
            world.place({})
            assert {"door", "drawer"} <= set(world.link_names), engine
            assert set(world.joint_names) == {"door_hinge", "drawer_slide"}, engine
            assert world.lowest_m() == pytest.approx(0.0, abs=2e-3), engine
            if record.features is not None and record.features.root == "body":
                assert world.root_center()[2] == pytest.approx(body.com[2], abs=2e-3), engine


def test_mjcf_and_usd_load_plainly(done: tuple[AssetRecord, Path]) -> None:
    record, folder = done
    assert record.overlay is not None
    model = mujoco.MjModel.from_xml_path(str(folder / SCENE_NAME))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    door = data.body("door").xpos - data.body("drawer").xpos
    assert abs(door[2]) == pytest.approx(record.overlay.scale * 0.3, rel=1e-3), "the drawer is over the door"
    stage = pxr.Usd.Stage.Open(str(folder / USD_NAME))
    assert stage is not None and stage.GetDefaultPrim().IsValid()


def test_a_manifest_may_state_the_axis(tmp_path: Path) -> None:
    written(tmp_path / "one", Y_UP)
    (tmp_path / "manifest.csv").write_text("asset_id,path,up\none,one,y\n")
    (ref,) = load_dataset(tmp_path)
    record = refine_asset(ref, tmp_path / "out", Settings(views=ViewSettings(write=False)), prior)
    assert record.features is not None and record.features.closed_size[2] == pytest.approx(SIZE[2], rel=1e-6)
    assert "up_axis" in json.dumps([finding.code for finding in record.findings])


@pytest.mark.parametrize("kind", ["sdf", "mjcf"])
def test_the_asset_unchanged_is_what_was_made_of_its_file(tmp_path: Path, kind: str) -> None:
    ref = AssetRef(asset_id="one", path=str(written_cabinet(tmp_path / "one", kind)))
    record = refine_asset(ref, tmp_path / "out", RAW_METHOD, prior)
    assert record.measurement is not None and record.features is not None, record.reason
    assert record.features.closed_size == pytest.approx(SIZE, rel=1e-6)
