"""The commands that read a catalog."""

from pathlib import Path

from asset2sim.catalog.failures import failure_breakdown, render_failures
from asset2sim.catalog.show import describe_asset
from asset2sim.cli.console import output


def print_failures(out: Path) -> None:
    """The failure-mode breakdown of the catalog in ``out``."""
    output().print(render_failures(failure_breakdown(out)))


def print_asset(out: Path, asset_id: str) -> None:
    """Everything that the catalog in ``out`` has on one asset."""
    output().print(describe_asset(out, asset_id))
