"""Runs of a comparison: methods × models, each with an output folder of its own."""

import argparse
import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from asset2sim.cli.parser import Parser, chosen, usable_cores
from asset2sim.models.prior.noise_level import noise_of
from schemas.base import Frozen
from schemas.errors import UsageError
from schemas.location import local_folder
from schemas.model_names import MAX_LEVEL, NOISY, is_noisy
from schemas.settings import EngineSettings, ModelSettings, RunSettings, Settings, ViewSettings
from schemas.vocabulary import Engine, Method

METHODS = (
    Method.REFERENCE,
    Method.IVW,
    Method.DIRECT,
    Method.ASSET2SIM,
    Method.AGENT,
    Method.NO_SEMANTICS,
    Method.RAW,
)
"""Every method, in the order of the tables: the paper's, and the raw asset."""
WITHOUT_MODEL = (Method.REFERENCE, Method.RAW)
"""Methods without model calls: each is run once, however many models are compared."""
NO_MODEL = "none"
"""Model name of those methods in the tables."""


@dataclass(frozen=True)
class Run:
    """One run of the flow. ``label`` is what the tables call its model, ``folder`` is below the comparison's output."""

    method: Method
    model: str
    folder: Path

    @property
    def label(self) -> str:
        """The model's name in the tables; ``NO_MODEL`` for a method without model calls."""
        return NO_MODEL if self.method in WITHOUT_MODEL else self.model

    def settings(self, base: Settings) -> Settings:
        """The settings of this run."""
        model = base.model.model_copy(update={"model": self.model})
        return base.model_copy(update={"method": self.method, "model": model})


def planned_runs(out: Path, methods: Sequence[Method], models: Sequence[str]) -> tuple[Run, ...]:
    """A run for each method and model; one for a method that asks none. Raises UsageError for no method or model."""
    if not methods or not models:
        raise UsageError("name at least one method and one model")
    runs: list[Run] = []
    for method in methods:
        for model in models[:1] if method in WITHOUT_MODEL else models:
            label = NO_MODEL if method in WITHOUT_MODEL else model
            runs.append(Run(method, model, out / method.value / slug(label)))
    folders = [run.folder for run in runs]
    for run in runs:
        if folders.count(run.folder) > 1:
            raise UsageError(f"two models share the folder {run.folder}; name each model once")
    return tuple(runs)


def slug(model: str) -> str:
    """Folder name for a model."""
    return re.sub(r"[^A-Za-z0-9.@=-]+", "_", model).strip("._") or "model"


def noisy_models(levels: Sequence[float]) -> tuple[str, ...]:
    """The simulated fallible models of these levels; level 1 is the model itself."""
    return tuple(NOISY if level == 1.0 else f"{NOISY}@{level:g}" for level in levels)


def level_of(model: str) -> float | None:
    """The error level of a simulated fallible model; None for any other."""
    noise = noise_of(model) if is_noisy(model) else None
    return None if noise is None else noise.level


class CompareRequest(Frozen):
    """A dataset, what to take of it, the methods and models, and the settings that all runs share."""

    data: Path
    out: Path
    subset: str | None = None
    asset_ids: tuple[str, ...] = ()
    limit: int | None = None
    methods: tuple[Method, ...] = METHODS
    models: tuple[str, ...] = (NOISY,)
    settings: Settings = Settings()
    readme: Path | None = None

    @property
    def engines(self) -> str:
        """Names of the engines to verify in, as text."""
        return ", ".join(self.settings.engine.verify or ("every engine installed",))


def parse_request(words: Sequence[str]) -> CompareRequest:
    """The request that a command line states. Raises UsageError."""
    options = _parser().parse_args(words)
    levels = noisy_models(_levels(options.levels))
    named = tuple(dict.fromkeys(name.strip() for name in (options.models or "").split(",") if name.strip()))
    # The default model comes first, so that the README's tables are of it.
    models = named or ((NOISY,) if NOISY in levels or not levels else ())
    return CompareRequest(
        data=options.data,
        out=options.out.resolve(),
        subset=options.subset,
        asset_ids=tuple(name.strip() for name in (options.assets or "").split(",") if name.strip()),
        limit=options.limit,
        methods=_in_order(chosen(options.methods, Method)) or METHODS,
        models=tuple(dict.fromkeys((*models, *levels))),
        settings=Settings(
            model=ModelSettings(api_base=options.api_base, judge_model=options.judge_model),
            engine=EngineSettings(verify=chosen(options.engines, Engine), interact=not options.no_interaction),
            views=ViewSettings(write=False),
            run=RunSettings(workers=options.workers),
        ),
        readme=options.readme,
    )


def _parser() -> Parser:
    parser = Parser(prog="python -m flows.compare_methods", allow_abbrev=False)
    add = parser.add_argument
    add("data", type=local_folder, metavar="DATA", help="a dataset, as asset2sim refine takes it")
    add(
        "out",
        type=local_folder,
        metavar="OUT",
        help="the output folder: one folder for each method and model, and the tables",
    )
    add("--subset", metavar="S", help="only the manifest's rows of this subset")
    add("--assets", metavar="ID,ID", help="only these assets")
    add("--limit", type=_positive, metavar="N", help="only the first N of them")
    add("--methods", metavar="M,M", help=f"methods, of {', '.join(Method)} (default: all)")
    add("--models", metavar="STR,STR", help=f"any LiteLLM models (default: {NOISY})")
    add("--levels", metavar="L,L", help=f"also {NOISY} at these error levels, such as 0,0.5,1,2,4")
    add("--engines", metavar="E,E", default="pybullet", help="engines to verify in (default: %(default)s)")
    add("--no-interaction", action="store_true", help="only the paper's tests")
    add("--api-base", metavar="URL", help="the address of a server of your own for the models")
    add("--judge-model", metavar="STR", help="a vision model that scores every asset against its prompt")
    add("--workers", type=_positive, default=usable_cores(), metavar="N", help="assets at work at once")
    add("--readme", type=Path, metavar="FILE", help="write the tables and charts between this file's markers")
    return parser


def _in_order(methods: Sequence[Method]) -> tuple[Method, ...]:
    return tuple(method for method in METHODS if method in methods)


def _levels(text: str | None) -> tuple[float, ...]:
    try:
        levels = {float(word) for word in (text or "").split(",") if word.strip()}
    except ValueError:
        levels = {-1.0}
    if not all(0.0 <= level <= MAX_LEVEL for level in levels):
        raise UsageError(f"--levels {text}: give numbers from 0 to {MAX_LEVEL:g}, such as 0,0.5,1,2,4")
    return tuple(sorted(levels))


def _positive(text: str) -> int:
    number = int(text) if text.isdigit() else 0
    if number < 1:
        raise argparse.ArgumentTypeError(f"'{text}' is not a whole number from 1 on")
    return number
