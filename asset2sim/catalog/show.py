"""One asset as the catalog knows it: overlay, measurements beside thresholds, findings, trace, cost and files."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
from pydantic import ValidationError
from rich.console import Group, RenderableType
from rich.markup import escape
from rich.table import Table
from rich.text import Text

from asset2sim.catalog.read import read_asset
from asset2sim.catalog.show_engines import engine_tables, number_table
from asset2sim.catalog.text import NOTHING, number, vector
from schemas.location import below, is_url, location_of
from schemas.model_names import described
from schemas.settings import Thresholds
from schemas.vocabulary import Stage

Row = Mapping[str, Any]

_LINK_HEADINGS = (
    "link",
    "label",
    "mass kg",
    "density kg/m³ × hollow",
    "volume m³",
    "centre of mass m",
    "ixx, iyy, izz kg·m²",
)
_JOINT_HEADINGS = (
    "joint",
    "moves",
    "starts at",
    "limits",
    "closed → open",
    "damping",
    "friction",
    "stiffness",
    "effective inertia",
)
_SEVERITY_STYLES = {"error": "bold red", "warning": "yellow", "info": "dim"}


def describe_asset(out: Path | str, asset_id: str) -> RenderableType:
    """What the catalog in OUT holds on one asset, for every method and model that refined it, as a rich renderable.

    Raises UnknownChoiceError naming the closest ids for an unknown asset, UsageError where OUT has no catalog.
    """
    frames = read_asset(out, asset_id)
    parts: list[RenderableType] = []
    for asset in _rows(frames["assets"]):
        own = {
            name: _rows(frame[(frame["method"] == asset["method"]) & (frame["model"] == asset["model"])])
            for name, frame in frames.items()
            if name != "runs"
        }
        limits = _limits(frames["runs"], asset["run_id"])
        parts += [_heading(asset), _overlay(asset), *_alignment(own["alignment"]), *_physics(own)]
        parts += [*_measurement(asset, limits), *engine_tables(own), *_rest(asset, own)]
    return Group(*parts, _files(out, asset_id))


def _heading(asset: Row) -> RenderableType:
    passed = asset["status"] == "ok"
    verdict = "ok" if passed else f"failed: {asset['failure_mode']}"
    lines = Text()
    lines.append(f"{asset['asset_id']}  {asset['category']}  ", style="bold")
    lines.append(verdict, style="bold green" if passed else "bold red")
    lines.append(f"  {asset['reason']}\n" if asset["reason"] else "\n")
    if asset["prompt"]:
        lines.append(f"asked      {asset['prompt']}\n")
    lines.append(f"refined    by {asset['method']} with {described(str(asset['model']))} in run {asset['run_id']}\n")
    lines.append(f"read from  {asset['source_path']}")
    return lines


def _overlay(asset: Row) -> RenderableType:
    if asset["scale"] is None:
        return Text("\nno overlay: the asset failed before it had one", style="dim")
    size = (
        vector((asset["size_x_m"], asset["size_y_m"], asset["size_z_m"])) if asset["size_x_m"] is not None else NOTHING
    )
    return Text(
        f"\nscale {number(asset['scale'])} ({asset['scale_source']}) · size {size} m · "
        f"mass {number(asset['mass_kg'], 'kg')} · contact friction {number(asset['contact_friction'])} · "
        f"{asset['n_links']} links · {asset['n_joints']} movable joints"
    )


def _alignment(rows: Sequence[Row]) -> list[RenderableType]:
    """Scores and reasons of the rubric, and of the judge if there was one; empty for an asset without a score."""
    lines = []
    for row in rows:
        lines.append(f"alignment {number(row['alignment'])}: {row['scale_reason']}; {row['state_reason']}")
        if row["judged"] is not None:
            lines.append(f"judged    {number(row['judged'])}: {row['judged_reason']}")
    return [Text("\n".join(lines))] if lines else []


def _physics(own: Mapping[str, Sequence[Row]]) -> list[RenderableType]:
    """Tables of links and joints, as far as there are any; each number with its source."""
    parts: list[RenderableType] = []
    if own["links"]:
        table = number_table("Links", _LINK_HEADINGS, left=2)
        for link in own["links"]:
            inertia = vector(tuple(link[f"i{axis}{axis}_kg_m2"] for axis in "xyz"))
            com = vector(tuple(link[f"com_{axis}_m"] for axis in "xyz"))
            density = f"{number(link['density_kg_m3'])} × {number(link['hollow_factor'])}"
            _add(
                table,
                link["link"],
                link["label"],
                _sourced(link, "mass", "mass_kg"),
                f"{density}\n{link['material'] or NOTHING}",
                _sourced(link, "volume", "volume_m3"),
                f"{com}\n{link['com_source']}",
                f"{inertia}\n{link['inertia_source']}",
            )
        parts.append(table)
    if own["joints"]:
        table = number_table("Joints", _JOINT_HEADINGS, left=2)
        for joint in own["joints"]:
            units = _joint_units(joint)
            limits = "no limits" if joint["lower"] is None else f"{number(joint['lower'])} … {number(joint['upper'])}"
            ends = f"{number(joint['closed'])} → {number(joint['open'])}"
            sure = (
                f"{number(joint['openness_confidence'], digits=2)} sure"
                if joint["openness_confidence"] is not None
                else ""
            )
            _add(
                table,
                f"{joint['joint']}\n{joint['type']}",
                f"{joint['label']}\n{joint['child'] or ''}",
                f"{number(joint['initial_position'], units['position'])}\n{joint['position_source']}",
                f"{limits} {units['position']}\n{joint['limits_source']}",
                f"{ends}\n{sure}",
                *(
                    f"{number(joint[term], units[term])}\n{joint[f'{term}_source']}"
                    for term in ("damping", "friction", "stiffness")
                ),
                number(joint["effective_inertia"], units["inertia"]),
            )
        parts.append(table)
    return parts


def _measurement(asset: Row, limits: Thresholds) -> list[RenderableType]:
    """Table of the measured figures beside the thresholds."""
    if asset["engine"] is None:
        return [Text("\nnot measured", style="dim")]
    title = f"Measured in {asset['engine']} {asset['engine_version']}, Δt {1000.0 * asset['timestep_s']:.2f} ms"
    table = number_table(title, ("what", "value", "passes at most", ""), left=1)
    oscillating = asset["oscillating_joints"]
    figures = (
        ("penetration Φ", asset["penetration_mm"], 1000.0 * limits.penetration_m, "mm"),
        ("drift", asset["drift_m"], limits.drift_m, "m"),
        ("drift", asset["drift_rad"], limits.drift_rad, "rad"),
        ("peak speed", asset["peak_speed_m_s"], limits.peak_speed_m_s, "m/s"),
        ("oscillating joints", oscillating, 0, ""),
    )
    for name, value, limit, unit in figures:
        passed = value is not None and value <= limit
        verdict = Text("ok" if passed else "fails", style="green" if passed else "bold red")
        table.add_row(name, number(value, unit), number(limit, unit), verdict)
    return [table] if asset["finite"] else [table, Text("the simulation left the finite numbers", style="bold red")]


def _rest(asset: Row, own: Mapping[str, Sequence[Row]]) -> list[RenderableType]:
    """Findings, trace, calls and times."""
    parts: list[RenderableType] = []
    if own["findings"]:
        table = number_table("Findings", ("severity", "stage", "code", "where", "message"), left=5)
        for finding in own["findings"]:
            severity = Text(finding["severity"], style=_SEVERITY_STYLES.get(finding["severity"], ""))
            where = finding["link"] or finding["joint"] or NOTHING
            table.add_row(severity, finding["stage"], finding["code"], escape(where), escape(finding["message"]))
        parts.append(table)
    if own["trace"]:
        table = number_table(
            "Refinement", ("step", "proposer", "Φ before mm", "Φ after mm", "kept", "evaluations", "moved"), left=2
        )
        for step in own["trace"]:
            moved = zip(step["moved_joints"], step["moved_positions"], strict=True)
            shown = ", ".join(f"{joint} → {number(position)}" for joint, position in moved)
            _add(
                table,
                step["step"],
                step["proposer"],
                number(step["phi_before_mm"]),
                number(step["phi_after_mm"]),
                "yes" if step["accepted"] else "no",
                step["evaluations"],
                f"{shown}\n{step['reason']}",
            )
        parts.append(table)
    if own["model_calls"]:
        table = number_table(
            "Model calls", ("purpose", "model", "outcome", "attempt", "tokens in", "out", "USD", "s"), left=3
        )
        for call in own["model_calls"]:
            _add(
                table,
                call["purpose"],
                call["call_model"],
                call["outcome"],
                call["attempt"],
                call["prompt_tokens"],
                call["completion_tokens"],
                f"{call['cost_usd']:.4f}",
                f"{call['latency_s']:.2f}",
            )
        parts.append(table)
    stages = [(stage.value, asset[f"seconds_{stage.value}"]) for stage in Stage]
    times = " · ".join(f"{name} {seconds:.2f}" for name, seconds in stages if seconds is not None)
    parts.append(Text(f"\nseconds    {times or NOTHING} · in all {asset['seconds_total']:.2f}"))
    cost = f"{asset['queries']} model calls ({asset['cached_calls']} more from the cache), "
    cost += f"{asset['prompt_tokens']} + {asset['completion_tokens']} tokens, {asset['cost_usd']:.4f} USD"
    return [*parts, Text(f"cost       {cost}\n")]


def _files(out: Path | str, asset_id: str) -> Text:
    if is_url(place := location_of(out)):
        return Text(f"files      {below(place, 'assets', asset_id)}")
    folder = place / "assets" / asset_id
    if not folder.is_dir():
        return Text(f"files      none: {folder} does not exist", style="dim")
    views = sorted(path.name for path in (folder / "views").glob("*.png"))
    return Text(f"files      {folder}\nviews      {', '.join(views) if views else 'none'}")


def _joint_units(joint: Row) -> dict[str, str]:
    if joint["position_unit"] == "m":
        return {"position": "m", "damping": "N·s/m", "friction": "N", "stiffness": "N/m", "inertia": "kg"}
    return {"position": "rad", "damping": "N·m·s/rad", "friction": "N·m", "stiffness": "N·m/rad", "inertia": "kg·m²"}


def _limits(runs: pd.DataFrame, run_id: str) -> Thresholds:
    """The thresholds of the run that wrote the asset's rows; the defaults where its settings cannot be read."""
    found = runs.loc[runs["run_id"] == run_id, "settings_json"]
    try:
        return Thresholds.model_validate(json.loads(found.iloc[0])["thresholds"])
    except (IndexError, KeyError, TypeError, ValueError, ValidationError):
        return Thresholds()


def _rows(frame: pd.DataFrame) -> list[Row]:
    """Rows as mappings, with None for every missing value (NaN, NA, NaT)."""
    return [
        {str(name): None if pd.api.types.is_scalar(value) and pd.isna(value) else value for name, value in row.items()}
        for row in frame.to_dict("records")
    ]


def _sourced(row: Row, name: str, column: str) -> str:
    return f"{number(row[column])}\n{row[f'{name}_source']}"


def _add(table: Table, *cells: object) -> None:
    table.add_row(*(escape(str(cell)) for cell in cells))
