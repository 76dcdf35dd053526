"""Every case through the real command line, and what was wrong with how it ended."""

import importlib
import pkgutil
import tempfile
import time
from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import pyarrow.parquet as pq

from asset2sim.catalog.switch import find_catalog
from asset2sim.storage.regular_files import printable
from schemas.errors import DONE
from schemas.tables import TABLES
from schemas.vocabulary import FailureMode
from tests.hostile import kinds as package
from tests.hostile.case import CANARY, COLUMNS, KEY, RULES, Case, Place
from tests.hostile.commands import TIMED_OUT, Ended, run_command
from tests.hostile.left_behind import holding, listing
from tests.hostile.tiny import asset, write_outside

ASSET_LIMIT_S = 20
"""Wall time of one asset, s: less than a run's, so that hundreds of cases that hang would be seen in minutes."""
LINE_LIMIT_S = 30.0
"""Time in which a command must refuse what it refuses, s."""
SHARED_LIMIT_S = 240.0
"""Time that a run over many cases may take before any of them, s ..."""
EACH_LIMIT_S = 5.0
"""... and for each of them."""
ALWAYS = ("--engines", "pybullet", "--no-interaction", "--no-views")
CHEAP = ("--method", "raw")
"""Options of cases that state none."""
GOOD = "zz_good"
"""The asset that lies beside every case: whatever the others are, it is read."""


@dataclass(frozen=True)
class Outcome:
    """What became of a case: its mode or exit code, and all that was wrong with it."""

    kind: str
    name: str
    ended: str
    problems: tuple[str, ...]
    seconds: float = 0.0


def kind_names() -> list[str]:
    """The names of the kinds: the modules of ``kinds``."""
    return sorted(module.name for module in pkgutil.iter_modules(package.__path__))


def cases_of(kind: str, every: int = 1) -> list[Case]:
    """The cases of a kind, or one of ``every`` so many. Raises ValueError for two of one name."""
    found = list(importlib.import_module(f"{package.__name__}.{kind}").cases())
    ids = [case.row_id for case in found if case.modes]
    twice = {name for name in ids if ids.count(name) > 1}
    if twice:
        raise ValueError(f"{kind}: {', '.join(sorted(twice))} more than once")
    return found[::every]


def sample(every: int) -> list[Case]:
    """One of ``every`` so many cases of all kinds that share a command or need none of their own, each once by name."""
    found: dict[str, Case] = {}
    for kind in kind_names():
        for case in [case for case in cases_of(kind) if not (case.row or case.words)][::every]:
            found.setdefault(case.row_id, case)
    return list(found.values())


def try_kind(kind: str, cases: Sequence[Case], folder: Path, start: Sequence[str]) -> list[Outcome]:
    """Run all cases of a kind below ``folder``, which does not exist yet; ``start`` stands for Python."""
    alone = [case for case in cases if not case.modes]
    outcomes = [_alone(kind, case, folder / "alone" / f"{n:03}", start) for n, case in enumerate(alone)]
    shared: dict[tuple[bool, tuple[str, ...]], list[Case]] = defaultdict(list)
    for case in cases:
        if case.modes:
            shared[bool(case.row), case.words].append(case)
    for number, ((rows, words), batch) in enumerate(shared.items()):
        outcomes += _together(kind, batch, folder / f"shared{number}", start, words or CHEAP, manifest=rows)
    return outcomes


def _alone(kind: str, case: Case, base: Path, start: Sequence[str]) -> Outcome:
    """A case with a dataset of its own, which the command must refuse in one line."""
    place = _prepare(base, "asset")
    case.write(place)
    before, began = listing(base, [place.out]), time.monotonic()
    words = [case.command, str(place.data), "--out", str(place.out), *ALWAYS, *case.words]
    if case.line:
        words = [word.replace("DATA", str(place.data)).replace("OUT", str(place.out)) for word in case.line]
    ended = run_command(start, words, LINE_LIMIT_S)
    seconds = time.monotonic() - began
    problems = _said(ended)
    if ended.code != case.code:
        problems.append(f"exit code {ended.code}")
    lines = ended.stderr.splitlines()
    if case.code == DONE:
        if case.says not in ended.stdout:
            problems.append(f"says: {printable(ended.stdout[:300])}")
    elif len(lines) != 1:
        problems.append(f"{len(lines)} lines: {printable(ended.stderr[:300])}")
    elif case.says not in lines[0]:
        problems.append(f"says: {printable(lines[0][:300])}")
    problems += _changed(before, listing(base, [place.out])) + _leaked(place.out)
    return Outcome(kind, case.name, f"exit {ended.code}", tuple(problems), seconds)


def _together(
    kind: str, cases: Sequence[Case], base: Path, start: Sequence[str], words: Sequence[str], *, manifest: bool
) -> list[Outcome]:
    """Cases that are assets of one dataset."""
    place = _prepare(base, GOOD)
    asset()(place)
    for case in cases:
        case.write(Place(place.data, place.data / case.name, place.outside))
    if manifest:
        lines = [",".join(COLUMNS), f"{GOOD},{GOOD},,", *(case.row for case in cases)]
        (place.data / "manifest.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    settings = base / "settings.yaml"
    settings.write_text(
        f"model:\n  max_attempts: 1\nrun:\n  asset_time_limit_s: {ASSET_LIMIT_S}\n  retries_alone: 0\n",
        encoding="utf-8",
    )
    before, out, began = listing(base), base / "out", time.monotonic()
    limit_s = SHARED_LIMIT_S + EACH_LIMIT_S * len(cases)
    ended = run_command(
        start,
        ["refine", str(place.data), "--out", str(out), "--settings", str(settings), "--workers", "2", *ALWAYS, *words],
        limit_s,
    )
    (base / "stdout").write_text(ended.stdout, encoding="utf-8")
    (base / "stderr").write_text(ended.stderr, encoding="utf-8")
    seconds = time.monotonic() - began
    rows, findings = _rows(out), _findings(out)
    wrong = _said(ended)
    if ended.code != DONE:
        wrong.append(f"exit code {ended.code}: {printable(ended.stderr[-300:])}")
    wrong += _changed(before, listing(base, [out, base / "stdout", base / "stderr"])) + _leaked(out)
    if rows.get(GOOD, ("", ""))[0] in ("", FailureMode.UNREADABLE_ASSET):
        wrong.append("the good asset beside them was not read")
    whole = Outcome(kind, f"the {len(cases)} together", f"exit {ended.code}", tuple(wrong), seconds)
    return [whole, *(_row(kind, case, rows, findings) for case in cases)]


def _row(kind: str, case: Case, rows: dict[str, tuple[str, str]], findings: set[tuple[str, str]]) -> Outcome:
    if case.row_id not in rows:
        return Outcome(kind, case.name, "no row", ("no row",))
    mode, reason = rows[case.row_id]
    problems = []
    ours = mode == FailureMode.ENGINE_REFUSED and case.words == RULES
    if mode not in case.modes or ours:  # what we write, engines load
        problems.append(f"{mode}: {printable(reason[:300])}")
    elif case.says not in reason:
        problems.append(f"says: {printable(reason[:300])}")
    if case.finds and (case.row_id, case.finds) not in findings:
        problems.append(f"no finding {case.finds}")
    if mode != FailureMode.NONE and not reason:
        problems.append(f"{mode} without a reason")
    return Outcome(kind, case.name, mode, tuple(problems))


def _prepare(base: Path, name: str) -> Place:
    """The folders of a dataset and of what lies outside it."""
    place = Place(base / "data", base / "data" / name, base / "outside")
    place.data.mkdir(parents=True)
    write_outside(place.outside)
    return place


def _rows(out: Path) -> dict[str, tuple[str, str]]:
    """Asset id → failure mode and reason of its row."""
    folder = find_catalog(out)
    if folder is None:
        return {}
    table = pq.read_table(folder / TABLES["assets"].file, columns=["asset_id", "failure_mode", "reason"])
    return {row["asset_id"]: (row["failure_mode"], row["reason"] or "") for row in table.to_pylist()}


def _findings(out: Path) -> set[tuple[str, str]]:
    """Asset id and code of every finding."""
    folder = find_catalog(out)
    if folder is None:
        return set()
    table = pq.read_table(folder / TABLES["findings"].file, columns=["asset_id", "code"])
    return {(row["asset_id"], row["code"]) for row in table.to_pylist()}


def _said(ended: Ended) -> list[str]:
    """What was wrong with what a command printed."""
    problems = []
    for name, text in (("stdout", ended.stdout), ("stderr", ended.stderr)):
        if "Traceback (most recent call last)" in text:
            problems.append(f"a traceback on {name}: {printable(text[-300:])}")
        problems += [f"'{what}' on {name}" for what in (CANARY, KEY, "\x1b[31m") if what in text]
    if ended.code == TIMED_OUT:
        problems.append("over its time limit")
    return problems


def _changed(before: dict[str, str], after: dict[str, str]) -> list[str]:
    """What is new, gone or other of what the command had no business to write to."""
    return [
        f"{printable(path)}: {before.get(path, 'was not there')} → {after.get(path, 'is gone')}"
        for path in sorted(before.keys() | after.keys())
        if before.get(path) != after.get(path)
    ][:10]


def _leaked(out: Path) -> list[str]:
    """Which files of the output hold what lies outside the dataset, a key, or a path that is gone."""
    texts = (CANARY, KEY, f"{tempfile.gettempdir()}/asset2sim-")
    found: Iterable[tuple[str, str]] = ((name, text) for text in texts for name in holding(out, text)[:10])
    return [f"'{text}' in {name}" for name, text in found]
