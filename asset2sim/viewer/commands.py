"""Commands from any thread that are carried out in one, between two steps of the simulation."""

import queue
from collections.abc import Callable
from typing import TypeVar

Answer = TypeVar("Answer")


class Commands:
    """A queue of commands, carried out in the order in which they came."""

    def __init__(self) -> None:
        self._waiting: queue.SimpleQueue[Callable[[], object]] = queue.SimpleQueue()

    def put(self, command: Callable[[], object]) -> None:
        """Have a command carried out."""
        self._waiting.put(command)

    def ask(self, question: Callable[[], Answer], timeout_s: float = 60.0) -> Answer:
        """The answer to a question that is asked in the other thread. Raises what it raises, and queue.Empty where
        there is none in time."""
        answer: queue.SimpleQueue[tuple[list[Answer], Exception | None]] = queue.SimpleQueue()

        def reply() -> None:
            try:
                answer.put(([question()], None))
            except Exception as error:
                answer.put(([], error))

        self.put(reply)
        found, error = answer.get(timeout=timeout_s)
        if error is not None:
            raise error
        return found[0]

    def obey(self, failed: Callable[[Exception], None]) -> None:
        """Carry out what has come; ``failed`` hears of each that raised."""
        while True:
            try:
                command = self._waiting.get_nowait()
            except queue.Empty:
                return
            try:
                command()
            except Exception as error:
                failed(error)
