"""LiteLLM, imported late and set up once (it takes seconds to import and a few hundred megabytes to hold), and the
environment of libraries: no logs, no usage reports, no downloads, keys from ``.env`` by the provider's variable."""

import functools
import importlib
import ipaddress
import logging
import os
import threading
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from urllib.parse import urlsplit

from schemas.model_names import is_local, named_models
from schemas.settings import ModelSettings


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


_lock = threading.Lock()
_loaded: ModuleType | None = None


def load_litellm() -> ModuleType:
    """LiteLLM without logs and with bounded HTTP responses. Thread-safe; set up once."""
    global _loaded
    with _lock:
        if _loaded is None:
            quiet_environment()
            litellm = importlib.import_module("litellm")
            # Attributes of the module, which a type checker does not know.
            litellm.suppress_debug_info = True  # type: ignore[attr-defined]
            for name in ("LiteLLM", "LiteLLM Router", "LiteLLM Proxy"):
                logging.getLogger(name).setLevel(logging.CRITICAL)
            _bound_clients(litellm)
            _loaded = litellm
        return _loaded


def preload_litellm(settings: ModelSettings) -> None:
    """Begin to load LiteLLM in a thread where a model of the settings is asked through it."""
    if not all(is_local(model) for model in named_models(settings)):
        # No daemon: a process that ends in the middle of an import may hang in it for ever.
        threading.Thread(target=load_litellm).start()


def _bound_clients(litellm: ModuleType) -> None:
    """Give both of LiteLLM's HTTP clients (OpenAI's client and its own handler) one bounded transport."""
    import httpx
    from litellm.llms.custom_httpx.http_handler import get_ssl_configuration

    from asset2sim.models.gateway.transport import MAX_CONNECTIONS, BoundedTransport, UnclosableClient

    limits = httpx.Limits(max_connections=MAX_CONNECTIONS, max_keepalive_connections=MAX_CONNECTIONS)
    transport = BoundedTransport(UnclosableClient(verify=get_ssl_configuration(), limits=limits))
    litellm.sync_transport = transport  # type: ignore[attr-defined]
    litellm.client_session = UnclosableClient(transport=transport, follow_redirects=True)  # type: ignore[attr-defined]


_AMBIENT_PROVIDERS = ("azure", "azure_ai", "bedrock", "sagemaker", "vertex_ai", "vertex_ai_beta")
"""Providers whose credentials may also come from a profile, a role or a login: a missing variable proves nothing."""


def find_provider(model: str) -> str | None:
    """LiteLLM's name for the model's provider, or None where the name belongs to none."""
    try:
        return str(load_litellm().get_llm_provider(model)[1])
    except Exception:  # whatever LiteLLM raises of a name that it does not know
        return None


def missing_variables(settings: ModelSettings) -> tuple[str, ...]:
    """The environment variables that the model needs and that are not set."""
    if runs_without_key(settings) or find_provider(settings.model) in _AMBIENT_PROVIDERS:
        return ()
    return unset_variables(settings.model)


def unset_variables(model: str) -> tuple[str, ...]:
    """The environment variables that the model's provider reads its key from, where none of them is set."""
    report = load_litellm().validate_environment(model)
    names = tuple(str(name) for name in report["missing_keys"] if not str(name).endswith("_BASE"))
    return () if report["keys_in_environment"] else names


def listed(variables: Sequence[str]) -> str:
    """The variable names joined by "or" where all are API keys (alternatives), else by "and"."""
    alternatives = all(name.endswith("_API_KEY") for name in variables)
    return (" or " if alternatives else " and ").join(variables)


def key_variable(model: str) -> str | None:
    """The variable that is set and most likely holds the key of this model's provider: ``<PROVIDER>_API_KEY``."""
    provider = find_provider(model)
    name = f"{provider.upper()}_API_KEY" if provider else ""
    return name if name in os.environ else None


def runs_without_key(settings: ModelSettings) -> bool:
    """Whether the model is served from this machine or its own network, where servers mostly ask for no key."""
    host = urlsplit(settings.api_base or "").hostname
    if host is None:
        return is_local(settings.model) or settings.model.startswith(("ollama/", "ollama_chat/"))
    if host == "localhost" or host.endswith((".local", ".internal")):
        return True
    try:
        return ipaddress.ip_address(host).is_private
    except ValueError:
        return False
