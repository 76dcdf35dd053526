"""Contents of an object's page: its row and all that belongs to it, in the words of people who handle objects."""

import json
import re
import shlex
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from asset2sim.catalog.read import FrameRow
from asset2sim.catalog.show_physics import UNITS
from asset2sim.catalog.summarize import WAYS
from asset2sim.catalog.text import NOTHING, further_lines, plus_or_minus, significant
from asset2sim.checks.declared_check import failure_guide
from asset2sim.report.charts import line
from asset2sim.report.hand_feel import position_in_words, sensations
from asset2sim.report.index_page import longest_edge, method_of
from asset2sim.report.pictures import AFTER, AXES, BEFORE, LOOPS, SIZE
from asset2sim.report.snapshot import Exchange
from schemas.errors import first_words
from schemas.vocabulary import Source, Stage

Rows = Mapping[str, Sequence[FrameRow]]

SOURCES = {
    Source.USER: "stated by the user: guidance, manifest or overrides.csv",
    Source.MODEL: "proposed by the model",
    Source.PRIOR: "looked up in the tables of prior/household",
    Source.RULE: "computed or bounded by a rule",
    Source.SEARCH: "found by the search, or by a mend of a failing check",
    Source.AUTHORED: "as the asset's own file has it",
}
"""Where a number may come from, in words."""
CHECKS = {
    "stands": "stands as set down",
    "state": "joints stay where asked",
    "drop": "dropped from 5 cm",
    "nudge": "a nudged joint settles",
    "jam": "joints move freely",
    "hold": "holds where placed",
    "release": "returns when let go",
    "reset": "bears a perturbed start",
    "effort": "opens with a hand's force",
}
"""Interaction checks in words, in their order."""
TURNED = "turned_upright"
"""Code of the finding on an object that a rule turned, which may be why it fails."""
MOST_NAMED = 4
"""Links or joints that are named beside what is believed of them."""
LOADERS = ("pybullet", "mujoco", "sapien", "drake", "genesis", "newton")
SEVERITIES = ("error", "warning", "info")


@dataclass(frozen=True)
class Picture:
    """A picture or loop of the page, with its alternative text and its caption."""

    file: str
    alt: str
    caption: str


@dataclass(frozen=True)
class Beside:
    """Files and pages beside a page: the pictures in its ``folder``, the ids of the objects ``before`` and ``after``
    it, the refined files that can be loaded, relative to OUT, OUT itself, and the films of its use."""

    folder: Collection[str] = ()
    before: str | None = None
    after: str | None = None
    refined: Sequence[str] = ()
    out: str = ""
    films: Sequence[str] = ()


def object_page(
    asset: FrameRow, own: Rows, others: Sequence[FrameRow], beside: Beside, calls: Sequence[Exchange]
) -> dict[str, Any]:
    """The template's values for an asset's page; ``own`` are its rows by table, ``others`` other refinements."""
    files = beside.folder
    checks = own["interactions"]
    return {
        "asset": asset,
        "ok": asset["status"] == "ok",
        "guide": failure_guide().get(asset["failure_mode"]),
        "turned": [item["message"] for item in own["findings"] if item["code"] == TURNED],
        "beside": beside,
        "view": shlex.join(["asset2sim", "view", asset["asset_id"], "--out", beside.out]),
        "draw": shlex.join(["asset2sim", "report", "--out", beside.out]),
        "method": method_of(asset),
        "facts": facts(asset),
        "kept": kept_rows(asset),
        "pictures": pictures(asset, files),
        "loops": loops(asset, files),
        "asked": asked_rows(own),
        "links": in_order(own["links"], "link"),
        "joints": [joint_words(joint, checks) for joint in in_order(own["joints"], "joint")],
        "findings": sorted(own["findings"], key=lambda item: SEVERITIES.index(item["severity"])),
        "phi": phi_plot(own["trace"]),
        "trace": own["trace"],
        "engines": engines(own),
        "further": further_lines(asset),
        "failed_checks": [row for row in checks if row["passed"] is False],
        "overlaps": own["link_overlaps"],
        "calls": calls,
        "stages": [(stage.value, asset[f"seconds_{stage.value}"]) for stage in Stage],
        "others": others,
        "sources": SOURCES,
        "loaders": LOADERS if asset["refined_path"] else (),
    }


def shown_number(value: float | None, unit: str) -> str:
    """A number with its unit; what is too small to matter as less than a thousandth."""
    return f"< 0.001 {unit}" if value is not None and 0.0 < value < 1e-3 else significant(value, unit)


def in_order(items: Sequence[FrameRow], name: str) -> list[FrameRow]:
    """Rows by a name's words and numbers: ``joint_2`` before ``joint_10``."""
    return sorted(items, key=lambda row: [(len(word), word) for word in re.split(r"(\d+)", str(row[name]))])


def facts(asset: FrameRow) -> list[tuple[str, str, str]]:
    """The object in figures: (what, value, where it came from)."""
    if asset["scale"] is None:
        return []
    sizes = " × ".join(significant(asset[f"size_{axis}_m"]) for axis in "xyz")
    mount = f" ({asset['support_mount']})" if asset["support_mount"] else ""
    found = [
        ("size", f"{sizes} m", ""),
        ("scale", f"{significant(asset['scale'])}{plus_or_minus(asset.get('scale_sigma'))}", asset["scale_source"]),
        ("mass", significant(asset["mass_kg"], "kg"), ""),
        ("support", f"{asset['support'] or NOTHING}{mount}", asset["support_source"]),
        ("contact friction", significant(asset["contact_friction"]), ""),
        ("overlap Φ", significant(asset["penetration_mm"], "mm"), ""),
        ("drift", shown_number(None if asset["drift_m"] is None else 1e3 * asset["drift_m"], "mm"), ""),
        ("links, joints", f"{asset['n_links']}, {asset['n_joints']}", ""),
    ]
    return [(what, value, source or "") for what, value, source in found]


def kept_rows(asset: FrameRow) -> list[tuple[str, str, str]]:
    """The numbers of a file in metres and what became of them: (quantity, how many are kept, supplied and mended, how
    far they are believed and why); none for other files."""
    found = []
    for row in json.loads(asset["authored_json"] or "[]"):
        counts = [f"{row[how]} {how}" for how in WAYS if row[how]]
        said = [f"{item['trust']}{first_names(item['of'])}: {item['reason']}" for item in row["said"]]
        if counts or said:
            found.append((row["quantity"], ", ".join(counts), "; ".join(said)))
    return found


def first_names(names: Sequence[str]) -> str:
    """The first few names in brackets, and how many more; "" for none."""
    return f" ({first_words(names, MOST_NAMED)})" if names else ""


def pictures(asset: FrameRow, files: Collection[str]) -> list[Picture]:
    """Before and after from the same view, both at their true size, and the joints, as far as they are there."""
    what, size, scale = asset["category"] or "object", longest_edge(asset), asset["scale"]
    raw = "" if size is None or not scale else f", {significant(size / scale, 'm')} long as it is written"
    now = "" if size is None else f", {significant(size, 'm')} long"
    state = "in the state that it starts in"
    shown = (
        Picture(BEFORE, f"{what} {asset['asset_id']} before: as it came, every joint at zero", f"as it came{raw}"),
        Picture(AFTER, f"{what} {asset['asset_id']} after: refined, {state}", f"refined, {state}{now}"),
        Picture(SIZE, f"{what} {asset['asset_id']} as it came and refined, beside a cube of 10 cm",
                "both at their true relative size, beside a cube of 10 cm"),
        Picture(AXES, f"{what} {asset['asset_id']} with an arrow along or about the axis of each joint",
                "its joints: arrows point the positive way"),
    )  # fmt: skip
    return [picture for picture in shown if picture.file in files]


def loops(asset: FrameRow, files: Collection[str]) -> list[Picture]:
    """The loops that are there: raw on the left, refined on the right, in step."""
    what = asset["category"] or "object"
    return [
        Picture(file, f"{what} {asset['asset_id']}, {words}: as it came on the left, refined on the right", words)
        for file, words in LOOPS.items()
        if file in files
    ]


def asked_rows(own: Rows) -> list[tuple[str, str, float | None]]:
    """Requests and expectations of the object, what came of it, and how far that meets it, 0 to 1: the catalog's
    score. None where that is told elsewhere, or by another."""
    found: list[tuple[str, str, float | None]] = []
    for joint in own["joints"]:
        if joint["asked_position"] is None:
            continue
        slides = joint["position_unit"] == "m"
        words = [f"asked at {position_in_words(joint['asked_position'], slides)}"]
        words += [f"starts at {position_in_words(joint['initial_position'], slides)}"]
        if joint["final_position"] is not None:
            words += [f"rests at {position_in_words(joint['final_position'], slides)}"]
        found.append((f"{joint['label'] or 'joint'} ({joint['joint']})", ", ".join(words), None))
    for row in own["alignment"]:
        found.append(("scale", row["scale_reason"], row["scale_score"]))
        found.append(("state", row["state_reason"], row["state_score"]))
        if row["judged"] is not None:
            found.append(("judged by a model", f"{significant(row['judged'])}: {row['judged_reason']}", None))
    for row in own["expectations"]:
        spans = " or ".join(f"{low:g} to {high:g}" for low, high in zip(row["lows"], row["highs"], strict=True))
        met = row["met_at_start"] if row["met_at_rest"] is None else row["met_at_rest"]
        rest = "" if row["rest"] is None else f", {significant(row['rest'])} at rest"
        words_of = f"{spans} {row['unit']}; is {significant(row['start'])}{rest}. {row['why']}" if spans else row["why"]
        found.append((f"a reader expects: {row['what']}", row["reason"] or words_of, met))
    return found


def joint_words(joint: FrameRow, checks: Sequence[FrameRow]) -> dict[str, Any]:
    """A joint for the table: its triplet with units and sources, where it is, and what that means to a hand."""
    slides, units = joint["position_unit"] == "m", UNITS[joint["position_unit"]]
    limits = (
        "turns for ever"
        if joint["lower"] is None
        else f"{position_in_words(joint['lower'], slides)} to {position_in_words(joint['upper'], slides)}"
    )
    return {
        "joint": joint["joint"],
        "type": joint["type"],
        "label": joint["label"],
        "terms": [
            (name, significant(joint[name], units[name]), joint[f"{name}_source"])
            for name in ("damping", "friction", "stiffness")
        ],
        "start": position_in_words(joint["initial_position"], slides),
        "start_source": joint["position_source"],
        "limits": limits,
        "open": ""
        if joint["closed"] == joint["open"]
        else f"{position_in_words(joint['closed'], slides)} → {position_in_words(joint['open'], slides)}",
        "felt": sensations(joint, [row for row in checks if row["subject"] == joint["joint"]]),
    }


def phi_plot(trace: Sequence[FrameRow]) -> str:
    """Φ after each step over the state, mm; "" where nothing ever overlapped."""
    steps = [row for row in trace if row["test"] is None]
    if len(steps) < 2 or not any(row["phi_before_mm"] or row["phi_after_mm"] for row in steps):
        return ""
    kept = [row["phi_after_mm"] if row["accepted"] else row["phi_before_mm"] for row in steps]
    told = [
        f"step {row['step']}, {row['proposer']}: {significant(value, 'mm')}, "
        f"{'kept' if row['accepted'] else 'refused'}: {row['reason']}"
        for row, value in zip(steps, kept, strict=True)
    ]
    points = [(float(index), float(value)) for index, value in enumerate(kept)]
    title = f"Φ from {significant(kept[0], 'mm')} to {significant(kept[-1], 'mm')} over {len(points)} steps"
    return line(points, told, title, lambda x: f"{x:.0f}", lambda y: significant(y), (0.0, max(kept)), "step")


def engines(own: Rows) -> dict[str, Any]:
    """Engines side by side: their names, and for each measure its words and each engine's (value, passed)."""
    measured = own["measurements"]
    lines: list[tuple[str, list[tuple[str, bool | None]]]] = [
        ("verdict", [("ok" if row["passed"] else row["failure_mode"], row["passed"]) for row in measured])
    ]
    for what, column, unit, factor in (
        ("overlap Φ", "penetration_mm", "mm", 1.0), ("drift", "drift_m", "mm", 1e3), ("turn", "drift_rad", "rad", 1.0),
        ("peak speed", "peak_speed_m_s", "m/s", 1.0), ("margin to tip over", "tip_margin_deg", "°", 1.0),
    ):  # fmt: skip
        values = [None if row[column] is None else factor * row[column] for row in measured]
        if any(value is not None for value in values):
            lines.append((what, [(shown_number(value, unit), None) for value in values]))
    for test, words in CHECKS.items():
        mine = [row for row in own["interactions"] if row["test"] == test and row["passed"] is not None]
        if mine:
            lines.append(
                (words, [_passed([item for item in mine if item["engine"] == row["engine"]]) for row in measured])
            )
    lines.append(("time to verify", [(significant(row["seconds"], "s"), None) for row in measured]))
    return {
        "names": [f"{row['engine']} {row['engine_version']}" for row in measured],
        "lines": lines if measured else [],
        "problems": [f"{row['engine']}: {row['problem']}" for row in measured if row["problem"]],
    }


def _passed(checks: Sequence[FrameRow]) -> tuple[str, bool | None]:
    passed = sum(bool(check["passed"]) for check in checks)
    return (f"{passed} of {len(checks)}", passed == len(checks)) if checks else (NOTHING, None)
