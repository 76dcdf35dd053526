"""Every check of the verdict once more by every way in which a user gets an object: ``python -m lab.loaders.touched OUT
ROWS`` adds a line of JSON an object and way to ROWS, and goes on where it stopped; a table of what differs follows."""

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter

import pandas as pd

from asset2sim.assets.authored import read_overlay
from asset2sim.assets.folder import URDF_NAME
from asset2sim.catalog.read import latest_rows
from asset2sim.catalog.text import markdown_table, output
from asset2sim.checks.rig import CauseOf
from asset2sim.checks.verdict import check_verdicts, failures_of, verdicts_of
from asset2sim.checks.verify import cause_for, run_checks
from asset2sim.engines.child import in_child
from asset2sim.engines.registry import engine_version
from asset2sim.intake.origin import extract
from lab.loaders.routes import Route, routes
from schemas.asset import AssetRef
from schemas.base import Frozen
from schemas.errors import DONE, AssetError, exit_code_of
from schemas.interaction import EngineReport, Interaction, Measurement
from schemas.overlay import PhysicsOverlay
from schemas.settings import Settings
from schemas.vocabulary import FailureMode, OverlapCause, Status

EFFORT_SHARE = 0.05
"""How far an opening effort by one way may be from the catalog's, as a share of it."""
LEAST_EFFORT_N = 0.02
"""Difference of efforts, N, that no hand feels."""


class TouchedRow(Frozen):
    """One object by one way: its catalog's status, what fails there, and the efforts that differ from the catalog's."""

    asset_id: str
    route: str
    status: str
    failures: tuple[str, ...]
    efforts: tuple[str, ...]
    n_efforts: int
    seconds: float


def touch(route: Route, folder: Path, overlay: PhysicsOverlay, settings: Settings, cause: CauseOf) -> EngineReport:
    """The report of every check by one way; a way that dies leaves its problem."""
    urdf, own, limits = folder / URDF_NAME, settings.engine, settings.thresholds

    def run() -> tuple[Measurement | None, Interaction]:
        return run_checks(route.engine, urdf, overlay, own, limits, cause=cause, opener=route.open)

    start = perf_counter()
    outcome = in_child(route.engine, run, time_limit_s=own.time_limit_s)
    measured, interaction = outcome.value or (None, None)
    report = EngineReport(
        engine=route.engine, engine_version=engine_version(route.engine), measurement=measured,
        interaction=interaction, problem=outcome.problem, timed_out=outcome.timed_out, died=outcome.died,
        refused=outcome.refused, starved=outcome.starved, seconds=perf_counter() - start,
    )  # fmt: skip
    return report.model_copy(update={"judged": verdicts_of(report, overlay, limits)})


def row_of(
    route: Route, report: EngineReport, asset: pd.Series, known: pd.DataFrame, overlay: PhysicsOverlay
) -> TouchedRow:
    """The row of a report beside the catalog's rows ``known`` of the same object and engine."""
    stated = dict(zip(known["subject"], known["value"], strict=True))
    efforts = {item.subject: item.value for item in check_verdicts(report, overlay, Settings().thresholds)
               if item.test is FailureMode.EFFORT}  # fmt: skip
    differ = [
        f"{joint}: {value:.3g} N, the catalog {stated[joint]:.3g} N"
        for joint, value in efforts.items()
        if value is not None and joint in stated
        and abs(value - stated[joint]) > max(EFFORT_SHARE * stated[joint], LEAST_EFFORT_N)
    ]  # fmt: skip
    failures = failures_of(report, overlay, Settings().thresholds)
    return TouchedRow(
        asset_id=str(asset.asset_id), route=route.name, status=str(asset.status),
        failures=tuple(f"{item.mode}: {item.reason}" for item in failures),
        efforts=tuple(differ), n_efforts=len(efforts), seconds=report.seconds,
    )  # fmt: skip


def cause_of(asset: pd.Series, out: Path, overlay: PhysicsOverlay) -> CauseOf:
    """Why links overlap, by the authored meshes; where the asset cannot be read again, its hulls are to blame."""
    try:
        ref = AssetRef(asset_id=str(asset.asset_id), path=str(asset.source_path))
        return cause_for(extract(ref, None), overlay)
    except AssetError:
        return lambda a, b, positions: OverlapCause.HULL


def touch_all(out: Path, rows: Path, limit: int | None, seed: int, only: Sequence[str]) -> list[TouchedRow]:
    """The rows of OUT's objects that passed, ``limit`` of them drawn by ``seed``, those of ROWS not made again."""
    found = [TouchedRow.model_validate_json(line) for line in rows.read_text().splitlines()] if rows.is_file() else []
    done = {(row.asset_id, row.route) for row in found}
    assets, interactions = latest_rows(out, "assets", "interactions")
    written = assets[assets["refined_path"].notna() & (assets["status"] == Status.OK.value)]
    written = written.sort_values("asset_id").sample(frac=1.0, random_state=seed)[:limit]
    settings = Settings()
    for _, asset in written.iterrows():
        folder = out / str(asset.refined_path)
        overlay = read_overlay(folder)
        cause = None
        for route in routes():
            if (str(asset.asset_id), route.name) in done or not (folder / route.needs).is_file():
                continue
            if only and route.name not in only:
                continue
            cause = cause or cause_of(asset, out, overlay)
            report = touch(route, folder, overlay, settings, cause)
            known = interactions[
                (interactions["asset_id"] == asset.asset_id)
                & (interactions["engine"] == route.engine.value)
                & (interactions["test"] == FailureMode.EFFORT.value)
            ]
            row = row_of(route, report, asset, known, overlay)
            found.append(row)
            with rows.open("a", encoding="utf-8") as file:
                file.write(row.model_dump_json() + "\n")
            said = "; ".join((*row.failures, *row.efforts)) or "as the catalog"
            output().print(f"{row.asset_id} {row.route}: {said}", soft_wrap=True, markup=False)
    return found


def touched_table(rows: Sequence[TouchedRow]) -> str:
    """A line a way: objects, those in which nothing fails, joints whose effort is the catalog's, and what fails."""
    lines = []
    for name in dict.fromkeys(row.route for row in rows):
        own = [row for row in rows if row.route == name]
        modes = Counter(failure.split(":")[0] for row in own for failure in row.failures)
        same = sum(row.n_efforts - len(row.efforts) for row in own)
        said = ", ".join(f"{mode} {count}" for mode, count in modes.most_common()) or "nothing"
        passed = sum(not row.failures for row in own)
        lines.append((name, f"{passed} of {len(own)}", f"{same} of {sum(row.n_efforts for row in own)}", said))
    return markdown_table(("way", "nothing fails", "efforts as the catalog's", "fails"), lines)


def main(words: Sequence[str]) -> int:
    """Measure, and print the table."""
    reader = argparse.ArgumentParser("touched", description=__doc__)
    reader.add_argument("out", type=Path)
    reader.add_argument("rows", type=Path)
    reader.add_argument("--limit", type=int)
    reader.add_argument("--seed", type=int, default=0)
    reader.add_argument("--only", action="append", default=[], metavar="WAY")
    given = reader.parse_args(words)
    output().print(touched_table(touch_all(given.out, given.rows, given.limit, given.seed, given.only)), soft_wrap=True)
    return DONE


if __name__ == "__main__":
    sys.exit(exit_code_of("touched", lambda: main(sys.argv[1:])))
