"""Penetration of every method's state on the same two shapes: the hulls as authored, and those that ours cut."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pandas as pd

from asset2sim.assets.authored import REFINED_NAME, read_overlay
from asset2sim.assets.folder import URDF_NAME
from asset2sim.baselines.declared_method import known_methods
from asset2sim.catalog.read import latest_rows
from asset2sim.catalog.text import NOTHING, markdown_table
from asset2sim.engines.static_object import phi_at
from lab.comparisons.markdown import name_of
from lab.comparisons.method_runs import NO_MODEL, MethodRun
from schemas.errors import AssetError, UsageError
from schemas.model_names import described
from schemas.overlay import PhysicsOverlay
from schemas.settings import EngineSettings
from schemas.vocabulary import Method

SINGLE = {"103275": "stapler", "102703": "toilet"}
"""The two of the paper's nine whose penetration it names."""
SHAPES = "shapes"
"""Name of the page's block."""
OVERLAP_MM = 0.1
"""Φ from which an object counts as overlapping, mm: a tenth of the verdict's bound."""
SEARCHED = ("line", "perturbation", "grid", "groups", "return")
"""Proposers of the search for joint positions in the table ``trace``."""


@dataclass(frozen=True)
class ShapesRow:
    """One object's Φ with one method's size and state, mm: on hulls as authored, and on those that ours left; NaN where
    there are none."""

    method: Method
    model: str
    asset_id: str
    authored_mm: float
    cut_mm: float


def phi_on_shapes(runs: Sequence[MethodRun], settings: EngineSettings) -> list[ShapesRow]:
    """A row for each refined object of each run. The shapes as authored are those of the first run that leaves hulls as
    they are, the others those of our method with the same model, or its first; without both there are no rows."""
    kept = [run.folder / "assets" for run in runs if not known_methods()[run.method].rules]
    cut = {run.label: run.folder / "assets" for run in runs if run.method is Method.ASSET2SIM}
    found = []
    for run in runs if kept and cut else ():
        by_ours = cut.get(run.label, next(iter(cut.values())))
        for file in sorted((run.folder / "assets").glob(f"*/{REFINED_NAME}")):
            own = read_overlay(file.parent)
            name = file.parent.name
            authored = next((folder for folder in kept if (folder / name / REFINED_NAME).is_file()), kept[0])
            phi = (phi_mm(own, folder / name, settings) for folder in (authored, by_ours))
            found.append(ShapesRow(run.method, run.label, name, *phi))
    return found


def phi_mm(own: PhysicsOverlay, shapes: Path, settings: EngineSettings) -> float:
    """Φ, mm, of an object's size and state with the collision shapes of another folder, which is as large as its own
    overlay says; NaN where that has none, or they cannot be loaded."""
    if not (shapes / REFINED_NAME).is_file():
        return float("nan")
    other = read_overlay(shapes)
    larger = own.scale / other.scale
    slides = {joint.name for joint in other.all_joints if joint.type == "prismatic"}
    positions = {name: at / larger if name in slides else at for name, at in own.initial_positions.items()}
    try:
        return 1e3 * larger * phi_at(shapes / URDF_NAME, positions, settings)
    except AssetError:
        return float("nan")


def shapes_table(rows: Sequence[ShapesRow]) -> str:
    """Markdown: for each method and model the mean Φ and the number of objects that overlap, before and after cutting,
    and the stapler and the toilet of the paper's nine; "" without rows."""
    lines = []
    for method, model in dict.fromkeys((row.method, row.model) for row in rows):
        own = [row for row in rows if (row.method, row.model) == (method, model)]
        both = [row for row in own if np.isfinite([row.authored_mm, row.cut_mm]).all()]
        single = {row.asset_id: f"{row.authored_mm:.2f}; {row.cut_mm:.2f}" for row in both}
        named = [name_of(method, model), NOTHING if model == NO_MODEL else described(model)]
        cells = [] if both else [NOTHING] * 4
        for values in ([row.authored_mm for row in both], [row.cut_mm for row in both]) if both else ():
            cells += [f"{np.mean(values):.2f}", str(sum(value > OVERLAP_MM for value in values))]
        lines.append([*named, str(len(both)), *cells, *(single.get(asset_id, NOTHING) for asset_id in SINGLE)])
    headings = ("method", "model", "objects", "Φ mm, hulls as authored", "overlap", "Φ mm, hulls as ours cut them")
    return markdown_table((*headings, "overlap", *SINGLE.values()), lines, right=range(2, 9)) if rows else ""


def done_by(run: MethodRun) -> str:
    """One sentence on what brought Φ down in a run of our method: hulls, the search for a state, or a model's steps."""
    assets, findings, trace = latest_rows(run.folder, "assets", "findings", "trace")
    return done_sentence(run.label, len(assets), findings, trace)


def done_sentence(model: str, count: int, findings: pd.DataFrame, trace: pd.DataFrame) -> str:
    """The sentence of ``done_by`` from the tables of a run over so many objects."""
    cut = findings[findings["code"] == "collision_cut"]
    shares = [int(found[1]) for text in cut["message"] if (found := re.search(r"\((\d+)% of a hull\)", text))]
    steps = trace[trace["accepted"] & (trace["phi_after_mm"] < trace["phi_before_mm"])]
    searched = steps[steps["proposer"].isin(SEARCHED)]
    modelled = steps[steps["proposer"] == "model"]
    return (
        f"What brought Φ of ours down with {described(model)}: of {count} objects hulls were cut on "
        f"{cut['asset_id'].nunique()} (by up to {max(shares, default=0)} % of a hull), a step of the joints was "
        f"accepted on {searched['asset_id'].nunique()}, a model's step on {modelled['asset_id'].nunique()}."
    )


def shapes_section(runs: Sequence[MethodRun], settings: EngineSettings) -> tuple[str, ...]:
    """Table and sentence, with what they are; nothing without our run and one that leaves hulls as they are."""
    rows = phi_on_shapes(runs, settings)
    if not rows:
        return ()
    ours = [run for run in runs if run.method is Method.ASSET2SIM]
    said = (
        "Φ of each method's size and state on the same shapes, in PyBullet: hulls as authored, and as ours cut them "
        f"with the same model ({described(ours[0].label)} where none was asked); *overlap* counts objects over "
        f"{OVERLAP_MM:g} mm; stapler and toilet of the paper's nine: before; after."
    )
    return said, shapes_table(rows), " ".join(done_by(run) for run in ours)


def shapes_block(paragraphs: Sequence[str]) -> str:
    """The page's block. Raises UsageError without our run and one that leaves hulls as they are."""
    if not paragraphs:
        raise UsageError("Φ on the same shapes needs asset2sim, and direct, ivw, agent or reference, among --methods")
    return "\n\n".join(paragraphs)
