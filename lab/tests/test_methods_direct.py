"""Direct VLM: one answer to five views, written and judged as it is."""

import json
from pathlib import Path

import pytest

from asset2sim.assets.authored import read_overlay
from asset2sim.guidance.object_info import ObjectInfo, read_prompt
from asset2sim.models.prior.answer import prior_overlay
from asset2sim.models.prompts import overlay_request
from asset2sim.physics.paper_ranges import HINGE
from asset2sim.render import VIEW_NAMES
from lab.methods.final_numbers import BARE_KG, final_overlay
from schemas.overlay import Overlay
from schemas.request import ModelAnswer, ModelRequest
from schemas.vocabulary import FailureMode, Method, Severity, Source, Stage, Status
from tests.assets import RAW, fingerprint, near, prior, sample, saying
from tests.factories import make_features
from tests.methods_runs import LOOKING, run, settings_of

DIRECT = settings_of(Method.DIRECT)


def told(asset_id: str = "7", guidance: str = "a small steel box") -> tuple[ObjectInfo, str]:
    request = overlay_request("direct", make_features(asset_id), guidance)
    information, words = read_prompt(request.text)
    return ObjectInfo.from_json(information), words


def final(info: ObjectInfo, guidance: str, with_sigmas: bool) -> Overlay:
    return final_overlay(info, prior_overlay(info, guidance), with_sigmas)


@pytest.mark.system
def test_one_call_and_its_numbers_are_what_is_written(tmp_path: Path) -> None:
    before = fingerprint(RAW / "Laptop" / "laptop_silver")
    record, (request,) = run(sample("laptop_silver"), tmp_path, DIRECT)
    assert record.status is Status.OK and record.method is Method.DIRECT and len(record.calls) == 1
    assert request.purpose == "direct" and request.images == () and request.answer_schema is not None
    answer = Overlay.model_validate_json(prior(request).content or "")
    assert record.overlay is not None and record.overlay.scale == answer.scale
    masses = {link.name: link.mass_kg for link in answer.links}
    assert {link.name: link.mass_kg for link in record.overlay.links} == masses
    terms = {joint.name: (joint.damping, joint.friction, joint.stiffness) for joint in answer.joints}
    assert {j.name: (j.damping, j.friction, j.stiffness) for j in record.overlay.joints} == terms
    folder = tmp_path / "assets" / "laptop_silver"
    assert read_overlay(folder) == record.overlay
    assert json.loads((folder / "measurement.json").read_bytes()) and not (folder / "collision").exists()
    assert set(record.seconds) == {stage.value for stage in Stage if stage is not Stage.REFINE} and record.trace == ()
    assert fingerprint(RAW / "Laptop" / "laptop_silver") == before


@pytest.mark.system
def test_a_model_that_looks_is_shown_the_same_pictures_and_overlaps_by_every_method(tmp_path: Path) -> None:
    asked = {}
    for method in (Method.DIRECT, Method.ASSET2SIM, Method.IVW, Method.AGENT):
        settings = settings_of(method, LOOKING, queries=1)
        record, requests = run(sample("laptop_silver"), tmp_path / method.value, settings, saying({"scale": 0.2}))
        asked[method] = requests
    ours = {image.label: image.png for image in asked[Method.ASSET2SIM][0].images}
    assert {"perspective", "front", "left", "back", "parts"} <= set(ours)
    for method in (Method.DIRECT, Method.AGENT):
        assert {image.label: image.png for image in asked[method][0].images} == ours, method
    for request, view in zip(asked[Method.IVW], VIEW_NAMES, strict=True):
        shown = {image.label: image.png for image in request.images}
        assert shown.pop(view) == ours.get(view, shown) or view == "right", "its one view of the looks"
        assert shown == {label: png for label, png in ours.items() if label not in VIEW_NAMES}
    texts = {json.dumps({**read_prompt(own[0].text)[0], "purpose": "", "view": ""}) for own in asked.values()}
    assert len(texts) == 1
    record, _ = run(sample("laptop_silver"), tmp_path, settings_of(Method.DIRECT, LOOKING), saying({"scale": 0.2}))
    assert record.overlay is not None and record.overlay.scale_source is Source.MODEL
    assert record.model == "openai/scripted"


@pytest.mark.system
def test_nothing_is_bounded_mended_or_refined(tmp_path: Path) -> None:
    wild = {
        "scale": 0.2, "joints": [{"name": "joint_0", "damping": 1e6, "friction": 0.0, "stiffness": 1e6}],
        "initial_joint_positions": {"joint_0": 40.0}, "asked": ["joint_0"],
    }  # fmt: skip
    record, _ = run(sample("box_wooden"), tmp_path, DIRECT, saying(wild))
    (joint,) = record.overlay.joints if record.overlay is not None else ()
    assert (joint.damping, joint.stiffness, joint.initial_position) == (1e6, 1e6, 40.0)
    assert record.status is Status.FAILED and record.failure_mode is not FailureMode.NO_VALID_ESTIMATE
    assert (tmp_path / "assets" / "box_wooden" / "mobility.urdf").is_file(), "what failed can be looked at"


@pytest.mark.system
def test_an_answer_that_cannot_be_read_is_asked_for_once_more(tmp_path: Path) -> None:
    replies = iter(["no idea", '{"scale": 0.2}'])
    record, requests = run(
        sample("laptop_silver"), tmp_path, DIRECT, lambda request: ModelAnswer(content=next(replies), calls=())
    )
    assert len(requests) == 2 and "<validation_errors>" in requests[1].text
    assert [call.outcome for call in record.calls] == ["invalid_answer", "ok"]
    assert record.overlay is not None and record.overlay.scale == 0.2


@pytest.mark.parametrize(
    ("answer", "mode", "calls"),
    [
        (ModelAnswer(content='{"scale": -1}', calls=()), FailureMode.NO_VALID_ESTIMATE, 2),
        (ModelAnswer(content=None, calls=(), error="HTTP 500"), FailureMode.MODEL_ERROR, 1),
        (ModelAnswer(content=None, calls=(), error="5 calls", budget_spent=True), FailureMode.BUDGET, 1),
    ],
)
def test_no_answer_ends_in_its_row(tmp_path: Path, answer: ModelAnswer, mode: FailureMode, calls: int) -> None:
    record, _ = run(sample("laptop_silver"), tmp_path, DIRECT, lambda request: answer)
    assert record.failure_mode is mode and len(record.calls) == calls
    assert record.overlay is None and not (tmp_path / "assets").exists()


@pytest.mark.system
def test_images_that_were_not_sent_are_told(tmp_path: Path) -> None:
    def blind(request: ModelRequest) -> ModelAnswer:
        return prior(request).model_copy(update={"without_images": "it takes text alone"})

    for method in (Method.DIRECT, Method.ASSET2SIM, Method.IVW):
        record, _ = run(sample("laptop_silver"), tmp_path, settings_of(method, queries=1), blind)
        (finding,) = [item for item in record.findings if item.code == "images_not_sent"]
        assert finding.severity is Severity.WARNING and "text alone" in finding.message


def test_the_prior_gives_final_numbers_for_everything() -> None:
    info, words = told()
    proposal = final(info, words, with_sigmas=False)
    assert {link.name for link in proposal.links} == {link.name for link in info.links}
    assert all(link.mass_kg and link.inertia and link.density_kg_m3 is None for link in proposal.links)
    hinge = next(joint for joint in proposal.joints if joint.name == "hinge")
    assert HINGE.damping.low <= (hinge.damping or 0.0) <= HINGE.damping.high
    assert HINGE.friction.low <= (hinge.friction or 0.0) <= HINGE.friction.high
    assert hinge.stiffness == 0.0 and hinge.coast_s is None and proposal.sigmas == {}


def test_the_priors_masses_are_those_of_its_other_answer() -> None:
    request = overlay_request("synthesis", make_features("7"), "a small steel box")
    felt = Overlay.model_validate_json(prior(request).content or "")
    finals = final(*told(), with_sigmas=False)
    assert finals.scale == felt.scale and finals.initial_joint_positions == felt.initial_joint_positions
    for link, same in zip(felt.links, finals.links, strict=True):
        wanted = 1e-3 * (link.density_kg_m3 or 0.0) * (link.hollow_factor or 0.0) * felt.scale**3
        assert near(same.mass_kg, wanted, 1e-3) and same.material == link.material


def test_the_priors_sigmas_are_positive_and_of_numbers_that_it_states() -> None:
    proposal = final(*told(guidance="a small box, hinge half open"), with_sigmas=True)
    stated = {f"links.{link.name}.{field}" for link in proposal.links for field in ("mass_kg", "inertia")}
    stated |= {f"joints.{joint.name}.{field}" for joint in proposal.joints for field in ("damping", "friction")}
    stated |= {f"initial_joint_positions.{name}" for name in proposal.initial_joint_positions}
    assert proposal.initial_joint_positions and set(proposal.sigmas) == {"scale"} | stated
    assert min(proposal.sigmas.values()) > 0.0


def test_the_prior_bears_an_object_of_which_nothing_is_known() -> None:
    assert final(ObjectInfo.from_json({}), "", with_sigmas=True).scale > 0.0
    bare = ObjectInfo.from_json({"links": [{"name": "base"}]})
    (link,) = final(bare, "", with_sigmas=True).links
    assert link.mass_kg == BARE_KG and min(link.inertia or (0.0,)) >= 0.0 and (link.inertia or (0.0,))[0] > 0.0
