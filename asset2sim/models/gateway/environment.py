"""Environment variables: no logs, no usage reports and no downloads by libraries, and keys from ``.env``."""

import functools
import os
from pathlib import Path


def checkout_folder() -> Path | None:
    """The project's own folder, if it runs from a checkout, as it does with ``pip install -e``."""
    folder = Path(__file__).resolve().parents[3]
    return folder if (folder / "pyproject.toml").is_file() else None


QUIET_DEFAULTS: dict[str, str] = {
    "LITELLM_LOCAL_MODEL_COST_MAP": "True",
    "LITELLM_LOG": "ERROR",
    "LITELLM_MODE": "PRODUCTION",
    "PREFECT_SERVER_ANALYTICS_ENABLED": "false",
    "DO_NOT_TRACK": "1",
    "MLFLOW_DISABLE_TELEMETRY": "true",
}
"""Without the first, importing LiteLLM fetches its price list; without the third it reads any ``.env`` above its own
folder; the last three switch usage reports off."""
ENV_FILE = ".env"


def quiet_environment() -> None:
    """Set what is not set yet, so that a user's own choice wins; call before importing LiteLLM, Prefect or MLflow."""
    for name, value in QUIET_DEFAULTS.items():
        os.environ.setdefault(name, value)
    _load_env_files_once()


def load_env_file(folder: Path) -> None:
    """Load the variables of a folder's ``.env``, if it has one, without replacing any that is set. No ``$NAME`` is
    expanded in values, since a key may contain a dollar sign."""
    from dotenv import dotenv_values

    for name, value in dotenv_values(folder / ENV_FILE, interpolate=False).items():
        if value is not None:
            os.environ.setdefault(name, value)


@functools.cache
def _load_env_files_once() -> None:
    folders = dict.fromkeys(folder.resolve() for folder in (Path.cwd(), checkout_folder()) if folder is not None)
    for folder in folders:
        if (folder / ENV_FILE).is_file():
            load_env_file(folder)
