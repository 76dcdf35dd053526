"""The doctor's checks find what is broken and pass what works."""

from pathlib import Path

import pytest

from asset2sim.engines.registry import engine_version
from asset2sim.runs import doctor
from schemas.settings import ModelSettings
from schemas.vocabulary import Engine
from tests.engine_worlds import every_engine
from tests.model_server import ModelServer, Reply, serve
from tests.processes import free_port


@pytest.mark.system
def test_a_healthy_machine_has_no_broken_check(tmp_path: Path) -> None:
    checks = {check.name: check for check in doctor.run_all_checks(tmp_path / "out", ModelSettings())}
    broken = [check for check in checks.values() if check.needed and not check.ok and check.name != "packages"]
    assert broken == []
    assert "rests at 100" in checks["child processes and PyBullet"].detail
    assert not checks["engine mujoco"].needed and not checks["engine sapien"].needed
    assert not (tmp_path / "out").exists()


def test_a_missing_engine_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(doctor, "installed", lambda: (Engine.PYBULLET,))
    with pytest.raises(doctor.DoctorError, match=r"not installed; pip install .*\[bullet,engines\]"):
        doctor.check_engine(Engine.MUJOCO)


@every_engine
def test_a_ball_rests_in_every_engine_that_is_installed(engine: Engine) -> None:
    assert f"{engine_version(engine)}: a dropped ball rests at " in doctor.check_engine(engine)


def test_an_unknown_model_is_broken_and_names_the_choices() -> None:
    with pytest.raises(doctor.DoctorError, match="prior/household"):
        doctor.check_model_answers(ModelSettings(model="prior/magic"))


@pytest.mark.system  # the first import of LiteLLM opens a socket
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


def asked(server: ModelServer) -> ModelSettings:
    return ModelSettings(model="openai/scripted", api_base=server.api_base)


@pytest.mark.system
def test_the_server_is_asked_once_and_briefly(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", "sk-right-key-of-a-test")
    with serve([Reply('{"ok": true}')]) as server:
        detail = doctor.check_model_answers(asked(server))
    assert f"answers at {server.api_base} in " in detail and "18 tokens" in detail
    (body,) = server.requests
    assert (body.get("max_completion_tokens") or body.get("max_tokens")) == doctor.ASK_TOKENS
    assert server.authorizations == ["Bearer sk-right-key-of-a-test"]
    thinking = Reply("", finish_reason="length", completion_tokens=64)
    with serve([thinking]) as server:
        assert "answers at" in doctor.check_model_answers(asked(server))


@pytest.mark.system
@pytest.mark.parametrize(
    ("reply", "words"),
    [
        (
            Reply("Incorrect API key: sk-wrong-key-of-a-test", status=401),
            "refused the key (401): check the key in OPENAI",
        ),
        (Reply("The model `scripted` does not exist", status=404), "check the model's name and api_base"),
        (Reply("overloaded", status=503), "failed (503): try again later"),
        (Reply("no credit: insufficient_quota", status=429), "no credit left"),
    ],
)
def test_a_server_that_refuses_is_one_line_with_what_to_do(
    reply: Reply, words: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", "sk-wrong-key-of-a-test")
    with serve([reply]) as server, pytest.raises(doctor.DoctorError) as error:
        doctor.check_model_answers(asked(server))
    told = str(error.value)
    assert words in told and "\n" not in told and "sk-wrong" not in told and len(server.requests) == 1


@pytest.mark.system
def test_no_server_is_one_line_with_what_to_do_and_no_key_of_the_address(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OPENAI_API_KEY", raising=False)
    settings = ModelSettings(
        model="openai/scripted", api_base=f"http://me:pass-word@127.0.0.1:{free_port()}/v1?code=abc123"
    )
    with pytest.raises(doctor.DoctorError, match=r"could not be reached at .*check the network and api_base") as error:
        doctor.check_model_answers(settings)
    told = str(error.value)
    assert "pass-word" not in told and "abc123" not in told and "\n" not in told
