"""``asset2sim probe``: the flow over an output, its rows, its page, and what it refuses."""

from pathlib import Path

import pytest

pytest.importorskip("mujoco", reason="MuJoCo is not installed here")
from flows.command import refine, run_command, serve
from lab.flows import probe as module
from lab.runner import latest_own
from lab.schemas.tables import PROBE_TRIALS
from lab.tests.probe_episodes import gl_works
from lab.tests.test_probes_probe_study import BOX, QUICK, out

__all__ = ["out"]

pytestmark = [pytest.mark.system, pytest.mark.skipif(not gl_works(), reason="neither EGL nor OSMesa works here")]


def test_the_command_does_what_is_left_to_do_and_writes_the_page(
    out: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    # Prefect's server takes 10 s; lab/tests/test_flows_record_motion.py has a flow of the same shape over it.
    monkeypatch.setattr(module, "in_flow", lambda name, work: work())
    page = out.parent / "page.md"
    page.write_text("<!-- probe: begin (make probe) -->\n<!-- probe: end -->\n", encoding="utf-8")
    words = ["probe", str(out), "--policy", "scripted", "--tasks", "box close", "--trials", "1"]
    words += ["--methods", "asset2sim", "--page", str(page), "--gripper", "panda"]
    # The box is no object: it cannot be put into the scene, and the task is not done.
    assert run_command(words, refine=refine, nightly=serve) == 0
    assert "no SRCC of scripted" in capsys.readouterr().out
    assert "| scripted | asset2sim | 0.00 |" in page.read_text(encoding="utf-8")
    (row,) = latest_own([out], PROBE_TRIALS).to_dict("records")
    assert (row["asset_id"], row["outcome"], row["success"]) == (BOX, "failed", False)
    assert "validation errors for PhysicsOverlay" in row["reason"]
    assert run_command(words, refine=refine, nightly=serve) == 0
    assert "1 of 1 trials have a result" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("trials", "said"), [("1", "none of 1 trials could be done, the last: "), ("9", "6 trials are left")]
)
def test_a_policy_that_nobody_serves_is_no_success(
    trials: str, said: str, out: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "in_flow", lambda name, work: work())
    monkeypatch.setattr(module, "ProbeSettings", lambda: QUICK.model_copy(update={"connect_s": 0.2}))
    words = ["probe", str(out), "--policy", "openpi://127.0.0.1:1", "--tasks", "box close", "--trials", trials]
    words += ["--gripper", "panda"]
    assert run_command(words, refine=refine, nightly=serve) == 1
    assert said in capsys.readouterr().err


def test_what_is_no_policy_is_said_in_one_line(out: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for policy, said in (("pi0", "unknown policy 'pi0'"), ("http://h", "names no policy")):
        assert run_command(["probe", str(out), "--policy", policy], refine=refine, nightly=serve) == 2
        assert said in capsys.readouterr().err
