"""Asking again, over real HTTP, of a scripted model with the mistakes of a real one: what it mends, at how many calls.

The 60 objects with expectations; met or not by those, not by the prior whose expectation makes a model doubt. Neither
engines nor the search take part: what the answer comes to is what synthesis and validation make of it.
"""

import pkgutil
from collections import Counter
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from asset2sim.assets.extract import Extraction
from asset2sim.baselines.ours import by_rules
from asset2sim.checks.alignment.expectations import Expectations, met_expectation, read_expectations
from asset2sim.intake.dataset import load_dataset
from asset2sim.intake.origin import extract
from asset2sim.models.gateway.ask import ask
from asset2sim.models.gateway.session import open_gateway_session
from asset2sim.validation.doubts import where_gravity_takes
from schemas.alignment import SIZE
from schemas.asset import AssetRef
from schemas.model_names import settings_for
from schemas.overlay import PhysicsOverlay
from schemas.request import LabelledImage
from schemas.settings import DoubtSettings, ModelSettings, Settings, ViewSettings
from tasks.progress import AssetJob
from tasks.synthesize import with_users_numbers
from tasks.validate import validate_overlay
from tests.factories import guidance_of, make_record
from tests.marks import OBJECTS, needs_objects
from tests.mistaken_model import MistakenModel
from tests.scripted_server import ScriptedServer, scripted

pytestmark = [pytest.mark.system, needs_objects, pytest.mark.usefixtures("no_keys")]

CALLS_AN_ASSET = 1.5
LEAST_MENDED = 0.5


@dataclass(frozen=True)
class Answered:
    """What an asset's answer came to, and what it took."""

    overlay: PhysicsOverlay
    wrong: frozenset[str]
    calls: int
    findings: tuple[str, ...]


def answered(
    ref: AssetRef, extraction: Extraction, expectations: Expectations, settings: Settings, out: Path
) -> Answered:
    """One asset through synthesis and validation, asked through the gateway."""
    model = settings_for(settings.model, settings.model.model)
    session = open_gateway_session(out, "run", ref.asset_id, model)
    job = AssetJob(
        ref, out, settings, lambda request: ask(request, model, session), guidance_of(ref.prompt, extraction.features)
    )
    said = with_users_numbers(by_rules, job, extraction)
    overlay = validate_overlay(job, extraction, said.proposal, rules=True).overlay
    record = make_record(ref.asset_id, ref=ref, overlay=overlay, features=extraction.features, reports=())
    share = settings.search.state_tolerance
    wrong = {joint.name for joint in overlay.joints if where_gravity_takes(joint, share) is not None}
    for item in expectations[ref.asset_id]:
        if item.what != "none" and met_expectation(record, item).at_start is False:
            wrong.add("scale" if item.what == SIZE else item.what)
        elif item.swings:
            wrong.discard(item.what)
    codes = tuple(finding.code for finding in said.findings)
    return Answered(overlay, frozenset(wrong), len(said.calls), codes)


def run(refs: list[AssetRef], expectations: Expectations, folder: Path, ways: Mapping[str, Mapping[str, object]]) -> (
    tuple[dict[str, dict[str, Answered]], dict[str, MistakenModel]]
):  # fmt: skip
    """Every asset in each way of doubting, each way with the mistaken model at a server of its own. An object's meshes
    are read once for all ways, and let go before the next object's. One that needs a single question in the first way
    comes to the same in the others."""
    models = {name: MistakenModel(expectations, seed=0) for name in ways}
    found: dict[str, dict[str, Answered]] = {name: {} for name in ways}
    with ExitStack() as servers:
        settings = {
            name: settings_of(servers.enter_context(scripted(models[name])), doubt) for name, doubt in ways.items()
        }
        for ref in refs:
            extraction = extract(ref)
            for name in ways:
                known = next((items[ref.asset_id] for items in found.values() if ref.asset_id in items), None)
                if known is None or known.calls > 1:
                    known = answered(ref, extraction, expectations, settings[name], folder / name)
                found[name][ref.asset_id] = known
    for name, model in models.items():
        assert {asset_id: found[name][asset_id].calls for asset_id in model.asked} == model.asked
    return found, models


def settings_of(server: ScriptedServer, doubt: Mapping[str, object]) -> Settings:
    return Settings(
        # This model does not look at its pictures: small ones are made sooner.
        model=ModelSettings(
            model="openai/scripted", api_base=server.api_base, max_attempts=1, cache=False, image_side_px=64
        ),
        doubt=DoubtSettings.model_validate(doubt),
        views=ViewSettings(width=64, height=64),
    )


@pytest.fixture(autouse=True)
def drawn_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The scripted model does not look: the pictures of the first object stand for those of all. Drawing them was half
    of the work here, and PyBullet keeps some 30 MB of every drawing until the process ends."""
    for place in ("asset2sim.baselines.ours.question_pictures", "asset2sim.validation.reconsider.answer_pictures"):
        monkeypatch.setattr(place, drawn_first(pkgutil.resolve_name(place)))


def drawn_first(draw: Callable[..., tuple[LabelledImage, ...]]) -> Callable[..., tuple[LabelledImage, ...]]:
    """A function that returns the first pictures which ``draw`` makes, whatever it is asked for later."""
    kept: list[LabelledImage] = []

    def pictures(*given: Any, **named: Any) -> tuple[LabelledImage, ...]:
        kept[:] = kept or draw(*given, **named)
        return tuple(kept)

    return pictures


def test_asking_again_mends_half_of_the_measured_mistakes(tmp_path: Path) -> None:
    """Of those that units do not mend; a right answer that is doubted may be spoilt, which counts as well."""
    expectations = read_expectations(OBJECTS / "expectations.csv")
    refs = load_dataset(OBJECTS, None, tuple(expectations), None)
    found, models = run(refs, expectations, tmp_path, {"again": {}, "once": {"ask_again": False}})
    once, again, model, same = found["once"], found["again"], models["again"], models["once"]
    assert same.planted == {name: model.planted[name] for name in same.planted}
    assert same.planted.keys() == {name for name, item in again.items() if item.calls > 1}
    assert {item.calls for item in once.values()} == {1}
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
