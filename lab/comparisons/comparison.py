"""Output of a comparison: Parquet tables, Markdown, charts, and the page's section."""

import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from lab.comparisons.charts import failure_chart, growth_chart
from lab.comparisons.comparison_rows import failure_rows, figure_rows, growth_rows
from lab.comparisons.figure_specs import COST, LARGE_SUBSET, STABILITY, SUCCESS
from lab.comparisons.first_table import first_table
from lab.comparisons.markdown import (
    agreement_sentences,
    by_model,
    failure_table,
    fewer_objects,
    figure_table,
    meaning_table,
    notes,
    stability_tables,
)
from lab.comparisons.meaning import apart_table
from lab.comparisons.method_runs import MethodRun, slug
from lab.noise.noise_level import NOISY
from lab.pages.blocks import write_block
from schemas.model_names import described
from schemas.table import Row

BLOCK = "compare"
"""Name of the page's block."""
GROWTH_CHART = "growth.png"


@dataclass(frozen=True)
class Comparison:
    """A comparison's rows. ``engines`` names the engines in which the objects were verified, ``apart`` lists what
    experts chose that readers of the same words do not accept."""

    subset: str | None
    engines: str
    objects: pd.DataFrame
    stability: list[Row]
    success: list[Row]
    failures: list[Row]
    cost: list[Row]
    growth: list[Row]
    apart: tuple[dict[str, object], ...] = ()
    shapes: tuple[str, ...] = ()
    """Paragraphs on penetration on the same shapes, where it was measured."""

    @property
    def count(self) -> int:
        """Objects that were compared."""
        return int(self.objects["asset_id"].nunique())


def compare(
    objects: pd.DataFrame, subset: str | None, engines: str, apart: Sequence[dict[str, object]] = ()
) -> Comparison:
    """Every table, from one row per object, method and model."""
    return Comparison(
        subset=subset,
        engines=engines,
        objects=objects,
        stability=figure_rows(objects, STABILITY, subset),
        success=figure_rows(objects, SUCCESS, subset),
        failures=failure_rows(objects),
        cost=figure_rows(objects, COST, subset),
        growth=growth_rows(objects),
        apart=tuple(apart),
    )


def write_comparison(out: Path, runs: Sequence[MethodRun], found: Comparison) -> Path:
    """Write ``tables/*.parquet``, ``charts/*.png`` and ``compare.md`` into OUT; returns the last."""
    tables = out / "tables"
    tables.mkdir(parents=True, exist_ok=True)
    for name in ("objects", "stability", "success", "failures", "cost", "growth"):
        pd.DataFrame(getattr(found, name)).to_parquet(tables / f"{name}.parquet", compression="zstd", index=False)
    charts = write_charts(out / "charts", found)
    parts = ["# Methods compared", first_table(found.objects, found.subset, found.engines)]
    for model in by_model(found.stability):
        parts += model_section(found, model, f"charts/{charts[model].name}")
    if found.growth:
        parts += [
            f"## As the model errs more ({described(NOISY)})",
            f"![Success and scale error by error level](charts/{GROWTH_CHART})",
        ]
    listed = [f"- {run.method.value}, {described(run.label)}: `{run.folder.relative_to(out)}`" for run in runs]
    parts += [*agreement_sentences(found.objects), "Runs:", "\n".join(listed)]
    report = out / "compare.md"
    report.write_text("\n\n".join(parts) + "\n", encoding="utf-8")
    return report


def write_charts(folder: Path, found: Comparison) -> dict[str, Path]:
    """A chart of outcomes for each model, by model, and one of error growth where several levels were run."""
    charts = {}
    for model, rows in by_model(found.failures).items():
        title = f"How {found.count} assets ended: {described(model)}"
        charts[model] = failure_chart(rows, folder / f"failures_{slug(model)}.png", title)
    if found.growth:
        growth_chart(found.growth, folder / GROWTH_CHART, f"As the model errs more: {described(NOISY)}")
    return charts


def model_section(found: Comparison, model: str, chart: str) -> list[str]:
    """One model's tables and chart, by paragraph."""
    about, *others = beside(found, model)
    return [
        f"## {described(model)}",
        about,
        "### Stability and semantics",
        stability_tables(found.stability, model),
        *others,
        "### How assets ended",
        failure_table(found.failures, found.success, model),
        f"![Outcomes of each method with {described(model)}]({chart})",
        "### Cost of an asset",
        figure_table(found.cost, COST, model),
    ]


def beside(found: Comparison, model: str) -> list[str]:
    """The paragraphs beside one model's Table 1: its caption, the large set, the same shapes, and what was meant."""
    about = notes(model, found.subset, found.count, found.engines) + fewer_objects(found.objects)
    return [about, *large_set_section(found, model), *found.shapes, *meaning_section(found, model)]


def large_set_section(found: Comparison, model: str) -> list[str]:
    """Success and stability of the paper's 93 objects that are among others; empty where these alone, or none, are."""
    own = found.objects[found.objects["subset"] == LARGE_SUBSET]
    if found.subset is not None or own.empty:
        return []
    figures = (*SUCCESS, *STABILITY)
    said = f"Of these, the {own['asset_id'].nunique()} that are of the paper's 93:"
    return [said, figure_table(figure_rows(own, figures, LARGE_SUBSET), figures, model)]


def meaning_section(found: Comparison, model: str) -> list[str]:
    """Section on readers' expectations and what came of them, and where experts part from them; empty without
    expectations."""
    table = meaning_table(found.objects, model)
    if not table:
        return []
    said = "As careful readers of prompt and pictures expect, written before any result (`expectations.csv`):"
    parts = [said, table]
    if found.apart:
        parts += ["Where the experts' choice is not what readers of the same words accept:", apart_table(found.apart)]
    return parts


def page_block(found: Comparison, outcomes: str, growth: str = "") -> str:
    """The page's section: Table 1 without the differences, outcomes as a chart, cost, and the growth of errors, with
    the paths of both pictures. Only the first model has tables; the error levels of others are in the growth chart."""
    model = next(iter(by_model(found.stability)))
    about, *others = beside(found, model)
    parts = [
        about,
        figure_table(found.stability, STABILITY, model),
        *others,
        f"![Outcomes of each method with {described(model)}]({outcomes})",
        figure_table(found.cost, COST, model),
    ]
    if growth:
        parts.append(f"![Success and scale error as {described(NOISY)} errs more]({growth})")
    return "\n\n".join([*parts, *agreement_sentences(found.objects)])


def write_page(page: Path, out: Path, found: Comparison) -> None:
    """Put the section between the page's markers, and its pictures beside it."""
    model = next(iter(by_model(found.stability)))
    charts = {f"failures_{slug(model)}.png": "compare_failures.png"}
    charts |= {GROWTH_CHART: "compare_growth.png"} if found.growth else {}
    for chart, picture in charts.items():
        shutil.copyfile(out / "charts" / chart, page.parent / picture)
    write_block(page, BLOCK, page_block(found, *charts.values()))
