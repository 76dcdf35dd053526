"""``prefect.yaml``: what it deploys exists, takes the parameters it gives, and keeps the schedule of the catalog."""

import sys
from typing import Any

import pytest
import yaml
from prefect.cli.deploy._models import PrefectYamlModel
from prefect.client.schemas.objects import ConcurrencyLimitStrategy
from prefect.flows import Flow, load_flow_from_entrypoint

from flows.schedule import nightly_schedule
from flows.server.client import ONE_AT_A_TIME
from schemas.settings import Settings
from tests.assets import ROOT


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
