"""LiteLLM, imported late and set up once: it takes seconds to import and a few hundred megabytes to hold."""

import importlib
import logging
import threading
from types import ModuleType

from asset2sim.models.gateway.environment import quiet_environment

_lock = threading.Lock()
_loaded: ModuleType | None = None


def load_litellm() -> ModuleType:
    """LiteLLM without logs, with the ``prior`` provider and bounded HTTP responses. Thread-safe; set up once."""
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
            importlib.import_module("asset2sim.models.prior.provider").register()
            _loaded = litellm
        return _loaded


def _bound_clients(litellm: ModuleType) -> None:
    """Give both of LiteLLM's HTTP clients (OpenAI's client and its own handler) one bounded transport."""
    import httpx
    from litellm.llms.custom_httpx.http_handler import get_ssl_configuration

    from asset2sim.models.gateway.transport import MAX_CONNECTIONS, BoundedTransport, UnclosableClient

    limits = httpx.Limits(max_connections=MAX_CONNECTIONS, max_keepalive_connections=MAX_CONNECTIONS)
    transport = BoundedTransport(UnclosableClient(verify=get_ssl_configuration(), limits=limits))
    litellm.sync_transport = transport  # type: ignore[attr-defined]
    litellm.client_session = UnclosableClient(transport=transport, follow_redirects=True)  # type: ignore[attr-defined]
