"""Commands and options. A mistake is one line that names the valid choices, not a page of usage."""

import argparse
import math
import os
from collections.abc import Sequence
from datetime import UTC, datetime
from enum import StrEnum
from pathlib import Path
from typing import NoReturn, TypeVar

from asset2sim.cli.request import RefineRequest
from schemas.errors import UsageError
from schemas.location import location_of
from schemas.settings import (
    CollisionSettings,
    EngineSettings,
    ModelSettings,
    PhysicsSettings,
    RunSettings,
    Settings,
    ViewSettings,
)
from schemas.vocabulary import CollisionMode, DynamicsRule, Engine, Export, Grouping, Method, Redo, StateMode

Choice = TypeVar("Choice", bound=StrEnum)

EXAMPLE = """\
for example:
  asset2sim refine data/raw --out data/refined
  asset2sim refine PARTNET --out OUT --subset paper9 --model openai/gpt-4o
  asset2sim failures --out OUT --compare previous latest
"""


class Parser(argparse.ArgumentParser):
    """An argument parser that raises ``UsageError`` instead of printing its usage and leaving."""

    def error(self, message: str) -> NoReturn:
        """The user's mistake, and where help is."""
        raise UsageError(f"{message} (see: {self.prog} --help)")


def parse(arguments: Sequence[str]) -> argparse.Namespace:
    """The parsed command line; ``command`` names the command. Raises ``UsageError``."""
    parser = Parser(
        prog="asset2sim",
        description="Make articulated URDF assets interaction-ready: mass, inertia, joint dynamics, scale, state.",
        epilog=EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    _add_refine(commands.add_parser("refine", help="refine a dataset", allow_abbrev=False))
    failures = commands.add_parser("failures", help="the failure modes of a refined dataset", allow_abbrev=False)
    _add_failures(failures)
    query = commands.add_parser("query", help="SQL over the tables and the history of all runs", allow_abbrev=False)
    query.add_argument("sql", metavar="SQL", help="a DuckDB query; tables go by their names")
    query.add_argument("--csv", action="store_true", help="comma-separated values instead of a table")
    show = commands.add_parser("show", help="one refined asset", allow_abbrev=False)
    show.add_argument("asset_id", metavar="ASSET_ID", help="an asset's id, as the manifest has it")
    pages = commands.add_parser("ui", help="the pages of Prefect and MLflow", allow_abbrev=False)
    for command in (failures, query, show, pages):
        command.add_argument("--out", type=location_of, required=True, metavar="OUT", help="a run's folder or URL")
    doctor = commands.add_parser("doctor", help="what works here, and what does not", allow_abbrev=False)
    doctor.add_argument(
        "--out", type=location_of, default=Path("data/refined"), metavar="OUT", help="where it would go"
    )
    _add_model(doctor)
    nightly = commands.add_parser(
        "nightly", help="refine a dataset on the schedule of catalog.yaml", allow_abbrev=False
    )
    _add_refine(nightly)
    nightly.add_argument(
        "--now",
        action="store_true",
        help="one night at once: by the nightly that serves OUT, or here where none does; exits as refine does",
    )
    return parser.parse_args(arguments)


def refine_request(options: argparse.Namespace) -> RefineRequest:
    """The request that ``asset2sim refine`` and ``asset2sim nightly`` were given."""
    ids = tuple(name.strip() for name in (options.assets or "").split(",") if name.strip())
    settings = Settings(
        method=Method(options.method),
        model=model_settings(options),
        physics=PhysicsSettings(dynamics=DynamicsRule(options.dynamics)),
        engine=EngineSettings(verify=engines(options.engines), interact=not options.no_interaction),
        collision=CollisionSettings(mode=CollisionMode(options.collision)),
        state=StateMode(options.state),
        exports=chosen(options.export, Export),
        views=ViewSettings(write=not options.no_views),
        run=RunSettings(
            workers=options.workers, scheduler=options.scheduler, redo=redo(options), hook=options.hook or None
        ),
    )
    return RefineRequest(
        data=options.data,
        out=options.out,
        subset=options.subset,
        asset_ids=ids,
        limit=options.limit,
        settings=settings,
        strict=options.strict,
        now=options.command == "nightly" and options.now,
    )


def redo(options: argparse.Namespace) -> Redo:
    """What ``--force`` and ``--retry-failed`` ask for."""
    if options.force:
        return Redo.ALL
    return Redo.FAILED if options.retry_failed else Redo.CHANGED


def engines(text: str | None) -> tuple[Engine, ...] | None:
    """The engines that ``--engines`` names, None where it names none. Raises ``UsageError`` for an unknown one."""
    return chosen(text, Engine) or None


def chosen(text: str | None, kind: type[Choice]) -> tuple[Choice, ...]:
    """The members that a comma-separated list names, each once, in its order. Raises ``UsageError``."""
    found: list[Choice] = []
    for name in (part.strip() for part in (text or "").split(",")):
        if not name:
            continue
        if name not in list(kind):
            raise UsageError(f"'{name}' is not one of {', '.join(kind)}")
        if kind(name) not in found:
            found.append(kind(name))
    return tuple(found)


def model_settings(options: argparse.Namespace) -> ModelSettings:
    """The models that a command line names and, for a command that has them, their budgets and limits."""
    found = ModelSettings(
        model=options.model,
        refinement_model=options.refinement_model,
        judge_model=options.judge_model,
        api_base=options.api_base,
    )
    if "budget_usd" not in options:
        return found
    return found.model_copy(
        update={
            "run_usd": options.budget_usd,
            "run_calls": options.budget_calls,
            "run_tokens": options.budget_tokens,
            "asset_usd": options.asset_budget_usd,
            "asset_calls": options.asset_budget_calls,
            "requests_per_minute": options.rpm,
            "cache": not options.no_answer_cache,
        }
    )


def usable_cores() -> int:
    """Processor cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _add_refine(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add(
        "data",
        type=location_of,
        metavar="DATA",
        help="a folder, or its URL, with manifest.csv, of asset folders, or of one asset",
    )
    add("--out", type=location_of, required=True, metavar="OUT", help="the output folder, or its URL")
    add("--subset", metavar="S", help="only the manifest's rows of this subset")
    add("--assets", metavar="ID,ID", help="only these assets")
    add("--limit", type=_positive, metavar="N", help="only the first N of them")
    add("--engines", metavar="E,E", help="engines to verify in: pybullet, mujoco, sapien (default: all installed)")
    add("--no-interaction", action="store_true", help="only the paper's tests: no drops, nudges, sweeps or resets")
    add(
        "--collision",
        choices=[mode.value for mode in CollisionMode],
        default=CollisionMode.DECOMPOSE.value,
        help="collision geometry: as authored, hulls, or convex pieces with interiors (default: %(default)s)",
    )
    add(
        "--dynamics",
        choices=[rule.value for rule in DynamicsRule],
        default=DynamicsRule.INERTIA.value,
        help="joint dynamics: from what a joint moves, or the paper's absolute ranges (default: %(default)s)",
    )
    add(
        "--state",
        choices=[mode.value for mode in StateMode],
        default=StateMode.DOCUMENT.value,
        help="keep the authored zero, or write a URDF whose zero is the requested state (default: %(default)s)",
    )
    add("--export", metavar="F,F", help="formats to write beside the URDF: mjcf, usd")
    add(
        "--method",
        choices=[method.value for method in Method],
        default=Method.ASSET2SIM.value,
        help="where the physics come from (default: %(default)s)",
    )
    _add_model(parser)
    _add_budgets(parser)
    add(
        "--workers",
        type=_positive,
        default=usable_cores(),
        metavar="N",
        help="assets at work at once (default: all cores)",
    )
    add("--scheduler", metavar="tcp://…", help="a Dask scheduler to use instead of a cluster of our own")
    again = parser.add_mutually_exclusive_group()
    again.add_argument("--force", action="store_true", help="refine unchanged assets again")
    again.add_argument("--retry-failed", action="store_true", help="refine unchanged assets again that failed")
    add("--no-views", action="store_true", help="write no pictures")
    add("--strict", action="store_true", help="exit with 1 if an asset failed")
    add("--hook", metavar="CMD", help="a shell command to run after the run; ASSET2SIM_… variables say how it went")


def _add_failures(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--by",
        choices=[grouping.value for grouping in Grouping],
        default=Grouping.FAILURE_MODE.value,
        help="what to count by (default: %(default)s)",
    )
    what = parser.add_mutually_exclusive_group()
    what.add_argument("--since", type=_day, metavar="DAY", help="failures of all runs since then, as 2026-11-01 (UTC)")
    what.add_argument(
        "--compare", nargs=2, metavar="RUN", help="what broke and what got mended between two runs: ids or their "
        "beginnings, latest, previous",
    )  # fmt: skip


def _add_model(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--model", default=ModelSettings().model, metavar="STR", help="any LiteLLM model (default: %(default)s)"
    )
    parser.add_argument("--api-base", metavar="URL", help="the address of a server of your own for that model")
    parser.add_argument("--refinement-model", metavar="STR", help="another model for steps of the state")
    parser.add_argument("--judge-model", metavar="STR", help="a vision model that scores the result against its prompt")


def _add_budgets(parser: argparse.ArgumentParser) -> None:
    add = parser.add_argument
    add("--budget-usd", type=_amount, metavar="USD", help="the most that the run's model calls may cost")
    add("--budget-calls", type=_count, metavar="N", help="the most model calls of the run")
    add("--budget-tokens", type=_count, metavar="N", help="the most tokens of the run")
    add("--asset-budget-usd", type=_amount, metavar="USD", help="the same for each asset")
    add("--asset-budget-calls", type=_count, metavar="N", help="the same for each asset")
    add("--rpm", type=_rate, metavar="N", help="the most requests a minute to one provider, over all workers")
    add("--no-answer-cache", action="store_true", help="ask models again what they have answered before")


def _day(text: str) -> datetime:
    try:
        found = datetime.fromisoformat(text)
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"'{text}' is not a day or a time such as 2026-11-01 or 2026-11-01T02:00"
        ) from None
    return found if found.tzinfo is not None else found.replace(tzinfo=UTC)


def _positive(text: str) -> int:
    try:
        number = int(text)
    except ValueError:
        number = 0
    if number < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number from 1 on")
    return number


def _count(text: str) -> int:
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number from 0 on")
    return int(text)


def _amount(text: str) -> float:
    amount = _number(text)
    if amount is None or amount < 0.0:
        raise argparse.ArgumentTypeError(f"'{text}' is not an amount from 0 on")
    return amount


def _rate(text: str) -> float:
    rate = _number(text)
    if rate is None or rate <= 0.0:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number above 0")
    return rate


def _number(text: str) -> float | None:
    """The finite number that a text states; None where it states none."""
    try:
        number = float(text)
    except ValueError:
        return None
    return number if math.isfinite(number) else None
