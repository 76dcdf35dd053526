"""The viewer: a thread that simulates in real time, does what the page wants, and draws."""

import logging
import math
import queue
import threading
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import viser

from asset2sim.catalog.reviews import Review, ReviewFile
from asset2sim.physics.arrays import Array
from asset2sim.physics.kinematics import link_to_root
from asset2sim.viewer.nodes import ObjectNodes
from asset2sim.viewer.panel import DROP, NUDGE, RESET, Panel
from asset2sim.viewer.session import RAW, REFINED, Session, one_line
from asset2sim.viewer.shapes import shapes_of
from asset2sim.viewer.subject import Subject
from asset2sim.viewer.walk import Stop, chosen, raw_of, refined_of, reviews_of, stops_of
from schemas.errors import Asset2SimError, UnknownChoiceError, UsageError
from schemas.settings import EngineSettings
from schemas.vocabulary import Engine

FRAME_S = 1.0 / 30.0
"""Time between two pictures, s."""
STEPPING_S = 0.8 * FRAME_S
"""Time of that which may go into steps, s: a slow simulation gets slower, the page does not."""
READ_S = 0.2
"""Time between two readings of the numbers, s."""
CHUNK = 4
"""Steps between two looks at the clock."""
GAP = 0.35
"""Room between the two objects, as a share of the larger one."""
LOOK_FROM = np.array([-1.0, -0.55, 0.55])
"""Where the camera stands, seen from the object: PartNet-Mobility's objects face -x."""
FOV_RAD = math.radians(40.0)
"""The camera's vertical field of view."""
LEAST_ASPECT = 0.5
"""Width over height of the narrowest page that the camera's distance is suited to."""

logger = logging.getLogger(__name__)


class Viewer:
    """One OUT on one server. ``Wishes`` puts commands into a queue; all else is of the simulation's thread."""

    def __init__(
        self, out: Path | str, server: viser.ViserServer, asset_id: str | None, engine: Engine, settings: EngineSettings
    ) -> None:
        """Raises UsageError where OUT has no catalog, or no such asset."""
        self.out, self.server, self.settings = out, server, settings
        self.stops = stops_of(out)
        if not self.stops:
            raise UsageError(f"{out}: its catalog has no asset; refine a dataset into it first")
        self.by_id = {stop.asset_id: stop for stop in self.stops}
        if asset_id is not None and asset_id not in self.by_id:
            raise UnknownChoiceError("asset", asset_id, self.by_id)
        self.said = reviews_of(out, self.stops)
        self.reviews = ReviewFile(out)
        self.wishes: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()
        self.session: Session | None = None
        self.nodes: dict[str, ObjectNodes] = {}
        self.problems: list[str] = []
        self.now: Stop = self.by_id[asset_id] if asset_id is not None else self.stops[0]
        self.pace = 1.0
        self.ended = threading.Event()
        self.panel = Panel(server, self, engine, len(self.stops))
        self.panel.theme()
        server.on_client_connect(self._connected)
        self.thread = threading.Thread(target=self._run, name="asset2sim-viewer", daemon=True)

    @property
    def address(self) -> str:
        """Where the page is."""
        return f"http://{self.server.get_host()}:{self.server.get_port()}"

    def start(self) -> None:
        """Open the first asset and simulate, in a thread."""
        self.go(self.now.asset_id)
        self.thread.start()

    def wait(self) -> None:
        """Until it is stopped."""
        # Waiting without an end would not hear Ctrl-C on every system.
        while not self.ended.wait(1.0):
            pass

    def stop(self) -> None:
        """End the thread."""
        self.ended.set()
        self.thread.join()

    def ask(self, question: Callable[[], Any], timeout_s: float = 60.0) -> Any:
        """The answer to a question that is asked in the simulation's thread, between two steps. Raises what it
        raises."""
        answer: queue.SimpleQueue[tuple[Any, Exception | None]] = queue.SimpleQueue()

        def put() -> None:
            try:
                answer.put((question(), None))
            except Exception as error:
                answer.put((None, error))

        self.wishes.put(put)
        value, error = answer.get(timeout=timeout_s)
        if error is not None:
            raise error
        return value

    # What the page wants.

    def go(self, asset_id: str) -> None:
        """See ``Wishes``."""
        self.wishes.put(lambda: self._open(self.by_id[asset_id]))

    def walk(self, by: int) -> None:
        """See ``Wishes``."""
        self.wishes.put(lambda: self._walk(by))

    def choose(self) -> None:
        """See ``Wishes``."""

        def begin() -> None:
            found = self._chosen()
            if found and self.now not in found:
                self._open(found[0])
            self.panel.list(found, self.now.asset_id)
            if not found:
                self._tell([f"no {self.panel.show} here"])

        self.wishes.put(begin)

    def again(self) -> None:
        """See ``Wishes``."""
        self.wishes.put(lambda: self._open(self.now))

    def act(self, name: str) -> None:
        """See ``Wishes``."""

        def done() -> None:
            session = self._session()
            {RESET: session.reset, DROP: session.drop, NUDGE: session.nudge}[name]()
            if name == RESET:
                self.panel.rest()

        self.wishes.put(done)

    def tilt(self) -> None:
        """See ``Wishes``."""
        x, y = (math.radians(slider.value) for slider in self.panel.tilts)
        self.wishes.put(lambda: self._session().tilt(x, y))

    def put(self, joint: str) -> None:
        """See ``Wishes``."""
        self.wishes.put(lambda: self._session().set_position(joint, self.panel.share(joint)))

    def press(self, joint: str) -> None:
        """See ``Wishes``."""
        self.wishes.put(lambda: self._session().set_effort(joint, self.panel.effort(joint)))

    def draw(self) -> None:
        """See ``Wishes``."""
        self.wishes.put(lambda: [nodes.show(self.panel.overlays) for nodes in self.nodes.values()] and None)

    def review(self, verdict: str) -> None:
        """See ``Wishes``."""
        self.wishes.put(lambda: self._review(verdict))

    def grabbed(self, side: str, phase: str, link: str, held: Array, target: Array) -> None:
        """A part is dragged on the page: see ``Grabbed``."""

        def done() -> None:
            if phase == "start":
                self._session().grab(side, link, held)
            self._session().drag(target)
            if phase == "end":
                self._session().release()

        self.wishes.put(done)

    # The simulation's thread.

    def _run(self) -> None:
        before, read_at, late = time.perf_counter(), 0.0, 0.0
        while not self.ended.is_set():
            self._obey()
            began = time.perf_counter()
            late, before = late + began - before, began
            try:
                late = self._advance(late, began)
                self._draw()
                if began - read_at > READ_S:
                    read_at = began
                    self._read()
            except Exception as error:  # whatever an engine or a page does, the viewer goes on
                logger.exception("viewer")
                self._tell([one_line(error)])
            self.ended.wait(max(0.0, began + FRAME_S - time.perf_counter()))
        self._close()

    def _obey(self) -> None:
        while True:
            try:
                wish = self.wishes.get_nowait()
            except queue.Empty:
                return
            try:
                wish()
            except Exception as error:  # see above
                if not isinstance(error, Asset2SimError):
                    logger.exception("viewer")
                self._tell([one_line(error)])

    def _advance(self, late: float, began: float) -> float:
        """Simulate ``late`` seconds, as far as there is time; what is left of less than a step, s."""
        if self.session is None or not self.panel.run.value or late > 1.0:
            return 0.0
        count = math.floor(late / self.settings.timestep_s)
        left = late - count * self.settings.timestep_s
        done = 0
        while done < count and time.perf_counter() - began < STEPPING_S:
            some = min(CHUNK, count - done)
            self.session.step(some)
            done += some
        if count:
            self.pace = 0.9 * self.pace + 0.1 * done / count
        return left

    def _draw(self) -> None:
        if self.session is None:
            return
        for name, side in self.session.moving().items():
            nodes = self.nodes.get(name)
            if nodes is not None:
                nodes.move(side.poses())
                grip = side.grip
                nodes.show_hand(
                    side.held_at(), np.zeros(3) if grip is None else grip.target, float(np.linalg.norm(side.force))
                )

    def _read(self) -> None:
        if self.session is None:
            return
        moving = self.session.moving()
        first = moving.get(REFINED)
        self.panel.read(
            {name: side.readings() for name, side in moving.items()},
            {} if first is None else first.positions(),
            self.pace,
        )
        for name, nodes in self.nodes.items():
            if nodes.overlays.contacts and name in moving:
                nodes.show_contacts(moving[name].touches())
        self._tell(self.problems)

    def _open(self, stop: Stop) -> None:
        self._close()
        self.now, self.problems = stop, []
        found: dict[str, Subject | str] = {REFINED: self._subject(lambda: refined_of(self.out, stop))}
        refined = found[REFINED]
        if self.panel.beside.value:
            held = isinstance(refined, Subject) and refined.held
            found[RAW] = self._subject(lambda: raw_of(stop, held=held))
        self.session = Session(found, Engine(self.panel.engine.value), self.settings)
        scale = refined.scale if isinstance(refined, Subject) and not self.panel.true_size.value else 1.0
        for name, subject in found.items():
            if isinstance(subject, Subject):
                try:
                    self._show(name, subject, scale if name == RAW else 1.0)
                except Exception as error:  # an object that cannot be drawn can be simulated
                    self.problems.append(f"{name}: {one_line(error)}")
        self._arrange()
        said = self.said.get(stop.asset_id)
        stops = self._chosen()
        self.panel.list(stops if stop in stops else (*stops, stop), stop.asset_id)
        place = f"{stops.index(stop) + 1} of {len(stops)}" if stop in stops else f"of {len(self.stops)}"
        side = self.session.sides.get(REFINED)
        self.panel.fill(stop, place, said, [] if side is None else list(side.joints.values()))
        self.tilt()
        self._tell(self.problems)

    def _subject(self, make: Callable[[], Subject]) -> Subject | str:
        try:
            return make()
        except Exception as error:  # a failed asset may fail here in as many ways
            return one_line(error)

    def _show(self, name: str, subject: Subject, scale: float) -> None:
        assert self.session is not None, "an open asset has a session"
        side = self.session.moving().get(name)
        poses = link_to_root(subject.tree, subject.root, subject.start) if side is None else side.poses()
        nodes = ObjectNodes(self.server, name, shapes_of(subject.urdf, scale), poses, self.grabbed, scale)
        larger = f", drawn {100.0 * scale:.0f} % as large" if abs(scale - 1.0) > 1e-3 else ""
        nodes.label(f"{name}{larger}")
        nodes.show(self.panel.overlays)
        self.nodes[name] = nodes

    def _arrange(self) -> None:
        """Stand the objects beside each other, the raw one on the left, and look at them."""
        if not self.nodes:
            return
        size = max(nodes.size for nodes in self.nodes.values())
        left = 0.0
        for name in (REFINED, RAW):
            nodes = self.nodes.get(name)
            if nodes is None:
                continue
            low, high = nodes.box
            middle = (low + high) / 2.0
            # On a plane the ground is at zero; what is held hangs anywhere.
            side = self.session.sides.get(name) if self.session is not None else None
            floor = low[2] if side is None or side.subject.held else 0.0
            nodes.stand_at(np.array([-middle[0], left - low[1], -floor]))
            left += high[1] - low[1] + GAP * size
        self.across = left - GAP * size
        self.height = max(nodes.box[1, 2] - nodes.box[0, 2] for nodes in self.nodes.values())
        self.deep = max(nodes.box[1, 0] - nodes.box[0, 0] for nodes in self.nodes.values())
        self.server.scene.add_grid(
            "/ground",
            infinite_grid=True,
            cell_size=0.1,
            section_size=1.0,
            fade_distance=6.0 * size,
            position=(0.0, 0.0, -1e-3),
        )
        for client in self.server.get_clients().values():
            self._look(client)

    def _connected(self, client: viser.ClientHandle) -> None:
        self.wishes.put(lambda: self._look(client))

    def _look(self, client: viser.ClientHandle) -> None:
        if not self.nodes:
            return
        target = np.array([0.0, self.across / 2.0, self.height / 2.0])
        aspect = max(client.camera.aspect, LEAST_ASPECT)
        radius = max(self.height / 2.0 + 0.3 * self.deep, (self.across / 2.0 + 0.3 * self.deep) / aspect)
        away = 1.35 * radius / math.tan(FOV_RAD / 2.0) + self.deep / 2.0
        with client.atomic():
            client.camera.fov = FOV_RAD
            # In this order: a camera that is moved goes on looking the same way.
            client.camera.position = target + away * LOOK_FROM / np.linalg.norm(LOOK_FROM)
            client.camera.look_at = target

    def _walk(self, by: int) -> None:
        stops = self._chosen()
        if not stops:
            self._tell([f"no {self.panel.show} here"])
            return
        # Reviewed, the open one may have left the list: go on from where it stood.
        ids = [stop.asset_id for stop in stops]
        if self.now in stops:
            place = stops.index(self.now) + by
        else:
            after = sum(asset_id < self.now.asset_id for asset_id in ids)
            place = after if by > 0 else after - 1
        self._open(stops[place % len(stops)])

    def _chosen(self) -> tuple[Stop, ...]:
        return chosen(self.stops, self.said, self.panel.show)

    def _review(self, verdict: str) -> None:
        stop = self.now
        note, who = self.panel.note.value.strip(), self.panel.who.value.strip() or "unknown"
        review = Review(stop.run_id, stop.asset_id, stop.method, stop.model, datetime.now(UTC), who, verdict, note)
        self.reviews.add(review)
        self.said = reviews_of(self.out, self.stops)
        self.panel.review(self.said.get(stop.asset_id))
        if self.panel.on.value:
            self._walk(1)

    def _session(self) -> Session:
        if self.session is None:
            raise UsageError("nothing is open")
        return self.session

    def _tell(self, problems: list[str]) -> None:
        self.problems = problems
        inner = {} if self.session is None else self.session.problems
        self.panel.tell([*problems, *(f"{name}: {line}" for name, line in inner.items())])

    def _close(self) -> None:
        for nodes in self.nodes.values():
            nodes.remove()
        self.nodes = {}
        if self.session is not None:
            self.session.__exit__(None, None, None)
            self.session = None
