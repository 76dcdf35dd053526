"""Prefect's settings where the user has made none. Imports nothing of Prefect, which reads them when it is imported."""

import os

from asset2sim.models.gateway.environment import checkout_folder, quiet_environment

STATE_FOLDER = ".prefect"

DEFAULTS = {
    "PREFECT_SERVER_ANALYTICS_ENABLED": "false",
    # Every exception of a flow reaches its caller, who reports it; Prefect would print a traceback of its own besides.
    "PREFECT_LOGGING_LEVEL": "CRITICAL",
}


def prepare_environment() -> None:
    """Set what is not set yet: a quiet Prefect that stays off the network and keeps its state in the checkout."""
    quiet_environment()
    for name, value in DEFAULTS.items():
        os.environ.setdefault(name, value)
    checkout = checkout_folder()
    if checkout is not None and os.access(checkout, os.W_OK):
        os.environ.setdefault("PREFECT_HOME", str(checkout / STATE_FOLDER))
