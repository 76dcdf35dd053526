"""The README's table "raw, paper's rules, ours": the same objects raw, by the paper's rules, and by ours.

``python -m asset2sim.studies.rules [--readme README.md] NAME=OUT ...`` reads the latest run of each OUT's catalog;
``settings_of`` says how each is run.
"""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import pandas as pd
from pydantic import Field
from pydantic_settings import CliPositionalArg
from rich.console import Console

from asset2sim.catalog.read import latest_rows
from asset2sim.runs.command_line import Options, parse
from asset2sim.runs.options import FILE, Listed
from schemas.errors import UsageError
from schemas.settings import Settings, Thresholds
from schemas.vocabulary import CollisionMode, DynamicsRule, Engine, FailureMode, Method

BEGIN = "<!-- rules: begin (make rules) -->"
END = "<!-- rules: end -->"
RAW, PAPER, OURS = "raw", "paper's rules", "ours"
TESTS: dict[FailureMode, str] = {
    FailureMode.DROP: "drop",
    FailureMode.NUDGE: "nudge",
    FailureMode.JAM: "sweep",
    FailureMode.HOLD: "hold",
    FailureMode.RELEASE: "release",
    FailureMode.RESET: "reset",
}
"""Interaction check → its column heading, in the table's order."""
ZERO_MM = 1e-6
"""Penetration up to which Φ counts as zero, mm: rounding in an engine that counts in single precision."""
NOTHING = "–"


@dataclass(frozen=True)
class Outcome:
    """One object in one engine. ``tests`` maps each interaction check that applied to it to whether it passed; None
    if none were run. ``loaded`` is False if the engine refused the object, or the run failed before loading it."""

    asset_id: str
    engine: str
    loaded: bool
    penetration_mm: float | None = None
    still: bool = False
    steady: bool = False
    passed: bool = False
    tests: Mapping[str, bool] | None = field(default=None)


def settings_of(ours: Settings) -> dict[str, Settings]:
    """Settings of the three runs of a dataset, in the table's order.

    The paper's rules are its absolute ranges for joint dynamics, collision shapes as authored, and a loop over joint
    positions alone: no shape is cleared and no term mended for what interaction finds.
    """
    paper = ours.model_copy(
        update={
            "physics": ours.physics.model_copy(update={"dynamics": DynamicsRule.PAPER}),
            "collision": ours.collision.model_copy(update={"mode": CollisionMode.KEEP}),
            "search": ours.search.model_copy(update={"mend_rounds": 0}),
        }
    )
    return {RAW: ours.model_copy(update={"method": Method.RAW}), PAPER: paper, OURS: ours}


def read_outcomes(out: Path, limits: Thresholds) -> tuple[Outcome, ...]:
    """The outcomes of an OUT's latest run. Raises UsageError where it has no catalog, or no run."""
    assets, measured, tested = latest_rows(out, "assets", "measurements", "interactions")
    return outcomes(assets, measured, tested, limits)


def outcomes(
    assets: pd.DataFrame, measured: pd.DataFrame, tested: pd.DataFrame, limits: Thresholds
) -> tuple[Outcome, ...]:
    """One outcome for every asset in every engine that any of them was measured in, from one run's tables."""
    engines = [engine.value for engine in Engine if engine.value in set(measured["engine"])]
    by_key = {(row["asset_id"], row["engine"]): row for _, row in measured.iterrows()}
    judged = tested[tested["test"].isin([test.value for test in TESTS]) & tested["passed"].notna()]
    passes: dict[tuple[object, object], dict[str, bool]] = {}
    for _, row in judged.iterrows():
        verdicts = passes.setdefault((row["asset_id"], row["engine"]), {})
        verdicts[str(row["test"])] = verdicts.get(str(row["test"]), True) and bool(row["passed"])
    found = []
    for asset in assets["asset_id"]:
        for engine in engines:
            own = by_key.get((asset, engine))
            found.append(Outcome(str(asset), engine, False) if own is None else _outcome(own, passes, limits))
    return tuple(found)


def _outcome(
    row: "pd.Series[str]", passes: Mapping[tuple[object, object], Mapping[str, bool]], limits: Thresholds
) -> Outcome:
    if pd.isna(row["penetration_mm"]):
        return Outcome(str(row["asset_id"]), str(row["engine"]), False)
    bounds = (("drift_m", limits.drift_m), ("drift_rad", limits.drift_rad))
    # A drift that was not finite is null.
    still = all(not pd.isna(row[name]) and float(row[name]) <= bound for name, bound in bounds)
    return Outcome(
        asset_id=str(row["asset_id"]),
        engine=str(row["engine"]),
        loaded=True,
        penetration_mm=float(row["penetration_mm"]),
        still=still,
        steady=bool(row["finite"]) and int(row["oscillating_joints"]) == 0,
        passed=bool(row["passed"]),
        tests=passes.get((row["asset_id"], row["engine"])),
    )


def table_lines(rules: Mapping[str, Sequence[Outcome]]) -> list[str]:
    """The Markdown table: a row for each engine and rule. Shares are of all objects: what does not load passes nothing.

    A check that does not apply to an object (a hold where no joint must hold) counts as passed; penetration is the mean
    over the loaded objects whose Φ is not zero.
    """
    headings = ["engine", "rules", "objects", "loads", "Φ mm", "drift", "oscillation", *TESTS.values(), "every test"]
    lines = ["| " + " | ".join(headings) + " |", "|" + "---|" * len(headings)]
    engines = [engine.value for engine in Engine if any(o.engine == engine for own in rules.values() for o in own)]
    for engine in engines:
        for name, every in rules.items():
            own = [outcome for outcome in every if outcome.engine == engine]
            if own:
                lines.append("| " + " | ".join([engine, name, *cells(own)]) + " |")
    return lines


def cells(own: Sequence[Outcome]) -> list[str]:
    """One row's figures, of the same engine and rules."""
    deep = [o.penetration_mm for o in own if o.penetration_mm is not None and o.penetration_mm > ZERO_MM]
    tested = any(o.tests is not None for o in own)
    row = [
        str(len(own)),
        share([o.loaded for o in own]),
        f"{sum(deep) / len(deep):.3g}" if deep else ("0" if any(o.loaded for o in own) else NOTHING),
        share([o.still for o in own]),
        share([o.steady for o in own]),
    ]
    for test in TESTS:
        passed = [o.tests is not None and o.tests.get(test.value, True) for o in own]
        row.append(share(passed) if tested else NOTHING)
    return [*row, share([o.passed for o in own])]


def share(passed: Sequence[bool]) -> str:
    """How many in a hundred passed, as "98.7 %"; 100 % and 0 % only where all did, or none."""
    count, total = sum(passed), len(passed)
    if count in (0, total):
        return "100 %" if count else "0 %"
    return f"{min(99.9, max(0.1, 100.0 * count / total)):.1f} %"


def with_rules(text: str, lines: Sequence[str]) -> str:
    """The README's text with the table between its markers. Raises UsageError where they are not there."""
    if BEGIN not in text or END not in text:
        raise UsageError(f"the README lacks the lines '{BEGIN}' and '{END}'; put them where the table belongs")
    before, rest = text.split(BEGIN, 1)
    block = "\n".join(lines)
    return f"{before}{BEGIN}\n\n{block}\n\n{END}{rest.split(END, 1)[1]}"


class RulesOptions(Options):
    """Compare runs by different rules in one table."""

    runs: CliPositionalArg[Listed[tuple[str, ...]]] = Field(
        description="NAME=OUT: the rules' name and the folder that a run wrote"
    )
    readme: FILE | None = Field(None, description="write the table between this file's markers")


def main(words: Sequence[str]) -> int:
    """Write the table into the README, or print it."""
    try:
        chosen = parse(RulesOptions, words, "python -m asset2sim.studies.rules")
        rules = {}
        for word in chosen.runs:
            name, separator, out = word.partition("=")
            if not separator or not out:
                raise UsageError(f"'{word}' is not NAME=OUT")
            rules[name] = read_outcomes(Path(out), Thresholds())
        lines = table_lines(rules)
        if chosen.readme is None:
            Console(width=10_000, soft_wrap=True).print("\n".join(lines), markup=False, highlight=False)
        else:
            text = chosen.readme.read_text(encoding="utf-8")
            chosen.readme.write_text(with_rules(text, lines), encoding="utf-8")
    except UsageError as error:
        Console(stderr=True).print(f"error: {error}", markup=False, highlight=False, soft_wrap=True)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
