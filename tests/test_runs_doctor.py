"""The doctor's checks find what is broken and pass what works."""

from pathlib import Path

import pytest

from asset2sim.engines.registry import engine_version
from asset2sim.runs import doctor
from schemas.settings import ModelSettings
from schemas.vocabulary import Engine
from tests.engine_worlds import every_engine


@pytest.mark.system
def test_a_healthy_machine_has_no_broken_check(tmp_path: Path) -> None:
    checks = {check.name: check for check in doctor.examine(tmp_path / "out", ModelSettings())}
    broken = [check for check in checks.values() if check.needed and not check.ok and check.name != "packages"]
    assert broken == []
    assert "rests at 100" in checks["child processes and PyBullet"].detail
    assert not checks["engine mujoco"].needed and not checks["engine sapien"].needed
    assert not (tmp_path / "out").exists()


def test_a_missing_engine_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "installed", lambda: (Engine.PYBULLET,))
    with pytest.raises(doctor.DoctorError, match=r"not installed; pip install .*\[engines\]"):
        doctor.check_engine(Engine.MUJOCO)


@every_engine
def test_a_ball_rests_in_every_engine_that_is_installed(engine: Engine) -> None:
    assert f"{engine_version(engine)}: a dropped ball rests at " in doctor.check_engine(engine)


def test_an_unknown_model_is_broken_and_names_the_choices() -> None:
    with pytest.raises(doctor.DoctorError, match="prior/household"):
        doctor.check_model_answers(ModelSettings(model="prior/magic"))


def test_a_missing_key_is_broken_and_names_its_variable(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OPENAI_API_KEY", raising=False)
    with pytest.raises(doctor.DoctorError, match="OPENAI_API_KEY"):
        doctor.check_model_answers(ModelSettings(model="openai/gpt-4o"))


def test_a_folder_below_a_file_is_broken(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    with pytest.raises(doctor.DoctorError, match="choose another --out"):
        doctor.check_writable(tmp_path / "file" / "out")


def test_an_engine_that_is_not_sane_is_broken(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "BALL_RADIUS_M", 0.2)
    with pytest.raises(doctor.DoctorError, match="not sane"):
        doctor.check_engine()
