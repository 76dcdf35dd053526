"""The commands that let people rate variants, and that print what they and judges made of them."""

import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

from rich.text import Text

from asset2sim.catalog.text import output
from asset2sim.experiments.interrupt import sigterm_as_interrupt
from asset2sim.viewer.serve import open_server
from lab.judged.rating_plan import Durations, Variant, variants_of
from lab.judged.show_ratings import describe_ratings
from lab.judged.variant_folders import variant_folders
from lab.options import RateOptions, RatingsOptions
from schemas.settings import EngineSettings, Settings
from schemas.vocabulary import Engine

if TYPE_CHECKING:
    from lab.judged.rating_desk import RatingDesk

TITLE = "Rating"
"""Of the page: our own name is a method's."""


@contextmanager
def open_rating(
    out: Path | str,
    variants: Sequence[Variant],
    *,
    engine: Engine,
    host: str,
    port: int,
    settings: EngineSettings,
    durations: Durations,
    seed: int,
) -> Iterator["RatingDesk"]:
    """The rating page of some variants, serving and simulating until the context ends; ratings are stored in OUT.
    Raises UsageError where viser or the engine is not installed, and for an address that cannot be served on."""
    with open_server(engine, host, port, TITLE) as server:
        from lab.judged.rating_desk import RatingDesk

        with RatingDesk(out, variants, server, engine, settings, durations, seed) as desk:
            yield desk


def serve_rating(options: RateOptions, settings: Settings) -> None:
    """Serve the rating page until interrupted, by Ctrl-C or SIGTERM. Raises UsageError for a port that is in use, where
    there is nothing to rate, and where viser is not installed."""
    variants, missing = variants_of(variant_folders(options.outs), options.methods, options.assets)
    out = options.outs[0]
    opened = open_rating(
        out,
        variants,
        engine=options.engine,
        host=options.host,
        port=options.port,
        settings=settings.engine,
        durations=Durations(least_touched_s=options.push_seconds, most_touched_s=2.0 * options.push_seconds),
        seed=options.seed,
    )
    with suppress(KeyboardInterrupt), sigterm_as_interrupt(), opened as desk:
        objects = len({item.stop.asset_id for item in variants})
        left = f"; of {len(missing)} more nothing was written" if missing else ""
        console = output()
        console.print(Text(f"rating: {desk.address}, until Ctrl-C"))
        console.print(
            Text(f"{len(variants)} variants of {objects} objects{left}; asset2sim ratings {out} adds them up")
        )
        sys.stdout.flush()
        desk.wait()


def print_ratings(options: RatingsOptions, settings: Settings) -> None:
    """Print the ratings and video scores of output folders, and the published ones of a folder."""
    for part in describe_ratings(options.outs, options.published):
        output().print(part)
