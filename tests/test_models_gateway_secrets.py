"""A run against a server that echoes the key wherever it can: it reaches no file, and a second run asks nothing."""

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from asset2sim.intake.dataset import load_dataset
from asset2sim.models.gateway.environment import load_env_file
from asset2sim.models.prior.answer import answer
from flows import PIPELINE
from schemas.asset import AssetRef
from schemas.secret import redact_answer
from schemas.settings import EngineSettings, ModelSettings, RunSettings, Settings
from schemas.vocabulary import Engine, Status
from tests.assets import ROOT
from tests.model_server import Reply, serve
from tests.prefect_server import using
from tests.whole_records import refine_all

pytestmark = pytest.mark.system

KEY = "sk-proj-planted0123456789abcdef"
LIMIT_S = 900


def text_of(body: dict[str, Any]) -> str:
    content = body["messages"][1]["content"]
    return content if isinstance(content, str) else str(content[0]["text"])


def echoing(number: int, body: dict[str, Any]) -> Reply:
    """A server fault, an answer that does not fit, and one that does, each with the key in it."""
    if number == 0:
        return Reply(f"cannot serve Bearer {KEY}", status=500, headers={"Retry-After": "0", "X-Key": KEY})
    good = json.loads(answer(text_of(body)))
    if number == 1:
        return Reply(json.dumps({**good, KEY: KEY}))
    escaped = "".join(f"\\u{ord(character):04x}" for character in KEY)
    good["notes"] = [f"the key is {KEY}", "ESCAPED"]
    return Reply(json.dumps(good).replace("ESCAPED", escaped))


def refine(
    ready: list[str], out: Path, environment: dict[str, str], folder: Path, *options: str
) -> subprocess.CompletedProcess[str]:
    hidden = ("OPENAI_API_KEY", "OPENAI_API_BASE", "OPENAI_BASE_URL")
    environment = {name: value for name, value in environment.items() if name not in hidden}
    command = [*ready, "-m", "flows.command", "refine", str(ROOT / "data" / "raw"), "--assets", "box_wooden"]
    return subprocess.run(
        [*command, "--out", str(out), "--workers", "1", "--engines", "pybullet", "--no-interaction", *options],
        env=environment, cwd=folder, capture_output=True, text=True, timeout=LIMIT_S,
    )  # fmt: skip


def everything_in(folder: Path) -> dict[str, bytes]:
    """Every file below a folder as text may be found in it: tables are compressed, so they are read."""
    found = {}
    for path in folder.rglob("*"):
        if path.is_file():
            found[str(path)] = path.read_bytes()
            if path.suffix == ".parquet":
                found[f"{path}, read"] = repr(pq.read_table(path).to_pylist()).encode()
    return found


def test_a_planted_key_reaches_no_file_and_a_second_run_asks_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, prefect_server: str, prefect_server_home: Path, ready: list[str]
) -> None:
    out, home, folder = tmp_path / "out", tmp_path / "prefect", tmp_path / "here"
    folder.mkdir()
    (folder / ".env").write_text(f"OPENAI_API_KEY={KEY}\n", encoding="utf-8")
    asked: list[dict[str, Any]] = []

    def script(body: dict[str, Any]) -> Reply:
        asked.append(body)
        return echoing(len(asked) - 1, body)

    with serve(script) as server:
        environment, asking = using(prefect_server, home), ("--model", "openai/scripted", "--api-base", server.api_base)
        first = refine(ready, out, environment, folder, *asking)
        assert first.returncode == 0, first.stderr
        of_first = len(server.requests)
        monkeypatch.setenv("OPENAI_API_KEY", KEY)
        (again,) = refine_all([sample()], out, settings(server.api_base), PIPELINE).records
    assert set(server.authorizations) == {f"Bearer {KEY}"} and of_first == len(server.requests) >= 3
    assert again.status is Status.OK and len(again.calls) == of_first - 1
    assert {(call.cached, call.cost_usd, call.prompt_tokens) for call in again.calls} == {(True, 0.0, 0)}
    assert [call.outcome for call in again.calls[:2]] == ["invalid_answer", "cached"]
    files = everything_in(out) | everything_in(home) | everything_in(prefect_server_home)
    files["console"] = f"{first.stdout}{first.stderr}".encode()
    for part in (KEY, KEY[8:]):
        assert [name for name, content in files.items() if part.encode() in content] == []
    overlay = json.loads((out / "assets" / "box_wooden" / "overlay.json").read_text())
    assert json.dumps(overlay["notes"]).count("***") == 2
    kept = (out / "logs" / "box_wooden.answers.txt").read_text()
    assert "refused answer to 'synthesis'" in kept and "***" in kept


def sample() -> AssetRef:
    (ref,) = load_dataset(ROOT / "data" / "raw", None, ("box_wooden",), None)
    return ref


def settings(api_base: str) -> Settings:
    """As the command's options have it."""
    return Settings(
        model=ModelSettings(model="openai/scripted", api_base=api_base),
        engine=EngineSettings(verify=(Engine.PYBULLET,), interact=False),
        run=RunSettings(workers=1),
    )


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (f'{{"notes": ["{KEY}"]}}', '{"notes": ["***"]}'),
        ('{"notes": ["\\u0073\\u006b-proj-planted0123456789abcdef"]}', '{"notes": ["***"]}'),
        ('{"notes": ["a\\u0022b", "caf\\u00e9", "\\\\u0041"]}', '{"notes": ["a\\u0022b", "caf\\u00e9", "\\\\u0041"]}'),
        ('{"links": [{"name": "sk_handle_0123456789"}]}', '{"links": [{"name": "sk_handle_0123456789"}]}'),
        ('{"material": "hardwood", "n": 1234567890}', '{"material": "hardwood", "n": 1234567890}'),
    ],
)
def test_an_answer_loses_keys_and_nothing_else(text: str, expected: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("OPENAI_API_KEY", KEY)
    monkeypatch.setenv("A_PASSWORD", "hardwood")
    monkeypatch.setenv("MAX_TOKENS", "1234567890")
    assert redact_answer(text) == expected


def test_a_key_may_stand_in_env_and_what_is_set_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in ("FIRST_TEST_KEY", "SECOND_TEST_KEY", "EMPTY_TEST_KEY"):
        monkeypatch.setenv(name, "")
        monkeypatch.delenv(name)
    monkeypatch.setenv("SECOND_TEST_KEY", "set before")
    (tmp_path / ".env").write_text(
        '# keys\nexport FIRST_TEST_KEY="with $SIGN ${SECOND_TEST_KEY}"\nSECOND_TEST_KEY=from file\nEMPTY_TEST_KEY\n',
        encoding="utf-8",
    )
    load_env_file(tmp_path)
    assert os.environ["FIRST_TEST_KEY"] == "with $SIGN ${SECOND_TEST_KEY}"
    assert os.environ["SECOND_TEST_KEY"] == "set before" and "EMPTY_TEST_KEY" not in os.environ
    load_env_file(tmp_path / "nowhere")
