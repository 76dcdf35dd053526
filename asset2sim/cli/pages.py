"""``asset2sim ui``: where the pages are."""

from contextlib import suppress
from pathlib import Path

from asset2sim.cli.console import output
from asset2sim.programs import run_together
from asset2sim.ui import addresses, commands


def print_and_serve(out: Path | str) -> None:
    """Serve the pages for the runs in ``out`` until interrupted."""
    console = output()
    for name, address in addresses().items():
        console.print(f"{name}: {address}")
    with suppress(KeyboardInterrupt):
        run_together(commands(out))
