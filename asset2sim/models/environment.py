"""The environment in which other people's libraries stay quiet and off the network."""

import os

QUIET_DEFAULTS: dict[str, str] = {
    "LITELLM_LOCAL_MODEL_COST_MAP": "True",
    "LITELLM_LOG": "ERROR",
    "PREFECT_SERVER_ANALYTICS_ENABLED": "false",
    "DO_NOT_TRACK": "1",
    "MLFLOW_DISABLE_TELEMETRY": "true",
}
"""Without the first, importing LiteLLM fetches its price list; the last three switch usage reports off."""


def quiet_environment() -> None:
    """Set what is not set yet, so that a user's own choice wins; call before importing LiteLLM, Prefect or MLflow."""
    for name, value in QUIET_DEFAULTS.items():
        os.environ.setdefault(name, value)
