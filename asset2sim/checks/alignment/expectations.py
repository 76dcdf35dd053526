"""Expectations written by readers of prompt and pictures, beside a dataset's manifest, and whether a record meets them.

They are a yardstick: a finished asset is held against them, and they reach no model, prior, rule or search.
"""

import csv
import math
from collections.abc import Collection, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path

from asset2sim.checks.alignment.align import initial_positions
from schemas.alignment import NOTHING, SIZE, Expectation, Expected
from schemas.asset import AssetRecord
from schemas.errors import UsageError
from schemas.features import Features, JointFeatures
from schemas.finding import Finding, warning
from schemas.vocabulary import Stage

FILE = "expectations.csv"
COLUMNS = ("asset_id", "what", "low", "high", "unit", "why")
SWINGS = "swings"
"""Unit of a joint that is held against its expectation at the start only; its own is then rad or m."""
UNITS = {SIZE: ("cm",), NOTHING: ("",)}
JOINT_UNITS = ("rad", "m", SWINGS)
CM_PER_M = 100.0
SLACK = 1e-6
"""How far outside a range a number still meets it, in its own unit: rounding."""

Expectations = Mapping[str, tuple[Expectation, ...]]
"""Asset id → what is expected of it, in the file's order."""


def read_expectations(file: Path) -> dict[str, tuple[Expectation, ...]]:
    """The expectations of a dataset by asset; several lines for one thing are ranges of which any will do. Empty where
    there is no file. Raises UsageError that names the file, the line, and what it may hold."""
    if not file.is_file():
        return {}
    found: dict[str, dict[str, Expectation]] = {}
    try:
        with file.open(encoding="utf-8-sig", newline="") as stream:
            reader = csv.DictReader(stream, skipinitialspace=True)
            columns = [(name or "").strip() for name in reader.fieldnames or ()]
            if missing := [name for name in COLUMNS if name not in columns]:
                raise UsageError(f"{file}, line 1: no column '{missing[0]}'{_nearest(missing[0], columns)}")
            reader.fieldnames = columns
            for row in reader:
                where = f"{file}, line {reader.line_num}"
                if None in row:
                    raise UsageError(f"{where}: more cells than columns; put quotes round a text that holds a comma")
                cells = {name: (row[name] or "").strip() for name in COLUMNS}
                own = found.setdefault(cells["asset_id"], {})
                stated = _stated(cells, reader.line_num, where)
                own[stated.what] = _either(own[stated.what], stated, where) if stated.what in own else stated
    except (UnicodeDecodeError, csv.Error) as error:
        raise UsageError(f"{file}: not a comma-separated table in UTF-8 ({error})") from error
    except OSError as error:
        raise UsageError(f"{file}: {error.strerror}") from error
    return {asset_id: tuple(own.values()) for asset_id, own in found.items()}


def unknown_assets(expectations: Expectations, asset_ids: Collection[str]) -> tuple[str, ...]:
    """A sentence for every asset that the expectations name and the dataset does not have."""
    return tuple(
        f"{FILE}, line {own[0].lines[0]}: asset '{asset_id}' is not in the dataset{_nearest(asset_id, asset_ids)}"
        for asset_id, own in expectations.items()
        if asset_id not in asset_ids
    )


def expectations_met(record: AssetRecord) -> tuple[Expected, ...]:
    """How a record meets each of its expectations."""
    return tuple(met_expectation(record, expectation) for expectation in record.ref.expectations)


def misfits(features: Features, expectations: Sequence[Expectation]) -> tuple[Finding, ...]:
    """A warning for each expectation that cannot be held against an object with these features."""
    wrong = [(item, _misfit(item, features.movable_joints)) for item in expectations]
    return tuple(
        warning(Stage.ALIGN, "expectation_unfit", f"{FILE}, line {item.lines[0]}: {why}") for item, why in wrong if why
    )


def met_expectation(record: AssetRecord, expectation: Expectation) -> Expected:
    """How a record meets one expectation; an asset that never came to an overlay meets none.

    A joint is met at rest if it ends there in every engine that verified the asset; one in which the simulation became
    non-finite, crashed or hung does not count as met.
    """
    overlay, features = record.overlay, record.features
    if expectation.what == NOTHING:
        return Expected(expectation=expectation, reason="nothing is asked")
    rests = expectation.what != SIZE and not expectation.swings
    if overlay is None or features is None:
        never = False if rests else None
        return Expected(expectation=expectation, at_start=False, at_rest=never, reason=f"no overlay: {record.reason}")
    if why := _misfit(expectation, features.movable_joints):
        return Expected(expectation=expectation, reason=why)
    if expectation.what == SIZE:
        size = CM_PER_M * overlay.scale * max(features.closed_size)
        return Expected(expectation=expectation, at_start=distance_outside(expectation, size) <= SLACK, start=size)
    joint = next(item for item in features.movable_joints if item.name == expectation.what)
    unit = overlay.scale if joint.prismatic else 1.0
    start = _turned(expectation, initial_positions(record)[joint.name] / unit, joint)
    found = Expected(expectation=expectation, at_start=distance_outside(expectation, start) <= SLACK, start=start)
    if not rests or not record.reports:
        return found
    ends: list[tuple[float, float | None, str]] = []
    for report in record.reports:
        measured = report.measurement
        moved = {motion.name: motion.final_position for motion in measured.joints} if measured else {}
        if measured is None or not measured.finite or joint.name not in moved:
            ends.append((math.inf, None, report.engine.value))
            continue
        rest = _turned(expectation, moved[joint.name] / unit, joint)
        ends.append((distance_outside(expectation, rest), rest, report.engine.value))
    furthest, rest_of, engine = max(ends, key=lambda end: end[0])
    told = {"at_rest": furthest <= SLACK, "rest": rest_of, "rest_engine": engine}
    reason = "" if math.isfinite(furthest) else f"{engine} measured no rest"
    return found.model_copy(update={**told, "reason": reason})


def distance_outside(expectation: Expectation, value: float) -> float:
    """How far a value is outside the nearest of the ranges, in their unit; 0 within one."""
    return min(max(low - value, value - high, 0.0) for low, high in expectation.ranges)


def _turned(expectation: Expectation, position: float, joint: JointFeatures) -> float:
    """The position, less the whole turns of a hinge that bring it nearest to what is expected."""
    if joint.prismatic:
        return position
    turn = 2.0 * math.pi
    middles = [(low + high) / 2.0 for low, high in expectation.ranges]
    near = [middle + math.remainder(position - middle, turn) for middle in middles]
    return min([position, *near], key=lambda value: distance_outside(expectation, value))


def _stated(cells: Mapping[str, str], line: int, where: str) -> Expectation:
    """The expectation of one line. Raises UsageError."""
    what, unit = cells["what"], cells["unit"]
    if not cells["asset_id"] or not what:
        raise UsageError(
            f"{where}: no {'what' if cells['asset_id'] else 'asset_id'}; give {SIZE}, a joint or {NOTHING}"
        )
    units = UNITS.get(what, JOINT_UNITS)
    if unit not in units:
        raise UsageError(f"{where}: unit '{unit}' of {what}{_nearest(unit, units)}")
    if what == NOTHING:
        return Expectation(what=what, why=cells["why"], lines=(line,))
    bounds = [_number(cells[name], name, where) for name in ("low", "high")]
    if bounds[0] > bounds[1]:
        raise UsageError(f"{where}: low {bounds[0]:g} is above high {bounds[1]:g}")
    return Expectation(
        what=what, ranges=((bounds[0], bounds[1]),), unit=unit, swings=unit == SWINGS, why=cells["why"], lines=(line,)
    )


def _number(text: str, name: str, where: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise UsageError(f"{where}: {name} '{text}' is no number")
    return value


def _either(first: Expectation, second: Expectation, where: str) -> Expectation:
    """Both lines about one thing: either range will do, and both reasons are kept."""
    if first.unit != second.unit:
        raise UsageError(
            f"{where}: unit '{second.unit}' of {second.what}, which line {first.lines[0]} has in {first.unit}"
        )
    why = "; ".join(dict.fromkeys(text for text in (first.why, second.why) if text))
    ranges = tuple(dict.fromkeys(first.ranges + second.ranges))
    return first.model_copy(update={"ranges": ranges, "why": why, "lines": first.lines + second.lines})


def _misfit(expectation: Expectation, joints: Sequence[JointFeatures]) -> str:
    """Why an expectation cannot be held against an object with these movable joints; "" if it can."""
    if expectation.what in UNITS:
        return ""
    joint = next((item for item in joints if item.name == expectation.what), None)
    if joint is None:
        names = [item.name for item in joints]
        return f"'{expectation.what}' is no joint of this object that moves{_nearest(expectation.what, names)}"
    unit = "m" if joint.prismatic else "rad"
    if expectation.unit in (unit, SWINGS):
        return ""
    return f"joint '{joint.name}' is stated in {expectation.unit}, and its positions are in {unit}"


def _nearest(name: str, choices: Collection[str]) -> str:
    near = get_close_matches(name, choices, n=1, cutoff=0.4)
    if near:
        return f"; did you mean '{near[0]}'?"
    return f"; choose from: {', '.join(choice or '(empty)' for choice in sorted(choices)[:30]) or 'none there'}"
