"""What the user asks of a comparison, from its command line."""

import argparse
from collections.abc import Sequence
from pathlib import Path

from asset2sim.cli.parser import Parser, chosen, usable_cores
from asset2sim.compare.plan import METHODS, noisy_models
from schemas.base import Frozen
from schemas.errors import UsageError
from schemas.location import local_folder
from schemas.model_names import MAX_LEVEL, NOISY
from schemas.settings import EngineSettings, ModelSettings, RunSettings, Settings, ViewSettings
from schemas.vocabulary import Engine, Method


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
        """The engines in words."""
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
