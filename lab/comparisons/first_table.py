"""The table to read first: what each model and method makes of the same objects, in stability and in meaning."""

import pandas as pd

from asset2sim.catalog.text import NOTHING, markdown_table
from lab.comparisons.figure_specs import NINE_SUBSET, TABLE_1, TABLE_7
from lab.comparisons.markdown import name_of
from lab.comparisons.meaning import met_cells
from lab.comparisons.method_runs import METHODS, NO_MODEL
from schemas.model_names import described
from schemas.vocabulary import Method

FIRST = "first"
"""Name of the page's block."""
HEADINGS = (
    "method", "model", "ok", "paper's tests", "sizes as expected", "asked joints at the start", "at rest",
    "scale off the experts", "hinge off the experts, rad", "calls an asset",
)  # fmt: skip


def first_table(objects: pd.DataFrame, subset: str | None, engines: str) -> str:
    """Markdown: a row for each method and model of a comparison's objects, then the paper's own figures where the
    objects are the nine of its Table 1. ``engines`` names where the objects were verified."""
    lines: list[list[str]] = []
    models = [str(model) for model in objects["model"].unique()]
    for method in METHODS:
        for model in models:
            own = objects[(objects["method"] == method.value) & (objects["model"] == model)]
            if not own.empty:
                lines.append(_line(method, model, own))
    if subset == NINE_SUBSET:
        lines += [_papers(method) for method in (Method.IVW, Method.DIRECT, Method.ASSET2SIM, Method.NO_SEMANTICS)]
    count = int(objects["asset_id"].nunique())
    said = (
        f"{count} objects, verified in {engines}. *As expected*: by readers of prompt and picture, who wrote it down "
        "before any result (`expectations.csv`); *at rest* counts where joints ended, in every engine."
    )
    return f"{said}\n\n{markdown_table(HEADINGS, lines, right=range(2, len(HEADINGS)))}"


def _line(method: Method, model: str, own: pd.DataFrame) -> list[str]:
    asked = "–" if model == NO_MODEL else described(model)
    cells = met_cells(own) if own["joints_asked"].notna().any() else [NOTHING] * 3
    scale, joint = own["scale_deviation"].dropna(), own["joint_deviation_rad"].dropna()
    return [
        name_of(method, model),
        asked,
        f"{int(own['ok'].sum())} of {len(own)}",
        str(int(own["paper_tests_pass"].sum())),
        *cells[:3],
        f"{100.0 * scale.mean():.0f} % of {len(scale)}" if len(scale) else NOTHING,
        f"{joint.mean():.2f} of {len(joint)}" if len(joint) else NOTHING,
        f"{own['calls'].mean():.2f}",
    ]


def _papers(method: Method) -> list[str]:
    """The paper's own figures for the nine (Table 1) and its calls an asset (Table 7), with the model that it names."""
    stated, calls = TABLE_1[method], TABLE_7.get(method, {}).get("calls")
    scale, joint = f"{stated['scale'].value:.0f} %", f"{stated['joint'].value:.2f}"
    asked = NOTHING if calls is None else f"{calls.value:.2f}"
    return [f"{name_of(method, NO_MODEL)}, the paper", "Gemini 2.5 Flash", *[NOTHING] * 5, scale, joint, asked]
