"""An independent checker over refined objects: ``python -m lab.simcheck.checker OUT``. The checker is
simcheck, an external package in an environment of its own (``make judge`` makes it): MuJoCo and PyBullet, a free base,
a drop of 5 cm, joint sweeps, contacts at rest. Only its report is used."""

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from time import perf_counter

from pydantic import BaseModel, Field
from pydantic_settings import CliPositionalArg, CliVariadicArg
from rich.console import Console
from rich.progress import Progress
from rich.table import Table
from typing_extensions import TypeAliasType

from asset2sim.assets.folder import URDF_NAME
from asset2sim.catalog.read import latest_rows
from asset2sim.catalog.switch import find_catalog
from asset2sim.catalog.text import output, percent
from asset2sim.runs.command_line import Options, parse
from asset2sim.runs.option_types import IDS, Listed, N
from lab.simcheck.findings import ObjectReport, SimcheckSummary, read_report, summarize
from schemas.base import Positive
from schemas.errors import DONE, FAILED, UnknownChoiceError, UsageError, exit_code_of

ENVIRONMENT = ".venv-judge"
"""The environment that ``make judge`` installs the checker into."""
VARIABLE = "SIMCHECK"
"""Environment variable that names the checker's program, if it is elsewhere."""
OPTIONS = ("--object", "--free-base", "--no-cache", "--no-config", "--quiet", "--fail-on", "never")
TIME_LIMIT_S = 600.0
"""Wall time of one object, s: the checker stops an engine after 240 s, and has two."""
REPORT = "judge.json"
OUTPUT_TAIL_CHARS = 300
"""Characters of the checker's last output that are kept if it wrote no report."""


SECONDS = TypeAliasType("SECONDS", Positive)


class JudgeOptions(Options):
    """Run simcheck over refined objects."""

    out: CliPositionalArg[Path] = Field(description="the folder that a run wrote, with assets/")
    jobs: N = Field(2, description="objects at once")
    ids: CliVariadicArg[Listed[IDS]] = Field((), description="only these objects")
    limit: SECONDS = Field(TIME_LIMIT_S, description="seconds an object may take")


class Findings(BaseModel):
    """Contents of ``judge.json``."""

    judgement: SimcheckSummary
    objects: tuple[ObjectReport, ...]


def find_simcheck(root: Path) -> Path:
    """The program that SIMCHECK names, that of ``.venv-judge`` under ``root``, or one on the PATH; else UsageError."""
    named = os.environ.get(VARIABLE)
    beside = root / ENVIRONMENT / ("Scripts" if os.name == "nt" else "bin") / "simcheck"
    if not named and beside.is_file():
        return beside
    path = shutil.which(named or "simcheck")
    if path is None and named:
        raise UsageError(f"{VARIABLE}={named} is no program that can be run; name simcheck's, or unset it")
    if path is None:
        raise UsageError(
            f"simcheck is not there: make judge installs it into {ENVIRONMENT}; or pip install 'simcheck[all]' in an "
            f"environment of its own, and set {VARIABLE} to its program"
        )
    return Path(path)


def refined_objects(out: Path, ids: Sequence[str] = ()) -> dict[str, Path]:
    """Asset id → its refined URDF, which may be missing: every folder of ``out/assets``, and all of the latest run.
    Raises UsageError where there is none, UnknownChoiceError for an id that is not among them."""
    folders = out / "assets"
    names = {path.name for path in folders.iterdir() if path.is_dir()} if folders.is_dir() else set[str]()
    # The latest run's also hold those that failed before they were written, and those unchanged since an earlier run.
    latest = () if find_catalog(out) is None else latest_rows(out, "assets")[0]["asset_id"]
    names = {name for name in names if not name.startswith(".")} | {str(name) for name in latest}
    if not names:
        raise UsageError(f"{folders}: no refined object; refine a dataset into {out} first")
    for name in ids:
        if name not in names:
            raise UnknownChoiceError("object", name, names)
    return {name: folders / name / URDF_NAME for name in sorted(ids or names)}


def check_object(simcheck: Path, asset_id: str, urdf: Path, time_limit_s: float = TIME_LIMIT_S) -> ObjectReport:
    """Run the checker on one object; returns a report even if it crashes or times out."""
    unchecked = partial(ObjectReport, asset_id=asset_id)
    if not urdf.is_file():
        return unchecked(seconds=0.0, problem="it was not refined: there is no URDF of it")
    start = perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.json"
        command = [str(simcheck), "check", *OPTIONS, "--json", str(report), str(urdf)]
        # A session of its own: the checker runs each engine in a child, and a limit must reach all of them.
        process = subprocess.Popen(
            command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            errors="replace", start_new_session=True,
        )  # fmt: skip
        try:
            said, _ = process.communicate(timeout=time_limit_s)
        except subprocess.TimeoutExpired:
            problem = f"it did not finish within {time_limit_s:g} s"
            return unchecked(seconds=perf_counter() - start, problem=problem)
        finally:
            stop(process)
        seconds = perf_counter() - start
        if not report.is_file():
            problem = f"simcheck ended with exit code {process.returncode}: {said.strip()[-OUTPUT_TAIL_CHARS:]}"
            return unchecked(seconds=seconds, problem=problem)
        return read_report(asset_id, report.read_text(encoding="utf-8"), seconds)


def stop(process: "subprocess.Popen[str]") -> None:
    """Kill a process and all the processes that it started."""
    with contextlib.suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    if process.stdout is not None:
        process.stdout.close()


def show(summary: SimcheckSummary, reports: Sequence[ObjectReport], console: Console) -> None:
    """Print the shares, the causes left, and the objects that were not checked in full."""
    total = summary.objects
    console.print(f"objects            {total}")
    for words, count in (("an error  ", summary.without_error), ("a warning ", summary.without_warning)):
        console.print(f"without {words} {count} of {total} ({percent(count, total)})")
    if summary.causes:
        headings = ("", "check", "engine", "objects", "findings", "for example", "and said there")
        table = Table(*headings, title="causes left")
        for cause in summary.causes:
            counts, examples = (str(cause.objects), str(cause.findings)), ", ".join(cause.examples)
            table.add_row(cause.severity, cause.check, cause.engine or "files", *counts, examples, cause.message)
        console.print(table)
    for report in reports:
        if report.problem:
            console.print(f"not checked in full {report.asset_id}: {report.problem}")


def check_all(chosen: JudgeOptions) -> int:
    """Check the objects; exit code 0 if all were checked in full without an error, else 1. Raises UsageError."""
    simcheck, console = find_simcheck(Path.cwd()), output()
    objects = refined_objects(chosen.out, chosen.ids)
    with Progress(console=Console(stderr=True), transient=True) as progress, ThreadPoolExecutor(chosen.jobs) as pool:
        task = progress.add_task("simcheck", total=len(objects))

        def one(item: tuple[str, Path]) -> ObjectReport:
            report = check_object(simcheck, *item, chosen.limit)
            progress.advance(task)
            return report

        reports = tuple(pool.map(one, objects.items()))
    summary = summarize(reports)
    found = Findings(judgement=summary, objects=reports).model_dump_json(indent=2)
    (chosen.out / REPORT).write_text(found, encoding="utf-8")
    show(summary, reports, console)
    console.print(f"all findings: {chosen.out / REPORT}")
    return DONE if summary.passed else FAILED


def main(words: Sequence[str]) -> int:
    """Run one command line and return its exit code."""
    return exit_code_of("checker", lambda: check_all(parse(JudgeOptions, words, "python -m lab.simcheck.checker")))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
