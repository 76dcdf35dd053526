"""Serving the rating page: on this machine alone unless told otherwise, and with no request to any other."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from asset2sim.viewer.serve import open_server
from lab.judged.rating_plan import Variant
from lab.judged.rating_stages import Durations
from schemas.settings import EngineSettings
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

        desk = RatingDesk(out, variants, server, engine, settings, durations, seed)
        desk.start_thread()
        try:
            yield desk
        finally:
            desk.stop()
