"""Arguments that Prefect must not look into."""

from typing import TypeVar, cast

from prefect.utilities.annotations import quote

T = TypeVar("T")


def opaque(value: T) -> T:
    """Mark a task's argument as opaque; the task receives the value itself.

    Prefect walks through every argument, twice, in search of results of other tasks: 50 ms a record (measured), which
    a dataset's records would cost at each of a run's tasks.
    """
    return cast(T, quote(value))
