"""Penetration of every method's state on the same shapes: by size and by state, and what brought it down."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from asset2sim.assets.authored import read_overlay
from lab.comparisons.method_runs import NO_MODEL, MethodRun
from lab.comparisons.shapes import ShapesRow, done_sentence, phi_mm, phi_on_shapes, shapes_table
from schemas.model_names import described
from schemas.overlay import PhysicsOverlay
from schemas.settings import EngineSettings
from schemas.vocabulary import Method
from tests.assets import sample
from tests.methods_runs import run, settings_of

SETTINGS = EngineSettings()
NOISY = described("prior/noisy")


def overlay_in(folder: Path) -> PhysicsOverlay:
    return read_overlay(folder)


@pytest.mark.system
def test_a_seat_pressed_into_its_bowl_overlaps_in_proportion_to_the_size(tmp_path: Path) -> None:
    """The seat is turned 0.3 rad through its stop into what is below the lid; twice as large it is twice as deep."""
    run(sample("toilet_white"), tmp_path, settings_of(Method.DIRECT))
    folder = tmp_path / "assets" / "toilet_white"
    own = overlay_in(folder)
    joints = [
        joint.model_copy(update={"initial_position": joint.closed - 0.3}) if joint.name == "joint_1" else joint
        for joint in own.joints
    ]
    pressed = own.model_copy(update={"joints": tuple(joints)})
    large = pressed.model_copy(update={"scale": 2.0 * own.scale})
    once, twice = phi_mm(pressed, folder, SETTINGS), phi_mm(large, folder, SETTINGS)
    assert once > 1.0 and twice == pytest.approx(2.0 * once)
    assert np.isnan(phi_mm(own, tmp_path / "nothing", SETTINGS))


@pytest.mark.system
def test_every_method_stands_on_the_shapes_as_they_came_and_as_ours_left_them(tmp_path: Path) -> None:
    runs = [
        MethodRun(method, "prior/household", tmp_path / method.value) for method in (Method.DIRECT, Method.ASSET2SIM)
    ]
    for item in runs:
        run(sample("toilet_white"), item.folder, settings_of(item.method))
    rows = phi_on_shapes(runs, SETTINGS)
    assert [(row.method, row.asset_id) for row in rows] == [(item.method, "toilet_white") for item in runs]
    ours = rows[1]
    assert ours.cut_mm <= 0.1 and ours.cut_mm <= ours.authored_mm
    assert phi_on_shapes(runs[:1], SETTINGS) == []
    other = MethodRun(Method.DIRECT, "recorded/answers", runs[0].folder)
    (borrowed, *_) = phi_on_shapes([other, runs[1]], SETTINGS)
    assert borrowed.cut_mm == rows[0].cut_mm, "no run of ours with its model: the first one's hulls"
    none = MethodRun(Method.ASSET2SIM, "recorded/answers", tmp_path / "none")
    assert np.isnan(phi_on_shapes([other, runs[1], none], SETTINGS)[0].cut_mm), (
        "its own model's, which has no such object"
    )
    assert "| toilet |" in shapes_table(rows) and shapes_table([]) == ""


def test_the_table_counts_what_overlaps_and_names_stapler_and_toilet() -> None:
    nan = float("nan")
    rows = [
        ShapesRow(Method.DIRECT, "prior/noisy", "103275", 4.0, 1.0),
        ShapesRow(Method.DIRECT, "prior/noisy", "7236", 0.0, 0.0),
        ShapesRow(Method.DIRECT, "prior/noisy", "9912", 5.0, nan),
        ShapesRow(Method.IVW, "prior/noisy", "9912", nan, nan),
        ShapesRow(Method.IVW, "recorded/answers", "9912", 0.2, 0.0),
        ShapesRow(Method.REFERENCE, NO_MODEL, "9912", 0.0, 0.0),
    ]
    lines = shapes_table(rows).splitlines()
    assert lines[2] == f"| direct VLM | {NOISY} | 2 | 2.00 | 1 | 0.50 | 1 | 4.00; 1.00 | – |"
    assert lines[3] == f"| VLM-IVW | {NOISY} | 0 | – | – | – | – | – | – |"
    assert lines[4:] == [
        "| VLM-IVW | recorded/answers | 1 | 0.20 | 1 | 0.00 | 0 | – | – |",
        "| human reference | – | 1 | 0.00 | 0 | 0.00 | 0 | – | – |",
    ]


def test_what_brought_it_down_is_counted_by_objects() -> None:
    findings = pd.DataFrame(
        {
            "asset_id": ["1", "1", "2", "3"],
            "code": ["collision_cut", "collision_cut", "collision_cut", "state_moved"],
            "message": ["cut by up to 2 mm (12% of a hull)", "(50% of a hull)", "(7% of a hull)", "(90% of a hull)"],
        }
    )
    trace = pd.DataFrame(
        [
            ("1", "request", True, 5.0, 5.0), ("1", "line", True, 5.0, 1.0), ("2", "line", False, 5.0, 6.0),
            ("3", "model", True, 4.0, 4.0), ("3", "grid", True, 4.0, 2.0), ("3", "line", True, 2.0, 1.0),
        ],
        columns=["asset_id", "proposer", "accepted", "phi_before_mm", "phi_after_mm"],
    )  # fmt: skip
    said = done_sentence("prior/noisy", 9, findings, trace)
    assert said.startswith(f"What brought Φ of ours down with {NOISY}: ")
    assert "of 9 objects hulls were cut on 2 (by up to 50 % of a hull)" in said
    assert "joints was accepted on 2, a model's step on 0." in said
