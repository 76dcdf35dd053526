"""Reports kept from run to run: taken as they were where all they depend on is as before, and only there."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import pytest

from asset2sim.assets.extract import Extraction
from asset2sim.assets.folder import Folder, write_folder
from asset2sim.assets.hulls import link_hulls
from asset2sim.checks import known_reports
from asset2sim.checks.known_reports import KnownReports, verify_known
from asset2sim.validation.validate import validate
from schemas.interaction import EngineReport
from schemas.overlay import LinkProposal, Overlay, PhysicsOverlay
from schemas.settings import Settings
from schemas.vocabulary import Engine, Source
from tests.assets import NO_VIEWS, joint, link, read, robot, shape, written

GATE = robot(
    link("body", shape("1 1 0.2")),
    link("gate", shape("0.3 0.02 0.2", xyz="0.15 0 0")),
    joint("swing", "revolute", "body", "gate", xyz="0 0 0.3", axis="0 0 1", limit="-1.5 1.5"),
)
HEAVY = Overlay(scale=1.0, links=(LinkProposal(name="body", mass_kg=200.0), LinkProposal(name="gate", mass_kg=1.0)))


class Given(NamedTuple):
    """The arguments that decide a report."""

    folder: Folder
    overlay: PhysicsOverlay
    item: Extraction
    settings: Settings

    def reports(self, known: KnownReports) -> tuple[EngineReport, ...]:
        return verify_known(known, [Engine.PYBULLET], self.folder, self.overlay, self.item, self.settings)


@pytest.fixture(scope="module")
def gate(tmp_path_factory: pytest.TempPathFactory) -> tuple[Given, tuple[EngineReport, ...], bytes]:
    """A gate, its report, and the file in which that is kept."""
    place = tmp_path_factory.mktemp("gate")
    item = read(written(place / "in", GATE))
    overlay, _ = validate(item, HEAVY, Source.MODEL, 0.5, NO_VIEWS.physics)
    hulls = {name: link_hulls(geometry, 1.0) for name, geometry in item.geometry.items()}
    given = Given(write_folder(item, overlay, hulls, place / "out", NO_VIEWS.physics), overlay, item, Settings())
    known = KnownReports(place / "kept.npz")
    found = given.reports(known)
    known.keep()
    return given, found, (place / "kept.npz").read_bytes()


class AskedAnewError(Exception):
    """An engine is asked."""


def ask(*_: object) -> tuple[EngineReport, ...]:
    raise AskedAnewError


@pytest.mark.system
def test_what_is_as_before_is_not_simulated(
    gate: tuple[Given, tuple[EngineReport, ...], bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given, found, kept = gate
    assert found[0].interaction is not None and found[0].interaction.resets and found[0].judged is not None
    (tmp_path / "kept.npz").write_bytes(kept)
    monkeypatch.setattr(known_reports, "verify", lambda engines, *_: ask() if engines else ())
    known = KnownReports(tmp_path / "kept.npz")
    assert given.reports(known) == found and known.seconds == 0.0


def other_version(given: Given, patch: pytest.MonkeyPatch) -> Given:
    patch.setattr(known_reports, "engine_version", lambda _: "another")
    return given


def other_code(given: Given, patch: pytest.MonkeyPatch) -> Given:
    patch.setattr(known_reports, "sources", lambda: "another")
    return given


def other_bound(given: Given, _: pytest.MonkeyPatch) -> Given:
    limits = given.settings.thresholds.model_copy(update={"reset_turn_rad": 0.01})
    return given._replace(settings=given.settings.model_copy(update={"thresholds": limits}))


def other_overlay(given: Given, _: pytest.MonkeyPatch) -> Given:
    return given._replace(overlay=given.overlay.model_copy(update={"contact_friction": 0.6}))


def other_meshes(given: Given, _: pytest.MonkeyPatch) -> Given:
    features = given.item.features.model_copy(update={"content_hash": "another"})
    return given._replace(item=replace(given.item, features=features))


def other_urdf(given: Given, patch: pytest.MonkeyPatch) -> Given:
    text = given.folder.urdf.read_text(encoding="utf-8").replace("0.3", "0.4")
    read_bytes = Path.read_bytes
    patch.setattr(Path, "read_bytes", lambda path: text.encode() if path == given.folder.urdf else read_bytes(path))
    return given


def code_of_others(given: Given, patch: pytest.MonkeyPatch) -> Given:
    patch.setattr(known_reports, "comparable", lambda: False)
    return given


@pytest.mark.system
@pytest.mark.parametrize(
    "change", [other_version, other_code, other_bound, other_overlay, other_meshes, other_urdf, code_of_others]
)
def test_what_differs_in_anything_is(
    gate: tuple[Given, tuple[EngineReport, ...], bytes],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    change: Callable[[Given, pytest.MonkeyPatch], Given],
) -> None:
    given, _, kept = gate
    (tmp_path / "kept.npz").write_bytes(kept)
    monkeypatch.setattr(known_reports, "verify", lambda engines, *_: ask() if engines else ())
    with pytest.raises(AskedAnewError):
        change(given, monkeypatch).reports(KnownReports(tmp_path / "kept.npz"))


@pytest.mark.system
def test_a_damaged_file_is_none_and_reports_of_other_runs_are_dropped(
    gate: tuple[Given, tuple[EngineReport, ...], bytes], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    given, found, kept = gate
    file = tmp_path / "kept.npz"
    file.write_bytes(kept[: len(kept) // 2])
    monkeypatch.setattr(known_reports, "verify", lambda engines, *_: found if engines else ())
    other = KnownReports(file)
    assert other_bound(given, monkeypatch).reports(other) == found
    other.keep()
    monkeypatch.setattr(known_reports, "verify", lambda engines, *_: ask() if engines else ())
    with pytest.raises(AskedAnewError):
        given.reports(KnownReports(file))
    assert other_bound(given, monkeypatch).reports(KnownReports(file)) == found
