"""What a Dask worker does with one asset: a child process for the work, this process for the model calls."""

from functools import partial
from pathlib import Path

from asset2sim.isolation.asset import refine_in_child
from asset2sim.models.gateway import ask
from schemas.asset import AssetRecord, AssetRef
from schemas.settings import Settings

PIPELINE = "asset2sim.pipeline:refine_asset"
"""The pipeline by name, so that neither the flow nor a worker imports the engines: only the children do."""


def refine_on_worker(ref: AssetRef, out: Path, settings: Settings, pipeline: str = PIPELINE) -> AssetRecord:
    """The record of one asset, whatever happens to it; ``pipeline`` is a ``module:function`` name."""
    return refine_in_child(pipeline, ref, out, settings, partial(ask, settings=settings.model))
