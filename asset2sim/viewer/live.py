"""A live page: commands of its visitors, carried out in the one thread that simulates in real time and draws."""

import math
import queue
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable
from concurrent.futures import Future
from types import TracebackType
from typing import Self, TypeVar

import viser

from asset2sim.physics.arrays import Array
from asset2sim.viewer.drawn_objects import DrawnObjects
from asset2sim.viewer.live_object import LiveObject
from asset2sim.viewer.session import ViewerSession

Answer = TypeVar("Answer")

FRAME_S = 1.0 / 30.0
"""Time between two pictures, s."""
STEPPING_S = 0.8 * FRAME_S
"""Time of that which may go into steps, s: a slow simulation gets slower, the page does not."""
CHUNK = 4
"""Steps between two looks at the clock."""


class Commands:
    """A queue of commands, carried out in the order in which they came."""

    def __init__(self) -> None:
        self._waiting: queue.SimpleQueue[Callable[[], object]] = queue.SimpleQueue()

    def put(self, command: Callable[[], object]) -> None:
        """Have a command carried out."""
        self._waiting.put(command)

    def ask(self, question: Callable[[], Answer], timeout_s: float = 60.0) -> Answer:
        """The answer to a question asked in the other thread. Raises what it raises, TimeoutError where it is late."""
        answer: Future[Answer] = Future()

        def reply() -> None:
            try:
                answer.set_result(question())
            except Exception as error:
                answer.set_exception(error)

        self.put(reply)
        return answer.result(timeout_s)

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


class LivePage(ABC):
    """One page on one server, its thread run in a ``with`` block. Wishes become commands; all else is the thread's."""

    def __init__(self, server: viser.ViserServer, name: str) -> None:
        self.server, self.commands, self.ended = server, Commands(), threading.Event()
        self.session: ViewerSession | None = None
        self.stage = DrawnObjects(server, self.grabbed)
        server.on_client_connect(lambda client: self.commands.put(lambda: self.stage.look(client)))
        self.thread = threading.Thread(target=self._run, name=f"asset2sim-{name}", daemon=True)

    @property
    def address(self) -> str:
        """Where the page is."""
        return f"http://{self.server.get_host()}:{self.server.get_port()}"

    def __enter__(self) -> Self:
        self.commands.put(self.show_first)
        self.thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.ended.set()
        self.thread.join()

    def wait(self) -> None:
        """Until the thread has ended."""
        # Waiting without an end would not hear Ctrl-C on every system.
        while not self.ended.wait(1.0):
            pass

    @abstractmethod
    def grabbed(self, side: str, phase: str, link: str, held: Array, target: Array) -> None:
        """A part is dragged on the page: see ``Grabbed``."""

    # The simulation's thread.

    @abstractmethod
    def show_first(self) -> None:
        """Show what the page begins with."""

    @abstractmethod
    def show_frame(self, late: float, began: float) -> float:
        """Simulate ``late`` seconds, as far as the picture begun then has time, and draw; what is left over, s."""

    @abstractmethod
    def failed(self, error: Exception) -> None:
        """Hear of a command or a picture that failed."""

    def close(self) -> None:
        """Let go of what is simulated and drawn."""
        self.stage.clear()
        if self.session is not None:
            self.session.__exit__(None, None, None)
            self.session = None

    def _run(self) -> None:
        before, late = time.perf_counter(), 0.0
        while not self.ended.is_set():
            self.commands.obey(self.failed)
            began = time.perf_counter()
            late, before = late + began - before, began
            try:
                late = self.show_frame(late, began)
            except Exception as error:  # whatever an engine or a page does, the loop goes on
                self.failed(error)
            self.ended.wait(max(0.0, began + FRAME_S - time.perf_counter()))
        self.close()


def step_for(session: ViewerSession, seconds: float, timestep_s: float, began: float) -> tuple[int, int]:
    """Simulate so many seconds, as far as the picture begun then has time; the steps to be done, and those done."""
    count, done = math.floor(seconds / timestep_s), 0
    while done < count and time.perf_counter() - began < STEPPING_S:
        some = min(CHUNK, count - done)
        session.each(LiveObject.step, some)
        done += some
    return count, done
