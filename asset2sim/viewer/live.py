"""A live page: commands of its visitors, carried out in the one thread that simulates in real time and draws."""

import math
import queue
import threading
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from types import TracebackType
from typing import Self, TypeVar

import numpy as np
import viser

from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import link_to_root
from asset2sim.viewer.live_object import LiveObject
from asset2sim.viewer.nodes import Grabbed, ObjectNodes, Overlays
from asset2sim.viewer.session import RAW, REFINED, ViewerSession
from asset2sim.viewer.shapes import shapes_of
from asset2sim.viewer.viewed_object import ViewedObject

GAP = 0.35
"""Room between the two objects, as a share of the larger one."""
LOOK_FROM = np.array([-1.0, -0.55, 0.55])
"""Where the camera stands, seen from the object: PartNet-Mobility's objects face -x."""
FOV_RAD = math.radians(40.0)
"""The camera's vertical field of view."""
PORTRAIT = 0.75
"""Width over height of a page below which it is a phone's."""


class DrawnObjects:
    """The objects that are drawn, by name. The raw one stands on the left."""

    def __init__(self, server: viser.ViserServer, grabbed: Grabbed) -> None:
        self.server, self.grabbed = server, grabbed
        self.nodes: dict[str, ObjectNodes] = {}
        self.across = self.height = self.deep = 0.1

    def show(
        self,
        name: str,
        subject: ViewedObject,
        side: LiveObject | None,
        scale: float,
        overlays: Overlays,
        title: str = "",
    ) -> None:
        """Draw one object ``scale`` times as large as it is; in its initial state where it has no ``side`` that moves.
        The ``title`` above it is its name unless stated. Raises AssetError for a URDF that cannot be read."""
        poses = link_to_root(subject.tree, subject.root, subject.start) if side is None else side.poses()
        nodes = ObjectNodes(self.server, name, shapes_of(subject.urdf, scale), poses, self.grabbed, scale)
        title = title or name
        nodes.label(title if abs(scale - 1.0) < 1e-3 else f"{title}, drawn {100.0 * scale:.0f} % as large")
        nodes.show(overlays)
        self.nodes[name] = nodes

    def overlay(self, overlays: Overlays) -> None:
        """Draw these overlays."""
        for nodes in self.nodes.values():
            nodes.show(overlays)

    def move(self, session: ViewerSession) -> None:
        """Draw everything where it is now."""
        for name, side in session.moving().items():
            nodes = self.nodes.get(name)
            if nodes is not None:
                nodes.move(side.poses())
                target = np.zeros(3) if side.grip is None else side.grip.target
                nodes.show_hand(side.held_at(), target, float(np.linalg.norm(side.force)))

    def touch(self, session: ViewerSession) -> None:
        """Draw the contacts where they are asked for."""
        for name, side in session.moving().items():
            nodes = self.nodes.get(name)
            if nodes is not None and nodes.overlays.contacts:
                nodes.show_contacts(side.touches())

    def arrange(self, subjects: Mapping[str, ViewedObject | str]) -> None:
        """Stand the objects beside each other, and look at them."""
        if not self.nodes:
            return
        size = max(nodes.size for nodes in self.nodes.values())
        left = 0.0
        for name in (REFINED, RAW):
            nodes = self.nodes.get(name)
            if nodes is None:
                continue
            low, high = nodes.box
            subject = subjects[name]
            # On a plane the ground is at zero; what is held hangs anywhere.
            floor = low[2] if isinstance(subject, str) or subject.held else min(low[2], 0.0)
            nodes.stand_at(np.array([-(low[0] + high[0]) / 2.0, left - low[1], -floor]))
            left += high[1] - low[1] + GAP * size
        boxes = [nodes.box[1] - nodes.box[0] for nodes in self.nodes.values()]
        self.across = left - GAP * size
        self.deep, _, self.height = (max(box[axis] for box in boxes) for axis in range(3))
        self.server.scene.add_grid(
            "/ground",
            infinite_grid=True,
            cell_size=0.1,
            section_size=1.0,
            fade_distance=6.0 * size,
            # A little lower than the objects stand, or their undersides and the lines would flicker.
            position=(0.0, 0.0, -0.002 * size),
        )
        for client in self.server.get_clients().values():
            self.look(client)

    def look(self, client: viser.ClientHandle) -> None:
        """Turn one browser's camera to the objects."""
        if not self.nodes:
            return
        target = np.array([0.0, self.across / 2.0, self.height / 2.0])
        aspect, slope = client.camera.aspect, math.tan(FOV_RAD / 2.0)
        radius = max(self.height / 2.0 + 0.3 * self.deep, (self.across / 2.0 + 0.3 * self.deep) / aspect)
        away = 1.3 * radius / slope + self.deep / 2.0
        if aspect < PORTRAIT:
            # The controls cover the lower half.
            target[2] -= 0.5 * away * slope
        with client.atomic():
            client.camera.fov = FOV_RAD
            # In this order: a camera that is moved goes on looking the same way.
            client.camera.position = target + away * LOOK_FROM / np.linalg.norm(LOOK_FROM)
            client.camera.look_at = target

    def clear(self) -> None:
        """Take all objects off the page."""
        for nodes in self.nodes.values():
            nodes.remove()
        self.nodes = {}


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


class LivePage(ABC):
    """One page on one server; in a ``with`` block its thread runs. What the page wants becomes commands; all else is of
    that thread."""

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
        """Simulate ``late`` seconds, as far as there is time in the picture that began then, and draw; what is left of
        less than a step, s."""

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
    """Simulate so many seconds, as far as there is time in the picture that began then; the steps that were to be
    done, and those that were."""
    count, done = math.floor(seconds / timestep_s), 0
    while done < count and time.perf_counter() - began < STEPPING_S:
        some = min(CHUNK, count - done)
        session.each(LiveObject.step, some)
        done += some
    return count, done
