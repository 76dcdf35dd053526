"""The viewer: a thread that simulates in real time, does what the page wants, and draws."""

import logging
import math
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import viser

from asset2sim.catalog.failures import Review
from asset2sim.catalog.own_files import OwnFile
from asset2sim.physics.arrays import Array
from asset2sim.viewer.live import LivePage, step_for
from asset2sim.viewer.live_object import LiveObject
from asset2sim.viewer.panel import DROP, RESET, Panel, Wishes
from asset2sim.viewer.session import RAW, REFINED, ViewerSession, one_line, why_not
from asset2sim.viewer.viewed_object import ViewedObject
from asset2sim.viewer.walk import Stop, chosen_stops, raw_of, refined_of, reviews_of, stops_of
from schemas.errors import Asset2SimError, UnknownChoiceError, UsageError
from schemas.settings import EngineSettings
from schemas.tables import REVIEWS
from schemas.vocabulary import Engine

READ_S = 0.2
"""Time between two readings of the numbers, s."""

logger = logging.getLogger(__name__)


class Viewer(LivePage):
    """The pages of one output folder on one viser server."""

    def __init__(
        self, out: Path | str, server: viser.ViserServer, asset_id: str | None, engine: Engine, settings: EngineSettings
    ) -> None:
        """Raises UsageError where OUT has no catalog, or no such asset."""
        super().__init__(server, "viewer")
        self.out, self.settings = out, settings
        self.stops = stops_of(out)
        if not self.stops:
            raise UsageError(f"{out}: its catalog has no asset; refine a dataset into it first")
        self.by_id = {stop.asset_id: stop for stop in self.stops}
        if asset_id is not None and asset_id not in self.by_id:
            raise UnknownChoiceError("asset", asset_id, self.by_id)
        self.said = reviews_of(out, self.stops)
        self.reviews = OwnFile(out, REVIEWS)
        self.problems: list[str] = []
        self.now: Stop = self.by_id[asset_id] if asset_id is not None else self.stops[0]
        self.pace, self.read_at = 1.0, 0.0
        wishes = Wishes(
            self.commands, self.go, self.walk, self.choose, self.tilt, self.stage.overlay, self.act, self.put,
            self.press, self.review,
        )  # fmt: skip
        self.panel = Panel(server, wishes, engine, len(self.stops))
        self.panel.theme()

    def review(self, verdict: str) -> None:
        """Store a review of what the page shows now: at the command's turn another asset may be open."""
        stop, note, who = self.panel.stop, self.panel.note.value.strip(), self.panel.who.value.strip() or "unknown"
        if stop is not None:
            self.commands.put(lambda: self._review(stop, verdict, note, who))

    def grabbed(self, side: str, phase: str, link: str, held: Array, target: Array) -> None:
        """See ``LivePage``."""

        def done() -> None:
            session = self._session()
            if phase == "start":
                session.only(side, LiveObject.grab, link, held)
            session.each(LiveObject.drag, target)
            if phase == "end":
                session.each(LiveObject.release)

        self.commands.put(done)

    # The simulation's thread.

    def show_first(self) -> None:
        """Open the first asset."""
        self._open(self.now)

    def choose(self) -> None:
        """Walk through others, as the panel says."""
        found = self._chosen()
        if found and self.now not in found:
            self._open(found[0])
        self.panel.list(found, self.now.asset_id)
        if not found:
            self._tell([f"no {self.panel.show} here"])

    def go(self, asset_id: str | None = None) -> None:
        """Open an asset, or the same again, with the engine and the raw object as the panel says."""
        self._open(self.now if asset_id is None else self.by_id[asset_id])

    def act(self, name: str) -> None:
        """``RESET``, ``DROP`` or ``NUDGE``."""
        session = self._session()
        if name == RESET:
            session.reset()
            self.problems = []
            self.panel.rest()
        else:
            session.each(LiveObject.drop if name == DROP else LiveObject.nudge)

    def tilt(self) -> None:
        """Lean gravity as the panel says."""
        self._session().each(LiveObject.tilt, *(math.radians(slider.value) for slider in self.panel.tilts))

    def put(self, joint: str) -> None:
        """Put a joint where its slider is, in each object at the same share of its range."""
        self._session().each(LiveObject.set_share, joint, self.panel.share(joint))

    def press(self, joint: str) -> None:
        """Apply the effort of a joint's slider on the refined object: raw it may be a hundred times as heavy."""
        self._session().only(REFINED, LiveObject.set_effort, joint, self.panel.effort(joint))

    def show_frame(self, late: float, began: float) -> float:
        """See ``LivePage``."""
        late = self._advance(late, began)
        if self.session is not None:
            self.stage.move(self.session)
        if began - self.read_at > READ_S:
            self.read_at = began
            self._read()
        return late

    def failed(self, error: Exception) -> None:
        """Show the error in a line on the page; one that is not the user's mistake goes into the log in full, once."""
        line = one_line(error)
        if not isinstance(error, Asset2SimError) and line not in self.problems:
            logger.error("the viewer goes on", exc_info=error)
        self._tell([line])

    def _advance(self, late: float, began: float) -> float:
        if self.session is None or not self.panel.run.value or late > 1.0:
            return 0.0
        count, done = step_for(self.session, late, self.settings.timestep_s, began)
        if count:
            self.pace = 0.9 * self.pace + 0.1 * done / count
        return late - count * self.settings.timestep_s

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
        self.stage.touch(self.session)
        self._tell(self.problems)

    def _open(self, stop: Stop) -> None:
        self.close()
        self.now, self.problems = stop, []
        found: dict[str, ViewedObject | str] = {REFINED: self._subject(lambda: refined_of(self.out, stop))}
        refined = found[REFINED]
        if self.panel.beside.value:
            held = isinstance(refined, ViewedObject) and refined.held
            found[RAW] = self._subject(lambda: raw_of(stop, held=held))
        engine, raw = Engine(self.panel.engine.value), found.get(RAW)
        problem = why_not(raw, engine, self.settings) if isinstance(raw, ViewedObject) else None
        self.session = ViewerSession(found, engine, self.settings, {} if problem is None else {RAW: problem})
        scale = refined.scale if isinstance(refined, ViewedObject) and not self.panel.true_size.value else 1.0
        for name, subject in found.items():
            if isinstance(subject, ViewedObject):
                try:
                    side = self.session.moving().get(name)
                    self.stage.show(name, subject, side, scale if name == RAW else 1.0, self.panel.overlays)
                except Exception as error:  # an object that cannot be drawn can be simulated
                    self.problems.append(f"{name}: {one_line(error)}")
        self.stage.arrange(found)
        said = self.said.get(stop.asset_id)
        stops = self._chosen()
        self.panel.list(stops if stop in stops else (*stops, stop), stop.asset_id)
        place = f"{stops.index(stop) + 1} of {len(stops)}" if stop in stops else f"of {len(self.stops)}"
        first = self.session.sides.get(REFINED)
        self.panel.fill(stop, place, said, [] if first is None else list(first.joints.values()))
        self.tilt()
        self._tell(self.problems)

    def _subject(self, make: Callable[[], ViewedObject]) -> ViewedObject | str:
        try:
            return make()
        except Exception as error:  # a failed asset may fail here in as many ways
            return one_line(error)

    def walk(self, by: int) -> None:
        """Open the next or the previous one of those chosen."""
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
        return chosen_stops(self.stops, self.said, self.panel.show)

    def _review(self, stop: Stop, verdict: str, note: str, who: str) -> None:
        review = Review(stop.run_id, stop.asset_id, stop.method, stop.model, datetime.now(UTC), who, verdict, note)
        self.reviews.add([review.row])
        self.said = reviews_of(self.out, self.stops)
        if self.panel.on.value and self.now is stop:
            self.walk(1)
        elif self.now is stop:
            self.panel.review(self.said.get(stop.asset_id))

    def _session(self) -> ViewerSession:
        if self.session is None:
            raise UsageError("nothing is open")
        return self.session

    def _tell(self, problems: list[str]) -> None:
        self.problems = problems
        inner = {} if self.session is None else self.session.problems
        self.panel.tell([*problems, *(f"{name}: {line}" for name, line in inner.items())])
