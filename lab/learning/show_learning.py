"""Results of learning, for people: tables for the terminal and for the documentation, and a picture of the curves."""

import math
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path

import numpy as np
import pandas as pd
from rich.console import RenderableType

from asset2sim.catalog.text import markdown_table, titled_table
from lab.trials.figures import methods_of

COLORS = {"asset2sim": "#2f7d5b", "reference": "#c8553d", "ivw": "#4c6fa5", "direct": "#8a8a8a"}
OTHER = "#6b6b6b"
GUARDS = {
    "solved_at_start": "solved at start", "drifted": "drifted", "moved_untouched": "moved untouched",
    "struck": "struck", "spring_did_it": "spring did it", "displaced": "tipped or shoved",
}  # fmt: skip


def described(rows: pd.DataFrame) -> list[RenderableType]:
    """A table of the success of each task and method, and of how it came about."""
    table = titled_table("\nSuccess over rollouts, mean over seeds")
    methods = methods_of(rows)
    for heading in ("task", *methods):
        table.add_column(heading, overflow="fold")
    for task, asset_id in tasks_of(rows):
        table.add_row(f"{task}, {asset_id}", *(cell(of(rows, task, asset_id, method)) for method in methods))
    return [table]


def learning_block(rows: pd.DataFrame, published: pd.DataFrame | None) -> str:
    """Tasks and methods as Markdown, beside what the paper publishes of the same objects where that is given; the last
    line is the mean over the tasks of a method."""
    methods = methods_of(rows)
    headings, lines, whole = ["task"], list[list[str]](), ["mean"]
    tasks = tasks_of(rows)
    for task, asset_id in tasks:
        line = [task]
        for method in methods:
            line.append(cell(of(rows, task, asset_id, method)))
            if published is not None:
                line.append(percents([paper(published, asset_id, method)]))
        lines.append(line)
    for method in methods:
        mine = [of(rows, *which, method)["success"].fillna(0.0).mean() for which in tasks]
        whole.append(percents([100.0 * value for value in mine], 1))
        headings.append(method)
        if published is not None:
            headings.append("paper")
            whole.append(percents([paper(published, asset_id, method) for _, asset_id in tasks], 1))
    return markdown_table(headings, [*lines, whole], range(1, len(headings)))


def percents(values: Sequence[float], digits: int = 0) -> str:
    """The mean of percentages, those left out that are none; a dash where none is one."""
    known = [value for value in values if value == value]
    return f"{np.mean(known):.{digits}f} %" if known else "–"


def tasks_of(rows: pd.DataFrame) -> list[tuple[str, str]]:
    """Tasks, each with its object's id: two objects may have a task of one name."""
    return sorted(set(zip(map(str, rows["task"]), map(str, rows["asset_id"]), strict=True)))


def of(rows: pd.DataFrame, task: str, asset_id: str, method: str) -> pd.DataFrame:
    """The trainings of an object's task and a method."""
    return rows[(rows["task"] == task) & (rows["asset_id"] == asset_id) & (rows["method"] == method)]


def cell(some: pd.DataFrame) -> str:
    """The success of the trainings of a task and method, a number a seed, with what they needed or why they failed."""
    if some.empty:
        return ""
    rated = some[some["success"].notna()]
    if rated.empty:
        return str(some["outcome"].iloc[0])
    each = ", ".join(f"{100.0 * value:.0f}" for value in rated["success"])
    needed = f"{rated['steps'].astype(float).mean() / 1000.0:.0f}k, {rated['seconds'].mean() / 60.0:.0f} min"
    moved = rated["tilted_rad"].astype(float).max() if "tilted_rad" in rated else math.nan
    needed += f", tilted {math.degrees(moved):.0f}°" if moved == moved else ""
    fired = [
        f"{words} {int(total)}" for name, words in GUARDS.items() if name in rated and (total := rated[name].sum())
    ]
    return f"{each} % ({'; '.join([needed, *fired])})"


def paper(published: pd.DataFrame, asset_id: str, method: str) -> float:
    """Published success, %; NaN for nothing."""
    found = published[(published["asset_id"] == asset_id) & (published["method"] == method)]["success_percent"]
    return float(found.iloc[0]) if len(found) else math.nan


def draw_curves(curves: pd.DataFrame, to: Path) -> None:
    """Write S over actions as an SVG: a panel a task, a line a seed, a colour a method."""
    from matplotlib.figure import Figure

    tasks = tasks_of(curves)
    figure = Figure(figsize=(2.2 * max(1, len(tasks)), 2.0))
    panels = figure.subplots(1, max(1, len(tasks)), sharey=True, squeeze=False)[0]
    for panel, (task, asset_id) in zip(panels, tasks, strict=False):
        for method in reversed(methods_of(curves)):
            lines(panel, of(curves, task, asset_id, method), method)
        panel.set_title(task, fontsize=8)
        panel.set_ylim(-0.03, 1.03)
        panel.tick_params(labelsize=7)
        panel.set_xlabel("1000 actions", fontsize=7)
        panel.spines[["top", "right"]].set_visible(False)
    panels[0].set_ylabel("S", fontsize=8)
    if tasks:
        names = methods_of(curves)
        handles = [panels[0].plot([], [], color=COLORS.get(name, OTHER), label=name)[0] for name in names]
        figure.legend(handles, names, loc="lower center", ncol=len(names), fontsize=7, frameon=False)
    figure.tight_layout(rect=(0.0, 0.08, 1.0, 1.0))
    written = BytesIO()
    figure.savefig(written, format="svg", metadata={"Date": None})
    to.write_bytes(written.getvalue())


def lines(panel: object, some: pd.DataFrame, method: str) -> None:
    """The curves of a task and method, a line a seed."""
    seeds: Sequence[int] = sorted(set(some["seed"]))
    for seed in seeds:
        one = some[some["seed"] == seed].sort_values("steps")
        steps = np.concatenate([[0.0], one["steps"].to_numpy(float)]) / 1000.0
        values = np.concatenate([[0.0], one["s"].to_numpy(float)])
        panel.plot(steps, values, color=COLORS.get(method, OTHER), linewidth=1.1, alpha=0.85)  # type: ignore[attr-defined]
