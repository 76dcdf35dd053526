"""The checks alone: any folder as it is, with the state that a refined one states."""

import json
from pathlib import Path
from typing import Any

import pytest

from asset2sim.assets.authored import authored_overlay
from asset2sim.assets.checksums import write_checksums
from asset2sim.runs.check_folders import check_settings
from flows.command import run_command
from schemas.asset import AssetRef
from schemas.overlay import PhysicsOverlay
from schemas.settings import Settings
from schemas.support import Support, SupportKind
from schemas.vocabulary import Method, Source
from tasks.check import compare_with_checksums, overlay_as_it_is
from tasks.progress import AssetJob
from tests.assets import joint, link, prior, read, robot, written
from tests.test_flows_command import never, never_serve

BOX = '<{0}><origin xyz="{2}"/><geometry><box size="{1}"/></geometry></{0}>'
MASS = '<inertial><mass value="{0}"/><origin xyz="{1}"/><inertia ixx="{2}" ixy="0" ixz="0" iyy="{2}" iyz="0" izz="{2}"/></inertial>'  # noqa: E501


def part(name: str, size: str, xyz: str, mass: float, moment: float) -> str:
    return link(
        name, BOX.format("visual", size, xyz) + BOX.format("collision", size, xyz) + MASS.format(mass, xyz, moment)
    )


def chest(damping: float = 0.05, friction: float = 0.05) -> str:
    """A box with a lid on it that turns about its back edge, with masses and joint terms of its own."""
    dynamics = f'<dynamics damping="{damping}" friction="{friction}"/>'
    return robot(
        part("body", "0.3 0.3 0.2", "0 0 0.1", 3.0, 0.03),
        part("lid", "0.3 0.3 0.02", "0.15 0 0.012", 0.3, 0.003),
        joint("hinge", "revolute", "body", "lid", xyz="-0.15 0 0.2", axis="0 -1 0", limit="0 1.5", more=dynamics),
    )


def refined(folder: Path, **changes: Any) -> PhysicsOverlay:
    """An ``overlay.json`` beside the chest, which asks for an open lid on something fixed, and checksums."""
    overlay = authored_overlay(read(folder), Settings().physics)
    (hinge,) = overlay.joints
    hinge = hinge.model_copy(update={"initial_position": 0.7, "asked_position": 0.7, "position_source": Source.USER})
    support = Support(kind=SupportKind.FIXED, source=Source.USER)
    stated = {"joints": (hinge,), "contact_friction": 0.8, "support": support, **changes}
    (folder / "overlay.json").write_text(overlay.model_copy(update=stated).model_dump_json())
    write_checksums(folder)
    return overlay


def job(folder: Path, **settings: Any) -> AssetJob:
    ref = AssetRef(asset_id=folder.name, path=str(folder))
    return AssetJob(ref, folder.parent, check_settings(Settings().model_copy(update=settings)), prior)


def test_a_refined_folder_states_its_state_and_the_urdf_its_numbers(tmp_path: Path) -> None:
    folder = written(tmp_path / "chest", chest())
    refined(folder)
    (folder / "mobility.urdf").write_text(chest(damping=0.4))
    done = overlay_as_it_is(job(folder), read(folder))
    (hinge,) = done.overlay.joints
    assert (hinge.initial_position, hinge.asked_position, hinge.damping) == (0.7, 0.7, 0.4)
    assert (done.overlay.contact_friction, done.overlay.support.kind) == (0.8, SupportKind.FIXED)
    assert done.overlay.scale == 1.0 and [item.code for item in done.findings] == ["refined_state"]
    changed = compare_with_checksums(folder).findings
    assert [item.message for item in changed] == ["not as it was refined: mobility.urdf changed"]


def test_a_foreign_folder_starts_at_zero_on_what_its_shape_says(tmp_path: Path) -> None:
    folder = written(tmp_path / "chest", chest())
    done = overlay_as_it_is(job(folder), read(folder))
    assert done.overlay.joints[0].initial_position == 0.0 and done.overlay.support.kind is SupportKind.FREESTANDING
    forced = overlay_as_it_is(job(folder, support=SupportKind.FIXED), read(folder))
    assert forced.overlay.support.fixed and forced.overlay.support.source is Source.USER
    assert compare_with_checksums(folder).findings == ()


def test_a_joint_that_was_renamed_and_an_overlay_that_is_cut_are_said(tmp_path: Path) -> None:
    folder = written(tmp_path / "chest", chest())
    refined(folder)
    (folder / "mobility.urdf").write_text(chest().replace('"hinge"', '"lid_hinge"'))
    told = overlay_as_it_is(job(folder), read(folder)).findings
    assert "overlay.json states joint 'hinge', which the URDF does not have" in told[0].message
    (folder / "overlay.json").write_text("{")
    done = overlay_as_it_is(job(folder), read(folder))
    assert done.findings[0].code == "refined_state_unread" and done.overlay.joints[0].initial_position == 0.0


def test_checks_propose_nothing_and_draw_nothing() -> None:
    settings = check_settings(Settings())
    assert (settings.method, settings.views.write) == (Method.RAW, False)


def checked(capsys: pytest.CaptureFixture[str], *words: str) -> tuple[int, str, str]:
    code = run_command(
        ["check", *words, "--engines", "pybullet", "--no-interaction"], refine=never, nightly=never_serve
    )
    return code, *capsys.readouterr()


@pytest.mark.system
def test_the_command_checks_folders_as_they_are(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    good, cut = (written(tmp_path / "set" / name, chest()) for name in ("good", "cut"))
    refined(good)
    refined(cut)
    before = sorted(tmp_path.rglob("*"))
    code, out, _ = checked(capsys, str(good))
    assert code == 0 and "1 of 1 ok" in out
    code, out, _ = checked(capsys, str(good), "--json")
    (told,) = json.loads(out)
    assert (code, told["status"], told["initial_positions"], told["support"]) == (0, "ok", {"hinge": 0.7}, "fixed")
    assert told["engines"]["pybullet"]["passed"] and told["findings"] == []
    assert sorted(tmp_path.rglob("*")) == before, "a check writes nothing"
    (cut / "mobility.urdf").write_text(chest()[:200])
    code, out, _ = checked(capsys, str(tmp_path / "set"))
    said = " ".join(out.split())
    assert code == 1 and "1 of 2 ok" in said and "unreadable_asset" in said and "mobility.urdf changed" in said
    code, out, _ = checked(capsys, str(cut), "--json", "--sarif", str(tmp_path / "found.sarif"))
    ((told,), log) = json.loads(out), json.loads((tmp_path / "found.sarif").read_text(encoding="utf-8"))
    assert code == 1 and told["remedy"] and told["remedy"] in log["runs"][0]["results"][0]["message"]["text"]


@pytest.mark.system
def test_a_file_without_masses_is_said_to_have_none(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    parts = (link(name, BOX.format("collision", "0.3 0.3 0.2", "0 0 0.1")) for name in ("body", "lid"))
    hinge = joint("hinge", "revolute", "body", "lid", xyz="0 0 0.2", axis="0 -1 0", limit="0 1.5")
    folder = written(tmp_path / "bare", robot(*parts, hinge))
    code = run_command(["check", str(folder), "--engines", "pybullet,mujoco"], refine=never, nightly=never_serve)
    said = " ".join(capsys.readouterr().out.split())
    assert code == 1 and "bare engine_refused" in said, "what PyBullet makes up for it is no verdict on the file"
    for told in ("no link states a mass and an inertia", "remedy: mend what it names", "0 of 1 ok --fix FOLDER"):
        assert told in said, said


def test_a_folder_that_is_none_is_a_mistake(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for words, said in ((str(tmp_path / "no"), "no dataset at"), ("s3://bucket/a", "copy it first")):
        code, out, err = checked(capsys, words)
        assert (code, out) == (2, "") and said in err and err.count("\n") == 1
