"""This process as a client of a Prefect server."""

import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager

from prefect.events.worker import EventsWorker
from prefect.logging.handlers import APILogWorker
from prefect.settings import PREFECT_API_URL, temporary_settings

from schemas.errors import Asset2SimError

START_LIMIT_S = 300.0
"""Time in which a server must answer, s: 5 to 10 is usual, and on a machine with six times its cores' work 120 is not
enough; the first start of all makes its database too."""
ASK_LIMIT_S = 20.0
"""Time that one request gets, s: what a starting server has taken in and forgotten is asked again."""


class PrefectServerError(Asset2SimError):
    """The Prefect server did not start."""


@contextmanager
def use_server(address: str | None) -> Iterator[None]:
    """Run flows against the server at ``address`` within the block; None leaves Prefect to the user's configuration.
    Waits until the server answers; raises ``PrefectServerError`` if it does not."""
    if address is None:
        yield
        return
    wait_for(address)
    with temporary_settings({PREFECT_API_URL: address}):
        try:
            yield
        finally:
            # What Prefect's background threads still hold must be sent before the server goes.
            APILogWorker.instance().drain()
            EventsWorker.drain_all()


def wait_for(address: str) -> None:
    """Return once the server at ``address`` answers. Raises ``PrefectServerError``."""
    end = time.monotonic() + START_LIMIT_S
    problem = "no answer"
    while time.monotonic() < end:
        try:
            with urllib.request.urlopen(f"{address}/health", timeout=ASK_LIMIT_S):
                return
        except urllib.error.HTTPError as error:
            problem = f"it answered {error.code}"
        except OSError as error:
            problem = str(error)
            if isinstance(getattr(error, "reason", error), ConnectionError):
                break
        time.sleep(0.2)
    raise PrefectServerError(
        f"the Prefect server at {address} does not serve ({problem}); its log is api_server.log in PREFECT_HOME"
    )
