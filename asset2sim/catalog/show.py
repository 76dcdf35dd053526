"""One asset as the catalog knows it: overlay, measurements beside thresholds, findings, trace, cost and files."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd
from pydantic import ValidationError
from rich.console import Group, RenderableType
from rich.text import Text

from asset2sim.catalog.read import FrameRow, read_asset, rows
from asset2sim.catalog.show_physics import engine_tables, measurement_table, physics_tables
from asset2sim.catalog.text import (
    NOTHING,
    cut_text,
    further_lines,
    number_table,
    numbers_in_brackets,
    plus_or_minus,
    significant,
)
from schemas.location import Location
from schemas.model_names import described
from schemas.settings import Thresholds
from schemas.vocabulary import Stage

_FINDING_HEADINGS = ("severity", "stage", "code", "where", "message")
_STEP_HEADINGS = ("step", "proposer", "moved", "Φ before mm", "Φ after mm", "kept", "evaluations")
_CALL_HEADINGS = ("purpose", "model", "outcome", "attempt", "tokens in", "out", "USD", "s")
_SEVERITY_STYLES = {"error": "bold red", "warning": "yellow", "info": "dim"}


def describe_asset(out: Path | str, asset_id: str) -> RenderableType:
    """All that OUT's catalog has of one asset, by every method and model, as a rich renderable. Raises
    UnknownChoiceError naming the closest ids, UsageError where OUT has no catalog."""
    frames = read_asset(out, asset_id)
    parts: list[RenderableType] = []
    for asset in rows(frames["assets"]):
        own = {
            name: rows(frame[(frame["method"] == asset["method"]) & (frame["model"] == asset["model"])])
            for name, frame in frames.items()
            if name != "runs"
        }
        limits = _limits(frames["runs"], asset["run_id"])
        parts += [
            _heading(asset),
            _overlay(asset),
            *_alignment(own["alignment"]),
            *_expected(own["expectations"]),
            *physics_tables(own),
        ]
        parts += [*measurement_table(asset, limits), *engine_tables(own), *_rest(asset, own)]
    return Group(*parts, _files(out, asset_id))


def _heading(asset: FrameRow) -> RenderableType:
    passed = asset["status"] == "ok"
    verdict = "ok" if passed else f"failed: {asset['failure_mode']}"
    lines = Text()
    lines.append(f"{asset['asset_id']}  {asset['category']}  ", style="bold")
    lines.append(verdict, style="bold green" if passed else "bold red")
    lines.append(f"  {cut_text(asset['reason'])}\n" if asset["reason"] else "\n")
    if asset["prompt"]:
        lines.append(f"asked      {cut_text(asset['prompt'])}\n")
    lines.append(f"refined    by {asset['method']} with {described(str(asset['model']))} in run {asset['run_id']}\n")
    lines.append(f"read from  {asset['source_path']}")
    return lines


def _overlay(asset: FrameRow) -> RenderableType:
    if asset["scale"] is None:
        return Text("\nno overlay: the asset failed before it had one", style="dim")
    size = numbers_in_brackets(asset[f"size_{axis}_m"] for axis in "xyz") if asset["size_x_m"] is not None else NOTHING
    spread = plus_or_minus(asset.get("scale_sigma"))
    return Text(
        f"\nscale {significant(asset['scale'])} ({asset['scale_source']}) · size {size} m{spread} · "
        f"mass {significant(asset['mass_kg'], 'kg')} · contact friction {significant(asset['contact_friction'])} · "
        f"{asset['n_links']} links · {asset['n_joints']} movable joints{_support(asset)}{_kept(asset)}"
    )


def _kept(asset: FrameRow) -> str:
    """Line on what became of the numbers of a file in metres; "" for others, and in runs of older versions."""
    if not isinstance(asset.get("authored_json"), str):
        return ""
    kept, mended, supplied = (f"{asset[name]:.0f} {name}" for name in ("kept", "mended", "supplied"))
    return f"\nof its file's numbers {kept}, {mended}; {supplied}"


def _support(asset: FrameRow) -> str:
    """Line on the object's support, where it comes from and how sure that is; "" where an older run did not say."""
    kind, mount = asset.get("support"), asset.get("support_mount")
    if not isinstance(kind, str):
        return ""
    to = f" ({mount})" if isinstance(mount, str) else ""
    return f"\n{kind}{to}, says {asset['support_source']}, {significant(asset['support_confidence'])} sure"


def _alignment(rows: Sequence[FrameRow]) -> list[RenderableType]:
    """Scores and reasons of the rubric, and of the judge if there was one; empty for an asset without a score."""
    lines = []
    for row in rows:
        lines.append(f"alignment {significant(row['alignment'])}: {row['scale_reason']}; {row['state_reason']}")
        if row["judged"] is not None:
            lines.append(f"judged    {significant(row['judged'])}: {row['judged_reason']}")
    return [Text("\n".join(lines))] if lines else []


def _expected(rows: Sequence[FrameRow]) -> list[RenderableType]:
    """A line for each thing that is expected: what, where it is, and whether that is meant."""
    lines = []
    for row in rows:
        ranges = " or ".join(f"{low:g} to {high:g}" for low, high in zip(row["lows"], row["highs"], strict=True))
        met = {True: "met", False: "missed"}
        found = f"{significant(row['start'])} at the start ({met.get(row['met_at_start'], NOTHING)})"
        if row["met_at_rest"] is not None:
            found += f", {significant(row['rest'])} at rest in {row['rest_engine'] or 'no engine'}"
            found += f" ({met[row['met_at_rest']]})"
        said = f"{row['what']} {ranges} {row['unit']}: {found}" if ranges and not row["reason"] else row["what"]
        lines.append(f"expected   {said}; {row['reason'] or row['why']}")
    return [Text("\n".join(lines))] if lines else []


def _rest(asset: FrameRow, own: Mapping[str, Sequence[FrameRow]]) -> list[RenderableType]:
    """Further checks, findings, trace, calls and times."""
    further = [f"{check:10} {cut_text(words)}" for check, words, _ in further_lines(asset)]
    parts: list[RenderableType] = [Text("\n".join(["", *further]))] if further else []
    if own["findings"]:
        parts.append(number_table("Findings", _FINDING_HEADINGS, map(_finding, own["findings"]), left=5))
    if own["trace"]:
        parts.append(number_table("Refinement", _STEP_HEADINGS, map(_step, own["trace"]), left=3))
    if own["model_calls"]:
        parts.append(number_table("Model calls", _CALL_HEADINGS, map(_call, own["model_calls"]), left=3))
    stages = [(stage.value, asset[f"seconds_{stage.value}"]) for stage in Stage]
    times = " · ".join(f"{name} {seconds:.2f}" for name, seconds in stages if seconds is not None)
    parts.append(Text(f"\nseconds    {times or NOTHING} · in all {asset['seconds_total']:.2f}"))
    cost = f"{asset['queries']} model calls ({asset['cached_calls']} more from the cache), "
    cost += f"{asset['prompt_tokens']} + {asset['completion_tokens']} tokens, {asset['cost_usd']:.4f} USD"
    return [*parts, Text(f"cost       {cost}\n")]


def _finding(finding: FrameRow) -> tuple[str | Text, ...]:
    severity = Text(finding["severity"], style=_SEVERITY_STYLES.get(finding["severity"], ""))
    where = finding["link"] or finding["joint"] or NOTHING
    return severity, finding["stage"], finding["code"], where, finding["message"]


def _step(step: FrameRow) -> tuple[object, ...]:
    moved = zip(step["moved_joints"], step["moved_positions"], strict=True)
    shown = ", ".join(f"{joint} → {significant(position)}" for joint, position in moved)
    before, after = significant(step["phi_before_mm"]), significant(step["phi_after_mm"])
    kept = "yes" if step["accepted"] else "no"
    words = f"{shown}\n{step['reason']}".strip()
    return step["step"], step["proposer"], words, before, after, kept, step["evaluations"]


def _call(call: FrameRow) -> tuple[object, ...]:
    names = ("purpose", "call_model", "outcome", "attempt", "prompt_tokens", "completion_tokens")
    return *(call[name] for name in names), f"{call['cost_usd']:.4f}", f"{call['latency_s']:.2f}"


def _files(out: Path | str, asset_id: str) -> Text:
    if (place := Location(out)).is_url:
        return Text(f"files      {place.below('assets', asset_id)}")
    folder = place.folder / "assets" / asset_id
    if not folder.is_dir():
        return Text(f"files      none: {folder} does not exist", style="dim")
    views = sorted(path.name for path in (folder / "views").glob("*.png"))
    return Text(f"files      {folder}\nviews      {', '.join(views) if views else 'none'}")


def _limits(runs: pd.DataFrame, run_id: str) -> Thresholds:
    """The thresholds of the run that wrote the asset's rows; the defaults where its settings cannot be read."""
    found = runs.loc[runs["run_id"] == run_id, "settings_json"]
    try:
        return Thresholds.model_validate(json.loads(found.iloc[0])["thresholds"])
    except (IndexError, KeyError, TypeError, ValueError, ValidationError):
        return Thresholds()
