"""Errors. A bad asset is data: ``AssetError`` becomes a row. A user's mistake is a ``UsageError``: one line, exit 2."""

import errno
import re
import sqlite3
import sys
from collections.abc import Callable, Collection, Iterable, Sequence
from functools import partial

from schemas.vocabulary import FailureMode

DONE, FAILED, MISTAKE, GATE, STOPPED = 0, 1, 2, 3, 130
"""Exit codes: done, the run failed, the user's mistake, a gate was missed, interrupted."""
MOST_MISTAKES = 20
"""Mistakes of a user's that are shown at once, as many as a terminal has room for."""


class Asset2SimError(Exception):
    """The base of every error that this project raises on purpose."""


class UsageError(Asset2SimError):
    """An invalid request; the message names the valid choices, a line for each of several mistakes (``said``)."""

    def __init__(self, *said: str) -> None:
        self.said = said
        more = [f"… and {len(said) - MOST_MISTAKES} more"] if len(said) > MOST_MISTAKES else []
        super().__init__(
            said[0] if len(said) == 1 else "\n  ".join([f"{len(said)} mistakes:", *said[:MOST_MISTAKES], *more])
        )


class Mistakes:
    """A user's mistakes in one input, all said at once: ``with mistakes:`` keeps a UsageError and goes on after it."""

    def __init__(self) -> None:
        self.said: list[str] = []

    def __enter__(self) -> None:
        return None

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> bool:
        self.said += error.said if isinstance(error, UsageError) else ()
        return isinstance(error, UsageError)

    def end(self) -> None:
        """Raise UsageError of all, if there is one."""
        if self.said:
            raise UsageError(*self.said)


class UnknownChoiceError(UsageError):
    """A name that is not among the valid ones."""

    def __init__(self, kind: str, value: str, known: Iterable[str]) -> None:
        shown = known_names(sorted(known), 30)
        super().__init__(f"unknown {kind} '{value}'; choose from: {shown or 'none are known'}")


class AssetError(Asset2SimError):
    """Failure of one asset; it becomes a row with this failure mode and a finding with this message."""

    def __init__(
        self, mode: FailureMode, code: str, message: str, *, link: str | None = None, joint: str | None = None
    ) -> None:
        super().__init__(message)
        self.mode, self.code, self.link, self.joint = mode, code, link, joint

    def __reduce__(self) -> tuple[object, ...]:
        return partial(AssetError, link=self.link, joint=self.joint), (self.mode, self.code, str(self))


class ModelError(Asset2SimError):
    """A model call failed for good: the provider refused, could not be reached, or answered nothing."""


class UnreadableAnswerError(ModelError):
    """A provider's response is too long, or compressed, and is not read; the message says what to do about it."""


class InvalidAnswerError(ModelError):
    """The model answered, and the answer does not fit the schema."""


def shortened(text: str, length: int) -> str:
    """The text, cut to ``length`` characters for a message."""
    return text if len(text) <= length else text[:length] + "…"


_UNPRINTABLE = re.compile("[\0-\x08\x0b-\x1f\x7f-\x9f\u200e\u200f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")
"""Control characters but line feed and tab, marks that reorder what is read, and halves of characters."""


def first_words(words: Collection[str], most: int, between: str = ", ") -> str:
    """The first words, at most so many, and how many more there are."""
    more = f"{between.lstrip(',')}and {len(words) - most} more" if len(words) > most else ""
    return between.join(list(words)[:most]) + more


def known_names(names: Sequence[str], most: int) -> str:
    """Names to choose from, at most so many, and how many there are in all; "" for none."""
    return ", ".join(names[:most]) + (f", … ({len(names)} in all)" if len(names) > most else "")


def printable(text: str) -> str:
    """The text without what a terminal would obey rather than show: a dataset's names and prompts may hold escapes."""
    return _UNPRINTABLE.sub("", text)


FULL = (errno.ENOSPC, errno.EDQUOT)
"""Error numbers of a full disk and of an exhausted quota."""


def complain(message: str) -> None:
    """Print one line on standard error, after what was printed before."""
    sys.stdout.flush()
    sys.stderr.write(f"asset2sim: {printable(' '.join(message.split()))}\n")


def is_disk_full(error: BaseException) -> bool:
    """Whether an error, or one in its chain of causes, is due to a full disk."""
    seen: set[int] = set()
    step: BaseException | None = error
    while step is not None and id(step) not in seen:
        if isinstance(step, OSError) and step.errno in FULL:
            return True
        if isinstance(step, sqlite3.Error) and getattr(step, "sqlite_errorcode", None) == sqlite3.SQLITE_FULL:
            return True
        seen.add(id(step))
        step = step.__cause__ or step.__context__
    return False


def error_exit_code(error: BaseException) -> int:
    """Exit code for an error that ended a program."""
    if isinstance(error, KeyboardInterrupt):
        return STOPPED
    return MISTAKE if isinstance(error, UsageError) else FAILED


def exit_code_of(program: str, run: Callable[[], int]) -> int:
    """The exit code that ``run`` returns, or that of our error or Ctrl-C, which is one line on standard error."""
    try:
        return run()
    except (Asset2SimError, KeyboardInterrupt) as error:
        sys.stdout.flush()
        sys.stderr.write(f"{program}: {printable(str(error)) or 'interrupted'}\n")
        return error_exit_code(error)
