"""The judge in the pipeline: renders the finished asset, asks, and keeps the score in the record."""

from collections.abc import Callable
from pathlib import Path
from time import perf_counter

from asset2sim.alignment.align import align
from asset2sim.alignment.judge import judge
from asset2sim.assets.urdf.locate import find_urdf
from asset2sim.assets.views import render_views
from schemas.asset import AssetRecord
from schemas.errors import AssetError
from schemas.request import ModelAnswer, ModelRequest
from schemas.settings import Settings
from schemas.vocabulary import Stage


def with_judgement(
    record: AssetRecord, out: Path, settings: Settings, ask: Callable[[ModelRequest], ModelAnswer]
) -> AssetRecord:
    """The record with the score of ``settings.model.judge_model`` in its alignment, and the calls that it took.

    The record as it is where no judge is set, or the asset never came to an overlay. The asset is drawn from
    ``out/assets``, or from where it came if nothing was written; the expert reference is added when the run is
    published, and leaves the score as it is.
    """
    aligned = align(record, None) if settings.model.judge_model is not None else None
    if aligned is None or record.overlay is None:
        return record
    start = perf_counter()
    written = out / "assets" / record.ref.asset_id
    try:
        urdf = find_urdf(written if written.is_dir() else Path(record.ref.path))
        views = render_views(urdf, record.overlay.initial_positions, settings.views)
    except AssetError:
        views = {}
    judged = judge(record, views, ask)
    seconds = record.seconds.get(Stage.PUBLISH.value, 0.0) + perf_counter() - start
    return record.model_copy(
        update={
            "alignment": aligned.model_copy(update={"judged": judged.score}),
            "calls": record.calls + judged.calls,
            "findings": record.findings + judged.findings,
            "seconds": record.seconds | {Stage.PUBLISH.value: seconds},
        }
    )
