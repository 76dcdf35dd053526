"""What runs in the child process: limits first, then the function, then one last word over the pipe."""

import contextlib
import pickle
import sys
import traceback
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path

from asset2sim.disk import is_disk_full
from asset2sim.isolation import limits
from asset2sim.isolation.messages import Answer, Call, Raised, Returned
from schemas.errors import Asset2SimError


class ServiceError(Asset2SimError):
    """A service in the parent process raised; the message says what."""


def child_main(pipe: Connection, work: bytes, services: tuple[str, ...], memory_limit_mb: int, log_path: str) -> None:
    """Run one pickled ``(function, args)`` and send ``Returned`` or ``Raised``.

    The function is called as ``function(*args, **proxies)``, a proxy for each name in ``services``: a call to it is
    answered by the parent.
    """
    limits.lead_own_group()
    limits.die_with_parent()
    limits.forbid_core_files()
    limits.log_to(Path(log_path))
    limits.limit_memory(memory_limit_mb)
    last_word = _attempt(pipe, work, services)
    with contextlib.suppress(OSError):  # a disk that takes no more lines
        sys.stdout.flush()
        sys.stderr.flush()
    try:
        pipe.send(last_word)
    except (pickle.PicklingError, AttributeError, TypeError, MemoryError) as error:
        pipe.send(_raised(error))


def _attempt(pipe: Connection, work: bytes, services: tuple[str, ...]) -> Returned | Raised:
    try:
        function, args = pickle.loads(work)
        return Returned(function(*args, **{name: _proxy(pipe, name) for name in services}))
    except Exception as error:  # a broken program in here is one asset's failure: the parent reports it
        with contextlib.suppress(OSError):
            traceback.print_exc()
        return _raised(error)


def _raised(error: Exception) -> Raised:
    return Raised(
        type(error).__name__,
        str(error),
        "".join(traceback.format_exception(error)),
        out_of_memory=isinstance(error, MemoryError),
        disk_full=is_disk_full(error),
    )


def _proxy(pipe: Connection, service: str) -> Callable[..., object]:
    def ask_parent(*args: object) -> object:
        pipe.send(Call(service, args))
        answer = pipe.recv()
        if not isinstance(answer, Answer):
            raise ServiceError(f"service '{service}' answered with {type(answer).__name__}")
        if answer.error is not None:
            raise ServiceError(f"service '{service}': {answer.error}")
        return answer.value

    return ask_parent
