"""Asking again, over real HTTP, of a scripted model with the mistakes of a real one: what it mends, at how many calls.

The 60 objects with expectations; met or not by those, not by the prior whose expectation makes a model doubt. Neither
engines nor the search take part: what the answer comes to is what synthesis and validation make of it.
"""

from collections import Counter
from dataclasses import dataclass
from pathlib import Path

import pytest

from asset2sim.assets.extract import Extraction, extract
from asset2sim.checks.alignment.expectations import Expectations, meet, read_expectations
from asset2sim.models.gateway.ask import ask
from asset2sim.models.gateway.session import open_gateway_session
from asset2sim.runs.dataset import load_dataset
from asset2sim.validation.doubts import fallen
from schemas.alignment import SIZE
from schemas.asset import AssetRef
from schemas.model_names import settings_for
from schemas.overlay import PhysicsOverlay
from schemas.settings import DoubtSettings, ModelSettings, Settings, ViewSettings
from tasks.job import AssetJob
from tasks.synthesize import by_rules, with_users_numbers
from tasks.validate import validate_overlay
from tests.assets import SHARED
from tests.factories import make_record
from tests.mistaken_model import MistakenModel
from tests.scripted_server import scripted

OBJECTS = SHARED / "partnet_mobility"
pytestmark = [
    pytest.mark.system,
    pytest.mark.skipif(not OBJECTS.is_dir(), reason="../shared/partnet_mobility is absent"),
]

CALLS_AN_ASSET = 1.5
LEAST_MENDED = 0.5


@dataclass(frozen=True)
class Answered:
    """What an asset's answer came to, and what it took."""

    overlay: PhysicsOverlay
    wrong: frozenset[str]
    calls: int
    findings: tuple[str, ...]


def answered(ref: AssetRef, expectations: Expectations, settings: Settings, out: Path) -> Answered:
    """One asset through synthesis and validation, asked through the gateway."""
    model = settings_for(settings.model, settings.model.model)
    session = open_gateway_session(out, "run", ref.asset_id, model)
    job = AssetJob(ref, out, settings, lambda request: ask(request, model, session))
    if ref.asset_id not in EXTRACTED:
        EXTRACTED[ref.asset_id] = extract(ref)
    extraction = EXTRACTED[ref.asset_id]
    said = with_users_numbers(by_rules, job, extraction)
    overlay = validate_overlay(job, extraction, said.proposal, rules=True).overlay
    record = make_record(ref.asset_id, ref=ref, overlay=overlay, features=extraction.features, reports=())
    share = settings.search.state_tolerance
    wrong = {joint.name for joint in overlay.joints if fallen(joint, share) is not None}
    for item in expectations[ref.asset_id]:
        if item.what != "none" and meet(record, item).at_start is False:
            wrong.add("scale" if item.what == SIZE else item.what)
        elif item.swings:
            wrong.discard(item.what)
    codes = tuple(finding.code for finding in said.findings)
    return Answered(overlay, frozenset(wrong), len(said.calls), codes)


EXTRACTED: dict[str, Extraction] = {}


def run(refs: list[AssetRef], expectations: Expectations, out: Path, seed: int, **doubt: object) -> (
    tuple[dict[str, Answered], MistakenModel]
):  # fmt: skip
    """Every asset with the mistaken model at a server of its own."""
    model = MistakenModel(expectations, seed=seed)
    with scripted(model) as server:
        settings = Settings(
            # This model does not look at its pictures: small ones are made sooner.
            model=ModelSettings(
                model="openai/scripted", api_base=server.api_base, max_attempts=1, cache=False, image_side_px=64
            ),
            doubt=DoubtSettings.model_validate(doubt),
            views=ViewSettings(width=64, height=64),
        )
        found = {ref.asset_id: answered(ref, expectations, settings, out) for ref in refs}
    assert {name: item.calls for name, item in found.items()} == model.asked
    return found, model


@pytest.fixture(autouse=True)
def no_key(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("OPENAI_API_KEY", raising=False)


def test_asking_again_mends_half_of_the_measured_mistakes(tmp_path: Path) -> None:
    """Of those that units do not mend; a right answer that is doubted may be spoilt, which counts as well."""
    expectations = read_expectations(OBJECTS / "expectations.csv")
    refs = load_dataset(OBJECTS, None, tuple(expectations), None)
    once, model = run(refs, expectations, tmp_path / "once", 0, ask_again=False)
    again, same = run(refs, expectations, tmp_path / "again", 0)
    assert same.planted == model.planted and {item.calls for item in once.values()} == {1}
    shown = [(name, thing) for name, things in model.planted.items() for thing in things if thing in once[name].wrong]
    mended = [(name, thing) for name, thing in shown if thing not in again[name].wrong]
    spoilt = [(name, thing) for name, item in again.items() for thing in item.wrong if thing not in once[name].wrong]
    calls = sum(item.calls for item in again.values()) / len(again)
    kinds = Counter(kind for things in model.planted.values() for kind in things.values())
    left = Counter(model.planted[name][thing] for name, thing in shown)
    fixed = Counter(model.planted[name][thing] for name, thing in mended)
    told = (
        f"planted {dict(kinds)}, shown {dict(left)}, mended {dict(fixed)}, spoilt {spoilt}, {calls:.2f} calls an asset"
    )
    print(told)
    assert "degrees" in kinds and "degrees" not in left, told
    assert len(shown) >= 20 and len(left) == 4, told
    assert len(mended) - len(spoilt) >= LEAST_MENDED * len(shown), told
    assert calls <= CALLS_AN_ASSET, told
    for name, item in again.items():
        assert ("asked_again" in item.findings) == (item.calls == 2), name
