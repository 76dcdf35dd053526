"""The desk at which people rate: a thread that simulates an anonymous variant, leads through its stages, and stores."""

import logging
import time
from collections.abc import Sequence
from pathlib import Path

import viser

from asset2sim.catalog.own_files import OwnFile, read_own_files
from asset2sim.physics.arrays import Array
from asset2sim.viewer.live import LivePage, step_for
from asset2sim.viewer.live_object import LiveObject
from asset2sim.viewer.nodes import Overlays
from asset2sim.viewer.session import REFINED, ViewerSession
from asset2sim.viewer.viewed_object import ViewedObject
from asset2sim.viewer.walk import refined_of
from asset2sim.viewer.words import escaped
from lab.judged.rating_page import AGAIN, BROKEN, NAMELESS, UNSEEN, UNSTORED, RatingPage, where_of
from lab.judged.rating_plan import (
    STAGES,
    TOUCHED,
    UNTOUCHED,
    Durations,
    RatingPlan,
    Shown,
    Variant,
    new_keys,
    plan_for,
    rating_row,
    unrated,
)
from lab.judged.surroundings import Surroundings
from lab.schemas.tables import RATING_KEYS, RATINGS
from schemas.errors import UsageError
from schemas.settings import EngineSettings
from schemas.vocabulary import Engine

HAND_N_M = 300.0
"""Stiffness of a rater's hand, N/m: 30 N at 10 cm. It is the same for all variants: a hand that suits what it holds, as
the viewer's, would hide that a drawer weighs half a ton."""

logger = logging.getLogger(__name__)


class RatingDesk(LivePage):
    """The variants of one study on one server, for one rater after the other. Errors go into the log: they may name
    folders, and the page must not."""

    def __init__(
        self,
        out: Path | str,
        variants: Sequence[Variant],
        server: viser.ViserServer,
        engine: Engine,
        settings: EngineSettings,
        durations: Durations,
        seed: int,
    ) -> None:
        super().__init__(server, "rating")
        self.out, self.variants = out, variants
        self.engine, self.settings, self.durations, self.seed = engine, settings, durations, seed
        self.ratings, self.keys = OwnFile(out, RATINGS), OwnFile(out, RATING_KEYS)
        self.surroundings = Surroundings(server)
        self.page = RatingPage(server, self)
        self.plan: RatingPlan | None = None
        self.left: list[Shown] = []
        self.given: list[float] = []
        self.seconds, self.running, self.began = 0.0, False, 0.0
        self.touched_s = 0.0

    def begin(self, rater: str) -> None:
        self.commands.put(lambda: self._begin(rater))

    def start(self) -> None:
        self.commands.put(self._start)

    def reset(self) -> None:
        self.commands.put(self._reset)

    def go_on(self, score: float) -> None:
        # Of the stage that the page shows now: a second click must not count for the next one.
        stage = len(self.given)
        self.commands.put(lambda: self._go_on(stage, score))

    def store(self, score: float, note: str) -> None:
        shown = self.left[0] if self.left else None
        self.commands.put(lambda: self._store(shown, score, note))

    def leave(self) -> None:
        self.commands.put(self._leave)

    def grabbed(self, side: str, phase: str, link: str, held: Array, target: Array) -> None:
        """A part is dragged on the page, which counts in the third stage alone: see ``Grabbed``."""

        def done() -> None:
            if self.session is None or not self._touching:
                return
            if phase == "start":
                self.session.only(side, LiveObject.grab, link, held, even_n_m=HAND_N_M)
            self.session.each(LiveObject.drag, target)
            if phase == "end":
                self.session.each(LiveObject.release)

        self.commands.put(done)

    # The simulation's thread.

    @property
    def _touching(self) -> bool:
        return self.running and len(self.given) < len(STAGES) and STAGES[len(self.given)] is TOUCHED

    @property
    def _whole(self) -> float:
        """How long the clock of this stage runs, s."""
        return self.durations.untouched_s if len(self.given) < 2 else self.durations.most_touched_s

    @property
    def _least(self) -> float:
        """From when on the rater may go on, s."""
        return self.durations.untouched_s if len(self.given) < 2 else self.durations.least_touched_s

    @property
    def _over(self) -> bool:
        """Whether less than a step and a half is left on the clock: sums of steps are not exact."""
        return self._whole - self.seconds < 1.5 * self.settings.timestep_s

    def show_first(self) -> None:
        """Ask who rates."""
        self.page.ask_who()

    def show_frame(self, late: float, began: float) -> float:
        left = self._advance(late, began) if self.running and late < 1.0 else 0.0
        if self.session is not None:
            self.stage.move(self.session)
            self.page.show_clock(self.seconds, self._least, self._whole, self.running)
        return left

    def _advance(self, late: float, began: float) -> float:
        assert self.session is not None, "only what is open runs"
        late = min(late, self._whole - self.seconds)
        passed, left = late, 0.0
        if self.session.moving():
            count, done = step_for(self.session, late, self.settings.timestep_s, began)
            passed, left = done * self.settings.timestep_s, late - count * self.settings.timestep_s
        if not self.session.moving():
            self.page.tell(BROKEN)
        self.seconds += passed
        if self._touching:
            self.page.wait(self.seconds >= self.durations.least_touched_s)
        if self._over:
            self.running = False
            self.session.each(LiveObject.release)
            self.page.wait(True)
        return left

    def failed(self, error: Exception) -> None:
        logger.error("the rating page goes on", exc_info=error)
        self.page.tell(AGAIN)

    def _begin(self, rater: str) -> None:
        if not rater:
            self.page.tell(NAMELESS)
            return
        try:
            known = read_own_files(self.out, RATING_KEYS)
            plan = plan_for(rater, self.variants, known, self.seed)
            self.keys.add(new_keys(plan, known))
        except UsageError as error:
            logger.error("%s", error)
            self.page.tell(UNSTORED)
            return
        self.plan, self.left = plan, unrated(plan, read_own_files(self.out, RATINGS))
        self._open()

    def _leave(self) -> None:
        self.close()
        self.plan, self.left = None, []
        self.page.ask_who()

    def _open(self) -> None:
        """Show the next variant that is not rated, at rest."""
        self.close()
        assert self.plan is not None, "there is a rater"
        if not self.left:
            self.page.thank(len(self.plan.shown))
            return
        shown = self.left[0]
        self.page.draw()
        subject = self._subject(shown)
        self.session = ViewerSession({} if subject is None else {REFINED: subject}, self.engine, self.settings)
        for line in self.session.problems.values():
            logger.warning("a variant does not move: %s", line)
        if subject is not None:
            self._draw(subject, shown.label)
        self.given, self.began, self.touched_s = [], time.monotonic(), 0.0
        self._show_stage()
        if subject is None or not self.stage.nodes:
            self.page.tell(UNSEEN)
        elif not self.session.moving():
            self.page.tell(BROKEN)

    def _draw(self, subject: ViewedObject, label: str) -> None:
        assert self.session is not None, "it has just been opened"
        try:
            self.stage.show(REFINED, subject, self.session.moving().get(REFINED), 1.0, Overlays(), label)
            self.stage.arrange({REFINED: subject})
            self.surroundings.stand(self.stage)
        except Exception as error:  # an object that cannot be drawn can be rated
            logger.warning("a variant cannot be drawn", exc_info=error)

    def _subject(self, shown: Shown) -> ViewedObject | None:
        try:
            return refined_of(shown.variant.out, shown.variant.stop)
        except Exception as error:  # a failed asset may fail here in as many ways
            logger.warning("a variant cannot be read", exc_info=error)
            return None

    def _show_stage(self) -> None:
        assert self.plan is not None, "there is a rater"
        shown, self.seconds, self.running = self.left[0], 0.0, False
        # Of all variants the same words, whatever their folders say.
        first = next(item for item in self.variants if item.stop.asset_id == shown.asset_id).stop
        asked = f"*“{escaped(first.prompt)}”*" if first.prompt else ""
        where = where_of(shown, first.category, self.plan.shown)
        if len(self.given) < len(STAGES):
            self.page.show_stage(STAGES[len(self.given)], where, asked)
        else:
            self.page.show_end(where, self.given)

    def _start(self) -> None:
        if self.session is not None and 0 < len(self.given) < len(STAGES):
            if STAGES[len(self.given)] is UNTOUCHED:
                self.session.reset()
            self.seconds = 0.0 if self._over else self.seconds
            self.page.wait(False)
            self.running = True

    def _reset(self) -> None:
        if self.session is not None:
            self.session.reset()
            self.page.tell("" if self.session.moving() else BROKEN)

    def _go_on(self, stage: int, score: float) -> None:
        if stage != len(self.given) or not self.left:
            return
        if STAGES[stage] is TOUCHED:
            self.touched_s = self.seconds
        self.given.append(score)
        if self.session is not None:
            self.session.each(LiveObject.release)
        self._show_stage()

    def _store(self, shown: Shown | None, score: float, note: str) -> None:
        if shown is None or not self.left or shown is not self.left[0] or len(self.given) != len(STAGES):
            return
        assert self.plan is not None, "there is a rater"
        clocks = time.monotonic() - self.began, self.touched_s
        row = rating_row(self.plan.rater, shown, (score, *self.given), clocks, note)
        try:
            self.ratings.add([row])
        except UsageError as error:
            logger.error("%s", error)
            self.page.tell(UNSTORED)
            return
        self.left.pop(0)
        self._open()

    def close(self) -> None:
        super().close()
        self.surroundings.hide()
        self.running = False
