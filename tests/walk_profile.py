"""Count what one asset's way takes, from the command's worker to its rows: ``python -m tests.walk_profile [ASSET]``.

The way runs in this one process, without Dask and without children, under ``sys.setprofile``.
"""

import inspect
import pkgutil
import sys
import tempfile
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import dataclass, field, fields, is_dataclass
from pathlib import Path
from types import CodeType, FrameType, SimpleNamespace
from typing import Any
from unittest.mock import patch

from lxml import etree
from pydantic import BaseModel

from asset2sim.assets.extract import Extraction
from asset2sim.catalog.parts import open_parts
from asset2sim.catalog.run import start_run
from asset2sim.checks import verify as verification
from asset2sim.checks.declared_check import interaction_verdicts
from asset2sim.engines.child import ChildOutcome
from asset2sim.experiments.isolation.pipe_messages import Ending, Outcome
from asset2sim.guidance.read import read_guidance
from asset2sim.runs import asset_attempt
from asset2sim.runs.check_request import check_request
from asset2sim.runs.remote.output import Output
from asset2sim.runs.spread import refine_all
from flows import PIPELINE
from flows import refine_dataset as steps
from schemas.asset import AssetRecord, AssetRef
from schemas.location import Location
from schemas.settings import Settings
from tasks.progress import AssetJob

ROOT = Path(__file__).resolve().parents[1]
ROOMS = tuple(f"{ROOT}/{room}/" for room in ("asset2sim", "tasks", "flows", "schemas"))
RECORDS = (AssetRecord, AssetRef, AssetJob, Extraction)
"""What stands for an asset: its reference, its job, what was read of it, and what came of it."""
LOOKED_AT = 50
"""Calls of a function whose arguments are looked at; one that was handed no record by then is handed none."""
PARSERS = ("parse", "fromstring")
"""Functions of lxml that parse a document; what engines' own loaders read does not count."""


@dataclass
class Walk:
    """What was counted. ``handed``: functions that are handed a record and call another function of the project;
    ``judged``: each engine's interaction record, as often as a verdict on it was computed; ``parses``: caller →
    documents that it parsed; ``sentences``: how often the user's sentence was read."""

    handed: set[CodeType] = field(default_factory=set)
    judged: list[Any] = field(default_factory=list)
    parses: Counter[str] = field(default_factory=Counter)
    sentences: int = 0

    @property
    def verdicts(self) -> dict[str, int]:
        """Engine → how often the verdict on one and the same report of it was computed, at most."""
        seen = Counter((item.engine.value, id(item)) for item in self.judged)
        return {engine: max(count for (name, _), count in seen.items() if name == engine) for engine, _ in seen}

    @property
    def files(self) -> set[str]:
        """Files of the functions that are handed a record."""
        return {code.co_filename for code in self.handed}


def holds_record(value: object) -> bool:
    """Whether a value is an asset's record, reference or job, or has one as a field or an item."""
    if isinstance(value, RECORDS):
        return True
    if isinstance(value, BaseModel):
        return any(isinstance(part, RECORDS) for part in value.__dict__.values())
    if is_dataclass(value) and not isinstance(value, type):
        return any(isinstance(getattr(value, item.name, None), RECORDS) for item in fields(value))
    if isinstance(value, (tuple, list)):
        return any(isinstance(part, RECORDS) for part in value[:3])
    return isinstance(value, dict) and any(isinstance(part, RECORDS) for part in list(value.values())[:3])


def profiler(walk: Walk) -> Callable[[FrameType, str, Any], None]:
    """The function for ``sys.setprofile`` that counts into ``walk``."""
    looked: Counter[CodeType] = Counter()
    given: set[CodeType] = set()

    def see(frame: FrameType, event: str, argument: Any) -> None:
        code = frame.f_code
        if event == "call" and code is interaction_verdicts.__code__:
            walk.judged.append(frame.f_locals[code.co_varnames[0]])
        if event == "call" and code is inspect.unwrap(read_guidance).__code__:
            walk.sentences += 1
        if event != "call" or not code.co_filename.startswith(ROOMS) or code.co_name.startswith("<"):
            return
        before = project_frame(frame.f_back)
        if before is not None and before.f_code in given and before.f_code is not code:
            walk.handed.add(before.f_code)
        if code not in given and looked[code] < LOOKED_AT:
            looked[code] += 1
            names = code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]
            if any(holds_record(frame.f_locals.get(name)) for name in names if name not in ("self", "cls")):
                given.add(code)

    return see


def project_frame(frame: FrameType | None) -> FrameType | None:
    """The nearest frame of the project at or above this one."""
    while frame is not None and not frame.f_code.co_filename.startswith(ROOMS):
        frame = frame.f_back
    return frame


def caller(frame: FrameType) -> str:
    """File and function of the project from which this frame was called."""
    found = project_frame(frame)
    return f"{found.f_code.co_filename.removeprefix(f'{ROOT}/')}:{found.f_code.co_name}" if found else "elsewhere"


def counted(walk: Walk, parse: Callable[..., Any]) -> Callable[..., Any]:
    """The parsing function, which counts its caller."""

    def parsed(*args: Any, **options: Any) -> Any:
        walk.parses[caller(sys._getframe(1))] += 1
        return parse(*args, **options)

    return parsed


@contextmanager
def in_this_process(walk: Walk) -> Iterator[None]:
    """Let cluster, asset's child and engines' children do their work here, and count verdicts."""

    def isolated(function: Any, args: tuple[Any, ...], **options: Any) -> Outcome:
        return Outcome(Ending.RETURNED, pkgutil.resolve_name(function)(*args, **options["services"]), "", 0.0)

    def in_children(calls: dict[Any, Callable[[], Any]], *, time_limit_s: float) -> dict[Any, ChildOutcome[Any]]:
        return {engine: ChildOutcome(call()) for engine, call in calls.items()}

    def spread(client: object, jobs: Any, work: Any, most: int, in_flight: object, take: Any) -> None:
        for job in jobs:
            take(job, work(job))

    with ExitStack() as patches:
        for where, name, new in (
            (asset_attempt, "run_isolated", isolated),
            (asset_attempt, "preload", lambda pipeline: None),
            (verification, "in_children", in_children),
            (refine_all, "spread", spread),
            (refine_all, "warm_up", lambda pipeline: None),
            (refine_all, "concurrency", lambda client: 1),
            (refine_all, "open_client", lambda *given: nullcontext(CLIENT)),
            (steps, "prepare_mlflow", lambda out: None),
        ):
            patches.enter_context(patch.object(where, name, new))
        for name in PARSERS:
            patches.enter_context(patch.object(etree, name, counted(walk, getattr(etree, name))))
        yield


CLIENT = SimpleNamespace(subscribe_topic=lambda *given: None, status="closed")
"""In the place of a Dask client: there is no cluster."""


def walk_of(asset: str, out: Path) -> Walk:
    """What the way of one asset of ``data/raw`` takes, refined into ``out``."""
    walk, settings = Walk(), Settings()
    refs = check_request(ROOT / "data" / "raw", out, settings, None, (asset,), None).refs
    output, run = Output(Location(out), out), start_run(settings, "data/raw")
    planned = steps.plan.fn(refs, output, settings, PIPELINE)
    with open_parts(out, run) as parts, in_this_process(walk):
        sys.setprofile(profiler(walk))
        try:
            steps.refine_assets.fn(refs, planned, output, run, parts, PIPELINE)
        finally:
            sys.setprofile(None)
    return walk


def main(asset: str) -> None:
    """Print what was counted."""
    with tempfile.TemporaryDirectory() as folder:
        walk = walk_of(asset, Path(folder))
    print(f"{len(walk.handed)} functions in {len(walk.files)} files are handed a record and call on")
    for code in sorted(walk.handed, key=lambda code: (code.co_filename, code.co_name)):
        print(f"  {code.co_filename.removeprefix(f'{ROOT}/')}:{code.co_name}")
    print("verdicts:", walk.verdicts)
    print("sentence:", walk.sentences)
    print("parses:", walk.parses.total(), dict(walk.parses))


if __name__ == "__main__":
    main(*sys.argv[1:2] or ["laptop_silver"])
