"""Every method is run, from the same extraction, and only ours mends what an asset states."""

from pathlib import Path

import pytest

from asset2sim.baselines.declared_method import known_methods
from schemas.vocabulary import FailureMode, Method
from tests.assets import prior, sample
from tests.methods_runs import run, settings_of

pytestmark = pytest.mark.system

CALLS = {
    Method.ASSET2SIM: 1, Method.DIRECT: 1, Method.IVW: 10, Method.REFERENCE: 0, Method.NO_SEMANTICS: 1, Method.RAW: 0,
    Method.CONSTANT: 0,
}  # fmt: skip
"""Model calls for an object that nothing is wrong with; an agent makes as many as it likes."""


def test_no_method_is_forgotten() -> None:
    assert set(known_methods()) == set(Method) == {*CALLS, Method.AGENT}


@pytest.mark.parametrize("method", list(Method))
def test_every_method_leaves_its_record_and_its_folder(tmp_path: Path, method: Method) -> None:
    record, requests = run(sample("laptop_silver"), tmp_path, settings_of(method, queries=2))
    assert record.method is method and record.features is not None
    assert len(requests) == len(record.calls) == CALLS.get(method, len(requests))
    if method is Method.REFERENCE:  # the sample dataset has no expert
        assert record.failure_mode is FailureMode.NO_VALID_ESTIMATE
        return
    assert record.overlay is not None and record.reports and record.measurement is not None
    folder = tmp_path / "assets" / "laptop_silver"
    written = {path.name for path in folder.iterdir()} if folder.exists() else set()
    wanted = set() if method is Method.RAW else {"mobility.urdf", "overlay.json", "measurement.json"}
    assert wanted <= written and bool(wanted) == bool(written)


def test_the_trivial_baseline_is_blind_to_object_and_words(tmp_path: Path) -> None:
    """The same scale and share open whatever is asked, and no model for any of it."""
    for asset_id, words in (("laptop_silver", "a laptop 3 m wide, fully open"), ("box_wooden", "closed")):
        ref = sample(asset_id).model_copy(update={"prompt": words})
        record, requests = run(ref, tmp_path, settings_of(Method.CONSTANT))
        assert requests == [] and record.overlay is not None and record.overlay.scale == 0.2
        for joint in record.overlay.joints:
            expected = joint.closed + 0.1 * (joint.open - joint.closed)
            assert joint.initial_position == pytest.approx(expected, abs=0.05), joint.name
            assert joint.damping > 0.0, "our rules complete it"


@pytest.mark.parametrize("method", [Method.DIRECT, Method.IVW, Method.ASSET2SIM])
def test_inverted_limits_are_mended_by_ours_alone(tmp_path: Path, method: Method) -> None:
    record, _ = run(sample("planted_inverted_limits"), tmp_path, settings_of(method, queries=1), prior)
    assert record.overlay is not None
    joint = next(item for item in record.overlay.joints if item.name == "joint_0")
    assert joint.lower is not None and joint.upper is not None
    assert (joint.lower < joint.upper) == (method is Method.ASSET2SIM)
