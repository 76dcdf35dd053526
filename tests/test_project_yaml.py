"""``catalog.yaml`` opens with intake: every table, as ``read_table`` gives it, from a folder or its address."""

import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
import yaml
from prefect.cli.deploy._models import PrefectYamlModel
from prefect.client.schemas.objects import ConcurrencyLimitStrategy
from prefect.flows import Flow, load_flow_from_entrypoint

from asset2sim.catalog.failures import Review
from asset2sim.catalog.own_files import OwnFile
from asset2sim.catalog.read import read_table
from asset2sim.catalog.write import write_run
from flows.schedule import nightly_schedule
from flows.server.client import ONE_AT_A_TIME
from schemas.settings import Settings
from schemas.tables import PUBLISHED, REVIEWS
from schemas.vocabulary import FailureMode
from tests.assets import ROOT
from tests.factories import MODEL, make_expected, make_failure, make_record
from tests.test_catalog_history import night

intake = pytest.importorskip("intake", reason="intake is not installed: it comes with the extra dev")
FILE = Path(__file__).resolve().parents[1] / "catalog.yaml"


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Three nights in two months, and a review; the folder has a space in its name."""
    folder = tmp_path_factory.mktemp("my out")
    write_run(folder, night(29), [make_record("a", expected=(make_expected(),)), make_record("b")])
    write_run(folder, night(30), [make_record("a"), make_failure("b", FailureMode.MISSING_MESH)])
    write_run(folder, night(1, 12), [make_record("b", expected=(make_expected(),))])
    OwnFile(folder, REVIEWS).add(
        [Review("r", "b", "asset2sim", MODEL, datetime(2026, 12, 1, tzinfo=UTC), "ann", "bad", "sticks").row]
    )
    return folder


def opened(out: str, name: str) -> pd.DataFrame:
    found: pd.DataFrame = intake.open_catalog(str(FILE))(out=out)[name].read()
    return found


def as_text(frame: pd.DataFrame, columns: list[str]) -> list[tuple[str, ...]]:
    """The rows, in no order, with nulls of all kinds alike and numbers as such."""
    cells = frame[columns].astype(object).where(frame[columns].notna(), None)
    numbers = cells.map(lambda value: list(value) if hasattr(value, "tolist") and hasattr(value, "__len__") else value)
    plain = numbers.map(lambda value: float(value) if isinstance(value, (int, float)) else value)
    return sorted(tuple(map(str, row)) for row in plain.itertuples(index=False, name=None))


@pytest.mark.parametrize("name", PUBLISHED)
def test_every_table_opens_and_is_what_read_table_gives(out: Path, name: str) -> None:
    found, expected = opened(str(out), name), read_table(out, name)
    columns = PUBLISHED[name].schema.names
    assert [column for column in found.columns if column != "month"] == columns
    assert len(expected) > 0 and as_text(found, columns) == as_text(expected, columns)
    assert as_text(opened(out.as_uri(), name), columns) == as_text(expected, columns)


def test_the_history_holds_the_nights_of_all_months(out: Path) -> None:
    rows = opened(str(out), "asset_history")
    assert rows.groupby(rows["month"].astype(str))["run_id"].nunique().to_dict() == {"2026-11": 2, "2026-12": 1}


def test_without_out_it_is_the_folder_of_make_flow(out: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "refined").symlink_to(out)
    monkeypatch.chdir(tmp_path)
    assert len(intake.open_catalog(str(FILE))["assets"].read()) == 2


@pytest.fixture(scope="module")
def content() -> dict[str, Any]:
    found: dict[str, Any] = yaml.safe_load((ROOT / "prefect.yaml").read_text(encoding="utf-8"))
    return found


def test_prefect_takes_the_file(content: dict[str, Any]) -> None:
    model = PrefectYamlModel.model_validate(content)
    assert [deployment.name for deployment in model.deployments] == ["nightly"]


def test_the_entrypoint_is_a_flow_that_takes_the_parameters(
    content: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(ROOT)
    # Prefect puts the file's folder on the path and the file among the modules, and leaves them there.
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.setitem(sys.modules, "nightly", sys)
    (deployment,) = content["deployments"]
    found: Flow[..., Any] = load_flow_from_entrypoint(deployment["entrypoint"])
    assert found.name == "nightly"
    parameters = found.validate_parameters(deployment["parameters"])
    assert isinstance(parameters["settings"], Settings) and parameters["settings"].run.workers == 2
    assert (ROOT / parameters["data"] / "manifest.csv").is_file()


def test_the_schedule_and_the_limit_are_those_of_make_nightly(content: dict[str, Any]) -> None:
    (deployment,) = content["deployments"]
    (schedule,) = deployment["schedules"]
    assert (schedule["cron"], schedule["timezone"]) == nightly_schedule(ROOT / "catalog.yaml")
    limit = deployment["concurrency_limit"]
    assert limit["limit"] == ONE_AT_A_TIME.limit == 1
    assert ConcurrencyLimitStrategy(limit["collision_strategy"]) is ONE_AT_A_TIME.collision_strategy
