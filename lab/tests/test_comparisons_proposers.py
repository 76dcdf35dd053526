"""The table of who proposes states, from tables with stated numbers, and which objects each model is run on."""

from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from asset2sim.models.gateway.recorded import UnrecordedError, find_answer
from lab.comparisons.proposers import (
    HEADINGS,
    ProposerRun,
    answered,
    distances,
    overlapping_at_start,
    proposers_of,
    proposers_table,
    settings_with,
)
from lab.pages.blocks import markers
from schemas.model_names import REFINEMENT_PURPOSE, described, model_for
from schemas.request import ModelRequest
from schemas.settings import Settings
from schemas.vocabulary import Proposer
from tests.assets import ROOT


def frame(columns: str, *rows: tuple[object, ...]) -> pd.DataFrame:
    return pd.DataFrame(rows, columns=columns.split())


TRACE = frame(
    "asset_id step_index proposer phi_before_mm phi_after_mm",
    ("a", 0, "request", 10.0, 10.0), ("a", 1, "model", 10.0, 4.0), ("a", 2, "model", 4.0, 4.0),
    ("a", 3, "shape", 4.0, 0.0),
    ("b", 0, "request", 2.0, 2.0), ("b", 1, "line", 2.0, 0.05), ("c", 0, "request", 0.1, 0.1),
)  # fmt: skip
FINDINGS = frame(
    "asset_id code joint value limit_value message", ("a", "state_moved", "lid", 0.3, 0.5, ""),
    ("b", "state_moved", "drawer", 0.01, 0.0, ""),
    ("b", "mended", None, 1.0, 0.0, ""),
)  # fmt: skip
JOINTS = frame("asset_id joint type", ("a", "lid", "revolute"), ("b", "drawer", "prismatic"), ("b", "lid", "revolute"))
CALLS = frame(
    "asset_id purpose", ("a", "synthesis"), ("a", REFINEMENT_PURPOSE), ("a", REFINEMENT_PURPOSE), ("b", "synthesis")
)
ASSETS = frame("asset_id status penetration_mm", ("a", "ok", 0.0), ("b", "failed", 0.05))


def test_what_overlaps_at_the_start_is_compared() -> None:
    assert overlapping_at_start(TRACE.sample(frac=1.0, random_state=1), 0.1) == ["a", "b"]


def test_every_figure_is_a_mean_over_objects_with_the_largest_beside() -> None:
    run = ProposerRun("prior/noisy", Proposer.MODEL, ASSETS, JOINTS, TRACE[TRACE["asset_id"] != "c"], CALLS, FINDINGS)
    lines = [[cell.strip() for cell in line.strip("|").split("|")] for line in proposers_table([run]).splitlines()]
    assert lines[0] == list(HEADINGS) and len(lines) == 3
    assert lines[2] == [
        described("prior/noisy"), "`model`", "2", "1.00 (2)", "1.00 (2)", "6.0 (10)", "2.02 (4.0)",
        "0.025 (0.05)", "0.200 (0.20)", "10.0 (10)", "1 of 2",
    ]  # fmt: skip


def test_a_row_of_which_a_recording_left_a_question_open_is_no_row(tmp_path: Path) -> None:
    """The finding is the one that the search makes, with the recording's own words."""
    request = ModelRequest(purpose=REFINEMENT_PURPOSE, system="", text="")
    with pytest.raises(UnrecordedError) as missing:
        find_answer(tmp_path, "a", request, 4)
    told = f"the search goes on without the model: model 'recorded/x': {missing.value}"
    model = f"recorded/{tmp_path.name}"
    whole = ProposerRun(model, Proposer.SEARCH, ASSETS, JOINTS, TRACE[TRACE["asset_id"] != "c"], CALLS, FINDINGS)
    columns = "asset_id code joint value limit_value message"
    short = frame(columns, ("a", "refinement_unanswered", None, None, None, told))
    steps = replace(whole, proposer=Proposer.MODEL, findings=pd.concat([FINDINGS, short]))
    table = proposers_table([whole, steps])
    assert [line.split("|")[2].strip() for line in table.splitlines()[2:3]] == ["`search`"]
    assert table.splitlines()[3:] == ["", f"Left out: `{model}` as `model`, whose recordings end early for a."]
    refused = short.assign(message="the search goes on without a step from the model: no number")
    assert "Left out" not in proposers_table([whole, replace(steps, findings=refused)]), "a bad answer is one"


def test_only_what_was_moved_has_a_distance() -> None:
    assert distances(FINDINGS, JOINTS)["slides"].tolist() == [False, True]
    none = distances(FINDINGS[FINDINGS["code"] == "mended"], JOINTS)
    assert none.empty


def test_a_recorded_model_is_run_on_what_it_answered_and_nobody_answers_for_it(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text("{}", encoding="utf-8")
    recorded = f"recorded/{tmp_path}"
    assert answered(recorded, ["a", "b"]) == ["a"] and answered("prior/noisy", ["a", "b"]) == ["a", "b"]
    settings = settings_with(Settings(), recorded, Proposer.MODEL)
    assert settings.search.proposer is Proposer.MODEL and settings.model.model == recorded
    assert model_for(settings.model, REFINEMENT_PURPOSE) == recorded
    assert proposers_of(recorded, ["a"]) == (Proposer.SEARCH,) and proposers_of("prior/noisy", ["a"]) == tuple(Proposer)
    (tmp_path / f"a.{REFINEMENT_PURPOSE}.1.json").write_text("{}", encoding="utf-8")
    assert proposers_of(recorded, ["a"]) == tuple(Proposer) and proposers_of(recorded, ["a", "b"]) == (Proposer.SEARCH,)
    quick = settings_with(Settings(), "prior/noisy@2", None)
    assert model_for(quick.model, REFINEMENT_PURPOSE) == "prior/noisy@2" and not quick.engine.interact


def test_the_page_has_the_blocks_markers() -> None:
    page = (ROOT / "docs/method.md").read_text(encoding="utf-8")
    assert all(marker in page for marker in markers("proposers"))
