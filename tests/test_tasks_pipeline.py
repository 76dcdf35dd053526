"""The whole of one asset, in this process: planted defects, what is written, what survives a failure."""

import json
import shutil
from pathlib import Path

import pytest

from asset2sim.assets.authored import read_overlay
from asset2sim.render import VIEW_NAMES
from schemas.asset import AssetRecord
from schemas.interaction import EngineReport
from schemas.request import ModelAnswer
from schemas.settings import Settings, ViewSettings
from schemas.vocabulary import FailureMode, Severity, Source, Stage, Status
from tasks.pipeline import refine_asset
from tests.assets import NO_VIEWS, RAW, fingerprint, prior, sample, saying
from tests.samples.bad_assets import bad_assets

pytestmark = pytest.mark.system

OUTCOMES = {bad.blueprint.asset_id: bad.outcomes for bad in bad_assets()}
# Its collision shapes are cut until nothing overlaps; what must become of it is for the search to settle.
SEEN = Settings(views=ViewSettings(width=48, height=48))


def refined(asset_id: str, out: Path, settings: Settings = NO_VIEWS) -> AssetRecord:
    return refine_asset(sample(asset_id), out, settings, prior)


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, AssetRecord], Path]:
    """Every planted asset, refined once."""
    out = tmp_path_factory.mktemp("planted")
    return {asset_id: refined(asset_id, out) for asset_id in OUTCOMES}, out


@pytest.mark.parametrize("asset_id", sorted(OUTCOMES))
def test_planted_defects_end_as_planned(done: tuple[dict[str, AssetRecord], Path], asset_id: str) -> None:
    record = done[0][asset_id]
    assert record.failure_mode in OUTCOMES[asset_id], record.reason
    assert (record.status is Status.OK) == (record.failure_mode is FailureMode.NONE)
    folder = done[1] / "assets" / asset_id
    if record.status is Status.OK:
        assert record.measurement is not None and record.measurement.console == ()
        assert record.overlay is not None and record.features is not None
        assert {item.name for item in record.overlay.links} == {item.name for item in record.features.links}
        assert not [finding for finding in record.findings if finding.severity is Severity.ERROR]
        assert (folder / "mobility.urdf").is_file()
    else:
        errors = [finding.message for finding in record.findings if finding.severity is Severity.ERROR]
        assert errors[0] == record.reason
        # What was refined and measured can be looked at; what could not be refined leaves nothing.
        assert folder.exists() == (record.measurement is not None)
    assert record.written == folder.exists()


@pytest.mark.parametrize(
    ("asset_id", "code", "name"),
    [
        ("planted_missing_mesh", "missing_mesh", "link_0"),
        ("planted_missing_link", "missing_mesh", "link_0"),
        ("planted_not_xml", "not_xml", None),
        ("planted_inverted_limits", "limits_inverted", "joint_0"),
        ("planted_crossed_flaps", "state_moved", "joint_0"),
    ],
)
def test_a_finding_names_the_defect(
    done: tuple[dict[str, AssetRecord], Path], asset_id: str, code: str, name: str | None
) -> None:
    found = [finding for finding in done[0][asset_id].findings if finding.code == code]
    assert found and {finding.link or finding.joint for finding in found} == {name}


def test_nothing_is_left_beside_the_assets(done: tuple[dict[str, AssetRecord], Path]) -> None:
    records, out = done
    kept = {asset_id for asset_id, record in records.items() if record.overlay is not None}
    assert {path.name for path in (out / "assets").iterdir()} == kept
    assert not list(out.glob("assets/*/views")), "they are written only if wanted"


def test_the_folder_holds_what_the_record_says(tmp_path: Path) -> None:
    before = fingerprint(RAW / "Laptop" / "laptop_silver")
    record = refined("laptop_silver", tmp_path, SEEN)
    folder = tmp_path / "assets" / "laptop_silver"
    assert record.status is Status.OK
    assert read_overlay(folder) == record.overlay
    seen = json.loads((folder / "measurement.json").read_bytes())
    timeless = tuple(report.model_copy(update={"seconds": 0.0}) for report in record.reports)
    assert tuple(EngineReport.model_validate(report) for report in seen) == timeless
    assert record.reports[0].measurement == record.measurement is not None
    assert {path.name for path in (folder / "views").iterdir()} == {f"{name}.png" for name in VIEW_NAMES}
    assert set(record.seconds) == {stage.value for stage in Stage}
    assert record.category == "Laptop"
    assert record.trace and record.trace[0].proposer == "request"
    assert fingerprint(RAW / "Laptop" / "laptop_silver") == before


def test_the_same_input_gives_the_same_bytes(done: tuple[dict[str, AssetRecord], Path], tmp_path: Path) -> None:
    out = done[1]
    for asset_id in ("planted_open_mesh", "planted_blocked_drawer"):
        refined(asset_id, tmp_path)
        one, two = (fingerprint(base / "assets" / asset_id) for base in (out, tmp_path))
        assert "mobility.urdf" in one and "overlay.json" in one
        assert one == two


def test_a_good_folder_survives_failing_runs(tmp_path: Path) -> None:
    ref, folder, out = sample("laptop_silver"), tmp_path / "laptop_silver", tmp_path / "out"
    shutil.copytree(ref.path, folder)
    ref = ref.model_copy(update={"path": str(folder)})
    assert refine_asset(ref, out, NO_VIEWS, prior).status is Status.OK
    before = fingerprint(out)
    failing = refine_asset(ref, out, NO_VIEWS, lambda _: ModelAnswer(content=None, calls=(), error="out of credit"))
    assert failing.failure_mode is FailureMode.MODEL_ERROR and fingerprint(out) == before
    shutil.rmtree(folder / "textured_objs")
    assert refine_asset(ref, out, NO_VIEWS, prior).failure_mode is FailureMode.MISSING_MESH
    assert fingerprint(out) == before
    (folder / "mobility.urdf").write_text("not xml")
    assert refine_asset(ref, out, NO_VIEWS, prior).failure_mode is FailureMode.UNREADABLE_ASSET
    assert fingerprint(out) == before


def test_a_models_answer_that_never_fits_is_no_estimate(tmp_path: Path) -> None:
    record = refine_asset(sample("laptop_silver"), tmp_path, NO_VIEWS, saying({"scale": -1.0}))
    assert record.failure_mode is FailureMode.NO_VALID_ESTIMATE and "scale" in record.reason
    assert record.features is not None and record.overlay is None and not (tmp_path / "assets").exists()


def test_a_sloppy_models_answer_is_made_to_work(tmp_path: Path) -> None:
    """Hardly anything said, and that wildly wrong: the object still comes to rest."""
    wild = {
        "scale": 0.2, "joints": [{"name": "joint_0", "damping": 1e6, "friction": 0.0, "stiffness": 1e6}],
        "initial_joint_positions": {"joint_0": 40.0}, "asked": ["joint_0"],
    }  # fmt: skip
    record = refine_asset(sample("box_wooden"), tmp_path, NO_VIEWS, saying(wild))
    assert record.status is Status.OK, record.reason
    assert record.overlay is not None and record.overlay.scale_source is Source.PRIOR
    assert {"damping_bounded", "stiffness_bounded"} <= {finding.code for finding in record.findings}
    assert json.loads((tmp_path / "assets" / "box_wooden" / "overlay.json").read_text())["scale"] == 0.2


def test_sample_keys_resist_as_fingers_know_them_in_every_engine(tmp_path: Path) -> None:
    record = refined("keyboard_compact", tmp_path)
    assert record.failure_mode is FailureMode.NONE, record.reason
    assert record.overlay is not None and len(record.reports) > 0
    keys = [joint for joint in record.overlay.joints if joint.label == "key"]
    for report in record.reports:
        assert report.interaction is not None
        efforts = {item.joint: item.opening or 0.0 for item in report.interaction.openings}
        assert all(0.3 <= efforts[joint.name] <= 0.8 for joint in keys), (report.engine, efforts)
    for joint in keys:
        assert joint.upper is not None and joint.armature > 0.0
        assert 0.4 <= joint.stiffness * (joint.upper - joint.spring_reference) <= 1.2
    assert not {"mass_raised", "mass_ratio"} & {finding.code for finding in record.findings}


def test_a_pedal_resists_as_much_as_its_bin_bears(tmp_path: Path) -> None:
    record = refined("trashcan_pedal", tmp_path)
    assert record.failure_mode is FailureMode.NONE, record.reason
    assert record.overlay is not None
    pedal = next(joint for joint in record.overlay.joints if joint.label == "foot_pad")
    (bounded,) = [finding for finding in record.findings if finding.code == "press_bounded"]
    assert bounded.joint == pedal.name and bounded.value == 25.0 and bounded.limit is not None
    weight = record.overlay.mass_kg * 9.81
    assert bounded.limit < weight < 25.0, "a foot would tip it, however low its weight lies"
    start, end = (abs(pedal.stiffness * (pedal.spring_reference - at)) for at in (pedal.closed, pedal.open))
    assert start / end == pytest.approx(15.0 / 25.0, abs=0.05), "forces are lowered together"
