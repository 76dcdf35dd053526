"""Flows: they wire tasks, and hold no logic. Run them as modules, ``python -m flows.command refine DATA --out OUT``.
Importing this package makes Prefect's settings, which Prefect reads once, when it is imported itself."""

from flows.server.server import prepare_environment

prepare_environment()

PIPELINE = "tasks.pipeline:refine_asset"
"""The pipeline by name, so that neither a flow nor a worker imports the engines: only the children do."""
