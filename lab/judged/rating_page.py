"""The controls of the rating page. Nothing that is put here names a method, a folder or a file of one."""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Protocol

import viser

from asset2sim.viewer.words import escaped
from lab.judged.rating_plan import SCORES, STAGES, RatingStage, Shown

MOST_NAME = 64
"""Characters of a rater's name."""
BEGIN, START, RESET, NEXT, STORE, LEAVE = "Begin", "Start", "Reset", "Next", "Store, and the next", "Another rater"
HELLO = """#### Rating objects
Each object comes in several variants, in no particular order. You look at each, watch it left alone, and push it. Each
time you give a score from **0** (broken) to **10** (like the real thing), and one in all at the end.

Whoever comes back under the same name goes on where they left.
"""
NO_SCORE = "*no score yet*"
BROKEN = "This variant does not move: the simulator refuses it, or it flew apart. Rate it as it is; Reset may mend it."
UNSEEN = "This variant cannot be shown. Rate it 0."
UNSTORED = "The rating is not stored: its folder cannot be written to. Ask whoever runs this page, and try again."
AGAIN = "Something went wrong here; whoever runs this page finds it in the log. Try again."
NAMELESS = "A name or a code is needed: ratings are told apart by it."


class RaterWishes(Protocol):
    """Requests of a rater; each may be called in any thread, and is done in the simulation's."""

    def begin(self, rater: str) -> None:
        """Start or go on rating as this rater."""

    def start(self) -> None:
        """Let the variant be simulated."""

    def reset(self) -> None:
        """Put the variant back into its initial state."""

    def go_on(self, score: float) -> None:
        """Keep the score of this stage, and go to the next."""

    def store(self, score: float, note: str) -> None:
        """Store the variant's scores, and go to the next variant."""

    def leave(self) -> None:
        """Let another rater begin."""


class RatingPage:
    """The controls of one server: one of several screens at a time."""

    def __init__(self, server: viser.ViserServer, wishes: RaterWishes) -> None:
        self.gui, self.wishes = server.gui, wishes
        self.gui.main_panel.dock_right()
        self.gui.configure_theme(show_logo=False, show_share_button=False, control_width="large")
        self.handles: list[Any] = []
        self.score: int | None = None
        self.problem = self.gui.add_markdown("", visible=False)
        self.clock: Any = None
        self.bar: Any = None
        self.start: Any = None
        self.on: Any = None
        self.scores: Any = None
        self.may_go_on = True

    def ask_who(self) -> None:
        """Ask who rates."""
        self._clear()
        self._add(self.gui.add_markdown(HELLO))
        name = self._add(self.gui.add_text("Your name or code", ""))
        self._button(BEGIN, lambda: self.wishes.begin(name.value.strip().casefold()[:MOST_NAME]))

    def draw(self) -> None:
        """Say that an object is being drawn: nothing can be scored before it is seen."""
        self._clear()
        self._add(self.gui.add_markdown("The next object is being drawn …"))

    def show_stage(self, stage: RatingStage, where: str, asked: str) -> None:
        """Show one stage of a variant; a clock runs in the second and third."""
        self._clear()
        looks = "\n".join(f"- {line}" for line in stage.looks)
        self._add(self.gui.add_markdown(f"{where}\n\n{asked}\n\n---\n**{stage.title}.** {stage.does}\n\n{looks}"))
        first, second, _ = STAGES
        if stage is not first:
            self.clock = self._add(self.gui.add_markdown(""))
            self.bar = self._add(self.gui.add_progress_bar(0.0))
            self.start = self._button(START, self.wishes.start)
            if stage is not second:
                self._button(RESET, self.wishes.reset, color="gray")
        self._ask_score()
        self.on = self._button(NEXT, self._go_on, disabled=True)
        if stage is first:
            self._button(LEAVE, self.wishes.leave, color="gray")
        self.wait(stage is first)

    def show_end(self, where: str, given: Sequence[float]) -> None:
        """Ask for the score in all."""
        self._clear()
        named = ", ".join(
            f"{name} **{score:g}**" for name, score in zip(("before", "alone", "pushed"), given, strict=True)
        )
        self._add(self.gui.add_markdown(f"{where}\n\n---\n**In all.** You gave: {named}."))
        self._ask_score()
        note = self._add(self.gui.add_text("Note", "", multiline=True))
        self.on = self._button(STORE, lambda: self._store(note.value.strip()), disabled=True)
        self.wait(True)

    def thank(self, count: int) -> None:
        """Say that all is rated."""
        self._clear()
        self._add(self.gui.add_markdown(f"#### Thank you\n\nYou have rated all {count} variants."))
        self._button(LEAVE, self.wishes.leave)

    def tell(self, line: str) -> None:
        """Show a line of what went wrong; none where it is empty."""
        if self.problem.content != (content := f"⚠ {escaped(line)}" if line else ""):
            self.problem.content, self.problem.visible = content, bool(line)

    def show_clock(self, seconds: float, least: float, whole: float, running: bool) -> None:
        """Show how far the stage's clock is, and from when to when it runs, s."""
        if self.clock is None:
            return
        span = minutes(whole) if least == whole else f"{minutes(least)} to {minutes(whole)}"
        said = f"**{minutes(seconds)}** of {span}"
        if self.clock.content != said:
            self.clock.content, self.bar.value = said, min(100.0, 100.0 * seconds / whole)
        if self.start.disabled != running:
            self.start.disabled = running

    def wait(self, may_go_on: bool) -> None:
        """Let the rater go on, or not yet; a score must be given too."""
        self.may_go_on = may_go_on
        if self.on is not None and self.on.disabled != (disabled := not may_go_on or self.score is None):
            self.on.disabled = disabled

    def _ask_score(self) -> None:
        self.scores = self._add(self.gui.add_markdown(f"**Score**: {NO_SCORE}"))
        for some in (SCORES[:6], SCORES[6:]):
            group = self._add(self.gui.add_button_group("", [str(score) for score in some]))
            self._when(group, partial(self._give, group))

    def _give(self, group: Any) -> None:
        self.score = int(group.value)
        self.scores.content = f"**Score**: **{self.score}** of 10"
        self.wait(self.may_go_on)

    def _go_on(self) -> None:
        if self.score is not None and self.may_go_on:
            self.wishes.go_on(float(self.score))

    def _store(self, note: str) -> None:
        if self.score is not None:
            self.wishes.store(float(self.score), note)

    def _clear(self) -> None:
        for handle in self.handles:
            handle.remove()
        self.handles, self.score = [], None
        self.clock = self.bar = self.start = self.on = self.scores = None
        self.tell("")

    def _add(self, handle: Any) -> Any:
        self.handles.append(handle)
        return handle

    def _button(self, label: str, act: Callable[[], None], **options: Any) -> Any:
        button = self._add(self.gui.add_button(label, **options))
        self._when(button, act)
        return button

    def _when(self, control: Any, act: Callable[[], None]) -> None:
        # A coroutine: others are called in no order. What the server itself sets has no client.
        async def called(event: Any) -> None:
            if event.client_id is not None:
                act()

        control.on_click(called)


def minutes(seconds: float) -> str:
    """Whole seconds as on a clock."""
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"


def where_of(shown: Shown, name: str, plan: Sequence[Shown]) -> str:
    """Where a rater is, in Markdown: which object of how many, and which of its variants."""
    assets = list(dict.fromkeys(item.asset_id for item in plan))
    beside = [item.label for item in plan if item.asset_id == shown.asset_id]
    return (
        f"#### {escaped(name)}, variant {shown.label}\nobject {assets.index(shown.asset_id) + 1} of {len(assets)}, "
        f"variant {beside.index(shown.label) + 1} of {len(beside)}"
    )
