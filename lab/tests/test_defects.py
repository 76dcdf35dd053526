"""The bench of planted defects: plants change what they say, checks see what is left, scores count what they should."""

import shutil
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest

from asset2sim.checks.declared_check import known_checks
from flows import PIPELINE
from lab.defects import remaining as left
from lab.defects.defect_results import (
    DefectResult,
    Symptom,
    caught_by,
    concerned,
    early_symptoms,
    mended_by,
    passes,
    raw_symptoms,
    results_json,
    results_text,
    share,
)
from lab.defects.defects import DEFECTS
from lab.defects.planting import Defect, PlantedChange, RefinedAsset, Target, edited, named, part
from lab.defects.try_defects import CleanObject, DefectBench, clean_object, samples, try_defect, why_not_mended
from schemas.asset import AssetRecord
from schemas.finding import Finding
from schemas.interaction import ContactPair, OverlapPair
from schemas.settings import EngineSettings, Settings, Thresholds, ViewSettings
from schemas.vocabulary import Engine, OverlapCause, Severity, Stage, Status
from tasks.pipeline import refine_asset
from tests.assets import fingerprint, prior

QUICK = Settings(views=ViewSettings(write=False), engine=EngineSettings(verify=(Engine.PYBULLET,), interact=False))
"""One engine and the paper's tests alone: what the bench does with more is the pipeline's."""
BY_RECORD = {"link shifted into its neighbour", "link shifted into its parent", "everything in millimetres"}
"""Defects that only a record of the refined asset shows, not its files."""


@pytest.fixture(scope="module")
def clean(tmp_path_factory: pytest.TempPathFactory) -> dict[str, RefinedAsset]:
    """Every object of the bench, refined once."""
    out = tmp_path_factory.mktemp("clean")
    wanted = {defect.target.asset_id for defect in DEFECTS}
    records = {ref.asset_id: refine_asset(ref, out, QUICK, prior) for ref in samples(wanted)}
    return {name: RefinedAsset(out / "assets" / name, record) for name, record in records.items()}


def planted_in(defect: Defect, clean: dict[str, RefinedAsset], folder: Path) -> tuple[PlantedChange, Path]:
    target = folder / defect.target.asset_id
    shutil.copytree(clean[defect.target.asset_id].folder, target)
    return defect.plant(target, defect.target), target


def test_what_a_check_says_to_be_shown_by_is_a_defect_of_the_bench() -> None:
    named = {name: check.name for check in known_checks() for name in check.planted}
    assert len(named) >= 10 and named.keys() - {defect.name for defect in DEFECTS} == set()


def test_there_are_enough_defects_and_no_two_are_alike() -> None:
    assert len(DEFECTS) >= 18
    assert max(Counter(defect.name for defect in DEFECTS).values()) == 1
    assert len({defect.target.asset_id for defect in DEFECTS}) >= 4


@pytest.mark.system
@pytest.mark.parametrize("defect", DEFECTS, ids=lambda defect: defect.name)
def test_a_plant_changes_what_it_says_and_its_check_sees_it(
    clean: dict[str, RefinedAsset], defect: Defect, tmp_path: Path
) -> None:
    kept = clean[defect.target.asset_id]
    before = fingerprint(kept.folder)
    planted, folder = planted_in(defect, clean, tmp_path)
    after = fingerprint(folder)
    assert fingerprint(kept.folder) == before, "the clean object is left alone"
    changed = {name for name in before.keys() | after.keys() if before.get(name) != after.get(name)}
    assert changed and all(name == "mobility.urdf" or name.startswith("collision/") for name in changed)
    assert planted.what and kept.record.features is not None
    links, joints = (
        {item.name for item in items} for items in (kept.record.features.links, kept.record.features.joints)
    )
    assert set(planted.links) <= links and set(planted.joints) <= joints
    # What the clean object has is nothing of the defect; what was planted is, were it left as it is.
    if defect.left is left.never_mended:
        return
    assert defect.left(kept, kept, defect.target) == ""
    if defect.name not in BY_RECORD:
        try:
            assert defect.left(kept, RefinedAsset(folder, kept.record), defect.target)
        except KeyError:
            assert defect.name == "inertial missing"


@pytest.mark.system
def test_overlaps_and_sizes_are_taken_from_the_record(clean: dict[str, RefinedAsset]) -> None:
    defect = next(defect for defect in DEFECTS if defect.name == "link shifted into its parent")
    kept = clean[defect.target.asset_id]
    pair = ContactPair(link_a="link_2", link_b=defect.target.link, depth_m=0.01, penetration_m=0.02, n_points=2)
    overlap = OverlapPair(pair=pair, related=True, cause=OverlapCause.AUTHORED)
    spoilt = replace(kept, record=kept.record.model_copy(update={"overlaps": (overlap,)}))
    assert "10 mm" in defect.left(kept, spoilt, defect.target)
    assert kept.record.overlay is not None
    huge = kept.record.overlay.model_copy(update={"scale": 1000.0 * kept.record.overlay.scale})
    spoilt = replace(kept, record=kept.record.model_copy(update={"overlay": huge}))
    assert "1e+03" in left.size_left(kept, spoilt, defect.target)
    signs = set(raw_symptoms(kept.record.model_copy(update={"overlaps": (overlap,)}), Thresholds()))
    assert Symptom("pybullet", "overlap", "link_2") in signs


@pytest.fixture(scope="module")
def box(tmp_path_factory: pytest.TempPathFactory) -> tuple[CleanObject, DefectBench]:
    """The wooden box as the bench prepares it."""
    out = tmp_path_factory.mktemp("bench")
    (ref,) = samples(["box_wooden"])
    bench = DefectBench(out, QUICK, PIPELINE)
    return clean_object(ref, bench), bench


@pytest.mark.system
@pytest.mark.parametrize("name", ["limits crossed", "collision mesh missing", "two links of one name"])
def test_a_defect_from_plant_to_row(box: tuple[CleanObject, DefectBench], name: str) -> None:
    found = next(defect for defect in DEFECTS if defect.name == name)
    clean, bench = box
    assert clean.problem == "" and clean.again is not None
    target = replace(found.target, asset_id="box_wooden", link="link_0", joint="joint_0")
    row = try_defect(replace(found, target=target), clean, bench)
    assert row.is_caught and row.seconds > 0.0
    codes = {"limits crossed": "limits_inverted", "collision mesh missing": "missing_mesh"}
    if name in codes:
        assert row.is_mended, row.left
        assert any(sign.endswith(codes[name]) for sign in row.caught) and codes[name] in row.mended
    else:
        assert not row.is_mended and "unreadable_asset" in row.left and row.caught == ("extract duplicate_link",)


def test_what_is_not_clean_is_left_out(tmp_path: Path) -> None:
    (ref,) = samples(["box_wooden"])
    copy = shutil.copytree(ref.path, tmp_path / "data" / "box_wooden")
    ref = ref.model_copy(update={"path": str(copy), "root": str(copy.parent)})
    with edited(Path(ref.path)) as robot:
        part(named(robot, "joint", "joint_0"), "axis").set("xyz", "0 0 0")
    found = clean_object(ref, DefectBench(tmp_path / "out", QUICK, PIPELINE))
    assert "no direction" in found.problem and found.again is None


@pytest.mark.system
def test_what_cannot_be_read_is_a_reason_and_no_end(box: tuple[CleanObject, DefectBench]) -> None:
    def unreadable(kept: RefinedAsset, mended: RefinedAsset, at: Target) -> str:
        raise ValueError("could not convert string to float: 'None'")

    clean, _ = box
    assert "'None'" in why_not_mended(replace(DEFECTS[0], left=unreadable), clean, clean.kept)


@pytest.mark.system
def test_checking_as_it_is_writes_nothing(box: tuple[CleanObject, DefectBench], tmp_path: Path) -> None:
    clean, _ = box
    ref = clean.ref.model_copy(update={"path": str(clean.kept.folder), "root": None})
    assert DefectBench(tmp_path, QUICK, PIPELINE).check_unrefined(ref, "out").status is Status.OK
    assert not (tmp_path / "out" / "assets").exists()


A, B = Symptom("mujoco", "drop", ""), Symptom("validate", "mass_zero", "lid")
OTHER = Symptom("validate", "mass_zero", "body")


def test_a_sign_of_another_link_or_of_the_clean_object_does_not_count() -> None:
    about = frozenset({"lid", "hinge"})
    assert caught_by({A, B, OTHER}, set(), about) == (B, A), "what names the link comes first"
    assert caught_by({A, B, OTHER}, {A, B}, about) == ()
    assert caught_by({OTHER}, set(), about) == ()


@pytest.mark.system
def test_a_defect_is_about_its_link_its_joint_and_what_they_move(clean: dict[str, RefinedAsset]) -> None:
    record = clean["storage_sideboard"].record
    assert concerned(PlantedChange("", links=("link_0",)), record) == {"link_0", "joint_0"}
    assert concerned(PlantedChange("", joints=("joint_1",)), record) == {"link_1", "joint_1"}
    assert concerned(PlantedChange(""), record) == frozenset()


def finding(severity: Severity, stage: Stage, code: str, link: str | None = None) -> Finding:
    return Finding(stage=stage, severity=severity, code=code, message=code, link=link)


@pytest.mark.system
def test_only_early_warnings_of_a_refinement_catch(clean: dict[str, RefinedAsset]) -> None:
    findings = (
        finding(Severity.INFO, Stage.VALIDATE, "completed", "lid"),
        finding(Severity.WARNING, Stage.VALIDATE, "mass_zero", "lid"),
        finding(Severity.ERROR, Stage.EXTRACT, "no_limits"),
        finding(Severity.WARNING, Stage.REFINE, "state_moved"),
    )
    record: AssetRecord = clean["box_wooden"].record.model_copy(update={"findings": findings})
    assert set(early_symptoms(record)) == {B, Symptom("extract", "no_limits", "")}
    assert mended_by(record, clean["box_wooden"].record, frozenset({"lid"}))[0] == "completed"


def test_shares_and_the_verdict() -> None:
    good = DefectResult("d", "o", "w", ("x y",), ("z",), "", 1.0)
    missed, refused = replace(good, caught=()), replace(good, mended=(), left="a guess")
    assert share([good, missed, refused, refused], mended=False) == 0.75
    assert share([good, missed, refused, refused], mended=True) == 0.5
    assert passes([good] * 16 + [missed] + [refused] * 3)
    assert not passes([good] * 17 + [missed] * 3) and not passes([good] * 15 + [refused] * 5)
    assert not passes([good] * 15) and share([], mended=True) == 0.0


def test_the_table_says_what_was_caught_and_what_was_not() -> None:
    rows = [
        DefectResult("mass", "box", "w", ("a b", "c d", "e f"), ("g",), "", 1.0),
        DefectResult("axis", "box", "w", (), (), "a guess", 2.0),
    ]
    lines = results_text(rows, {"bucket": "it fails"}).splitlines()
    assert "a b, c d + 1" in lines[2] and lines[2].endswith("1.0")
    assert "NOT CAUGHT" in lines[3] and "not: a guess" in lines[3]
    assert "caught 1 of 2 (50%" in lines[5] and "mended 1 of 2" in lines[6] and "bucket" in lines[7]
    assert '"caught_share": 0.5' in results_json(rows, {})
