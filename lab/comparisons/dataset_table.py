"""The table of whole datasets as one run refined each, from its catalog alone: ``python -m
lab.comparisons.dataset_table PAGE NAME=OUT …``, a column for each run under its name, the first one's nine of the
paper before it."""

import sys
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path

import pandas as pd

from asset2sim.catalog.read import latest_rows, query
from asset2sim.catalog.text import NOTHING, markdown_table
from lab.comparisons.figure_specs import NINE_SUBSET
from lab.comparisons.meaning import met_cells
from lab.comparisons.method_runs import MethodRun
from lab.comparisons.object_rows import asked_joints, drift_passes, oscillation_passes, read_objects
from lab.pages.blocks import Pages
from schemas.errors import DONE, exit_code_of
from schemas.settings import Thresholds
from schemas.vocabulary import Method

BLOCK = "dataset"
"""Name of the page's block."""
EXEMPT = "exempt.sql"
"""The question which objects pass the reset check through an exemption alone."""


def dataset_cells(out: Path, subset: str | None, limits: Thresholds) -> dict[str, str]:
    """Results of one run's objects, or of those of a subset: row heading → text; a dash where nothing was asked or no
    expert chose."""
    assets, measured, expected = latest_rows(out, "assets", "measurements", "expectations")
    assets = assets[assets["subset"] == subset] if subset else assets
    chosen = assets["asset_id"]
    measured, expected = (rows[rows["asset_id"].isin(chosen)] for rows in (measured, expected))
    model = str(assets["model"].iloc[0]) if len(assets) else ""
    objects = read_objects([MethodRun(Method.ASSET2SIM, model, out)], limits)
    objects = objects[objects["asset_id"].isin(chosen)]
    engines = [str(engine) for engine in measured["engine"].unique()]
    count, held = len(assets), int((assets["support"] == "fixed").sum())
    phi, spent = objects["penetration_mm"].dropna(), assets["processor_s_total"].dropna()
    scale, joint = objects["scale_deviation"].dropna(), objects["joint_deviation_rad"].dropna()
    unasked = objects.loc[objects["meaning"].isna(), "alignment"].dropna()
    sizes = met_cells(objects)[0]
    return {
        "objects": str(count),
        f"ok: every test in {', '.join(engines)}": f"**{int((assets['status'] == 'ok').sum())} of {count}**",
        "of these by an exemption of `reset`: slipped as friction could not brake it, toppled by its energy": (
            exempt_text(out, chosen)
        ),
        "called doubtful, since a guess decides something": str(int(assets["doubtful"].notna().sum())),
        "held by a wall or the floor": str(held),
        "size as readers expect it, who wrote it down before any result": sizes,
        "asked joints at rest as they expect them, in every engine": rest_text(expected),
        "Φ at the start, mean and most": f"{phi.mean():.2f} and {phi.max():.2f} mm" if len(phi) else NOTHING,
        "drift within 1 mm and 0.01 rad": by_engine(measured, engines, count, drift_passes(measured, limits)),
        "no joint oscillates": by_engine(measured, engines, count, oscillation_passes(measured)),
        "scale off the experts'": f"{100.0 * scale.mean():.0f} % over {len(scale)}" if len(scale) else NOTHING,
        "first hinge off the experts'": f"{joint.mean():.2f} rad over {len(joint)}" if len(joint) else NOTHING,
        "alignment by our rubric, of those without expectations": (
            f"{100.0 * unasked.mean():.1f} % of {len(unasked)}" if len(unasked) else NOTHING
        ),
        "model calls an object": f"{objects['calls'].mean():.2f}",
        "processor seconds an object: mean, median, most": (
            f"{spent.mean():.1f}, {spent.median():.1f}, {spent.max():.1f}" if len(spent) else NOTHING
        ),
    }


def exempt_text(out: Path, chosen: "pd.Series[str]") -> str:
    """How many of these objects the question of exemptions names: those that slip, and those that topple."""
    found = query(out, resources.files("lab.comparisons").joinpath(EXEMPT).read_text(encoding="utf-8"))
    found = found[found["asset_id"].isin(chosen)]
    slip, topple = int(found["slips"].sum()), int(found["topples"].sum())
    return f"{len(found)} ({slip} slipped, {topple} toppled)"


def rest_text(expected: pd.DataFrame) -> str:
    """Joints that ended as expected of those that must stay at rest, then of all, with those that may swing."""
    joints = asked_joints(expected)
    if joints.empty:
        return NOTHING
    met = joints["met"]
    still = met[~joints["swings"]]
    return f"{int(still.sum())} of {len(still)}; with those that may swing {int(met.sum())} of {len(met)}"


def by_engine(measured: pd.DataFrame, engines: Sequence[str], count: int, passes: "pd.Series[bool]") -> str:
    """How many of all objects pass in each engine, in the engines' order."""
    return f"{', '.join(str(int(passes[measured['engine'] == engine].sum())) for engine in engines)} of {count}"


def dataset_table(outs: Mapping[str, Path], limits: Thresholds) -> str:
    """Markdown: the first run's nine of the paper, where it has them, then each run whole, by its name. Raises
    UsageError for a folder without a run."""
    first = next(iter(outs.values()))
    (assets,) = latest_rows(first, "assets")
    columns: list[tuple[str, Path, str | None]] = [(name, out, None) for name, out in outs.items()]
    if (assets["subset"] == NINE_SUBSET).any():
        columns.insert(0, ("the paper's nine", first, NINE_SUBSET))
    cells = [dataset_cells(out, subset, limits) for _, out, subset in columns]
    rows = [[heading, *(own.get(heading, NOTHING) for own in cells)] for heading in cells[0]]
    return markdown_table(["", *(name for name, _, _ in columns)], rows)


def main(words: Sequence[str]) -> int:
    """Run one command line and return its exit code."""
    page, *named = words

    def make() -> int:
        outs = {name: Path(out) for name, _, out in (word.partition("=") for word in named)}
        Pages[str](BLOCK, {Path(page): str}).write(dataset_table(outs, Thresholds()))
        return DONE

    return exit_code_of("dataset_table", make)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
