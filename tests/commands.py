"""Commands as a user gives them, one after the other in this process, on the worker's Prefect server: what they load is
loaded once. That each does the same as a program of its own is what test_project_walks shows."""

import io
from collections.abc import Sequence
from contextlib import redirect_stdout

from flows.command import main
from tests.prefect_server import in_use


def one_after_the_other(commands: Sequence[Sequence[str]], address: str) -> list[str]:
    """What each command printed; each must end well."""
    printed = []
    with in_use(address):
        for words in commands:
            with redirect_stdout(io.StringIO()) as said:
                code = main(words)
            assert code == 0, said.getvalue()
            printed.append(said.getvalue())
    return printed
