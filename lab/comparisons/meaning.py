"""Requests and what came of them, by readers' expectations; and where experts do otherwise, object by object."""

from collections.abc import Sequence

import pandas as pd

from asset2sim.catalog.read import latest_rows
from asset2sim.catalog.text import NOTHING, markdown_table
from lab.comparisons.method_runs import MethodRun
from lab.comparisons.object_rows import true_of
from schemas.alignment import SIZE
from schemas.vocabulary import Method

HEADINGS = ("method", "sizes", "asked joints at the start", "asked joints at rest", "of objects")


def met_cells(own: pd.DataFrame) -> list[str]:
    """Sizes and asked joints that are as expected, each "n of N" over these objects, and the number of objects."""
    sizes = own["size_met"].astype("boolean").dropna()
    asked = int(own["joints_asked"].fillna(0).sum())
    cells = [f"{int(sizes.sum())} of {len(sizes)}" if len(sizes) else NOTHING]
    for name in ("joints_met_at_start", "joints_met"):
        cells.append(f"{int(own[name].fillna(0).sum())} of {asked}" if asked else NOTHING)
    return [*cells, str(int(own["joints_asked"].notna().sum()))]


def experts_apart(runs: Sequence[MethodRun]) -> list[dict[str, object]]:
    """Choices of experts that readers of the same words do not accept, from the run of the experts' choices: a row for
    each scale or joint of interest. Empty without such a run, or without expectations."""
    run = next((run for run in runs if run.method is Method.REFERENCE), None)
    if run is None:
        return []
    assets, joints, expected = latest_rows(run.folder, "assets", "joints", "expectations")
    chosen = joints.loc[joints["asked_position"].notna(), ["asset_id", "joint"]]
    asked = set(chosen.itertuples(index=False, name=None)) | {(asset_id, SIZE) for asset_id in assets["asset_id"]}
    rows: list[dict[str, object]] = []
    for row in expected[expected["met_at_start"].notna() & ~true_of(expected["met_at_start"])].to_dict("records"):
        if (row["asset_id"], row["what"]) in asked and not pd.isna(row["start"]):
            kept = ("asset_id", "what", "unit", "start", "lows", "highs", "why")
            rows.append({str(name): row[name] for name in kept})
    return sorted(rows, key=lambda row: (row["what"] != SIZE, str(row["asset_id"])))


def apart_table(rows: Sequence[dict[str, object]]) -> str:
    """The Markdown table of what experts and readers see differently; "" without rows."""
    if not rows:
        return ""
    lines = []
    for row in rows:
        lows, highs = list(row["lows"]), list(row["highs"])  # type: ignore[call-overload]
        ranges = " or ".join(f"{low:.3g} to {high:.3g}" for low, high in zip(lows, highs, strict=True))
        told = [row["asset_id"], row["what"], f"{row['start']:.3g}", ranges, row["unit"], row["why"]]
        lines.append([str(cell) for cell in told])
    headings = ("object", "what", "expert", "readers expect", "unit", "the reader's reason")
    return markdown_table(headings, lines, right=(2,))
