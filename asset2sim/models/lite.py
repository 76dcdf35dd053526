"""LiteLLM, imported late and set up once: it takes seconds to import and a few hundred megabytes to hold."""

import importlib
import logging
import threading
from types import ModuleType

from asset2sim.models.environment import quiet_environment

_lock = threading.Lock()
_loaded: ModuleType | None = None


def load_litellm() -> ModuleType:
    """LiteLLM, quiet and with the ``prior`` provider registered. Safe from any thread, and as often as one likes."""
    global _loaded
    with _lock:
        if _loaded is None:
            quiet_environment()
            litellm = importlib.import_module("litellm")
            # Attributes of the module: a type checker sees nothing behind them, and need not.
            litellm.suppress_debug_info = True  # type: ignore[attr-defined]
            for name in ("LiteLLM", "LiteLLM Router", "LiteLLM Proxy"):
                logging.getLogger(name).setLevel(logging.CRITICAL)
            importlib.import_module("asset2sim.models.prior_provider").register()
            _loaded = litellm
        return _loaded
