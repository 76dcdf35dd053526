"""The page's controls: which asset, hands on it, what is drawn, its review. They say what a person wants, no more."""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, ParamSpec

import viser

from asset2sim.viewer.live import Commands
from asset2sim.viewer.live_object import Readings
from asset2sim.viewer.nodes import Overlays
from asset2sim.viewer.viewed_object import Movable
from asset2sim.viewer.walk import LatestReview, Show, Stop
from asset2sim.viewer.words import asset_choice, escaped, labels, range_ends, shown_position, table, user_name
from schemas.vocabulary import Engine

Given = ParamSpec("Given")

ENGINES = (Engine.PYBULLET, Engine.MUJOCO)
AT_ONCE = 8
"""Joints whose sliders are open; those of the others are folded away."""
TOUCHED_S = 0.8
"""Time after a person's touch in which a slider does not follow its joint, s."""
TILT_DEG = 30.0
"""Largest tilt of gravity about an axis, degrees."""
STEPS = 100
"""Least steps of a slider."""
DIGITS = {"m": 3, "rad": 1}
"""Digits after the point of a position, in cm or degrees, by the unit of the joint's."""
EFFORT_DIGITS = 3
PHONE_STYLE = """<style>@media (max-width: 36em) {
div[style*="max-height: 60%"], div[style*="max-height: 60%"] div[style*="width: 20em"] { width: 100% !important; }
div[style*="max-height: 60%"] { max-height: 50% !important; }
}</style>"""
"""On a phone viser's sheet is narrower than the page, and covers more than half of it."""
NO_ASSET = "(none)"
"""What the list offers where there is nothing to walk through."""
PREVIOUS, NEXT = "← Previous", "Next →"
RESET, DROP, NUDGE = "Reset", "Drop", "Nudge"
GOOD, BAD = "Good", "Bad"


@dataclass(frozen=True)
class Wishes:
    """Requests of a person, by an asset's id, a number of steps in the list, an act, a joint or a verdict. All but
    ``review`` are done in the simulation's thread, by ``commands``."""

    commands: Commands
    go: Callable[[str | None], None]
    walk: Callable[[int], None]
    choose: Callable[[], None]
    tilt: Callable[[], None]
    draw: Callable[[Overlays], None]
    act: Callable[[str], None]
    put: Callable[[str], None]
    press: Callable[[str], None]
    review: Callable[[str], None]


class Panel:
    """The controls of one server, shared by every browser that looks at it."""

    def __init__(self, server: viser.ViserServer, wishes: Wishes, engine: Engine, count: int) -> None:
        self.server, self.wishes = server, wishes
        gui = server.gui
        gui.main_panel.dock_right()
        gui.add_html(PHONE_STYLE)
        self.head = gui.add_markdown("")
        self.problem = gui.add_markdown("", visible=False)
        self.refusal = gui.add_markdown("", visible=False)
        steps = gui.add_button_group("Asset", (PREVIOUS, NEXT), hint="keys P and N")
        self.show_list = gui.add_dropdown("Show", tuple(Show), initial_value=Show.ALL.value)
        self.asset: Any = gui.add_dropdown("Go to", ("",), hint=f"of {count}")
        self.numbers = gui.add_markdown("")
        tabs = gui.add_tab_group()
        with tabs.add_tab("Move"):
            self._move_tab(engine)
        with tabs.add_tab("Look"):
            self._look_tab()
        with tabs.add_tab("Review"):
            self._review_tab()
        self.stop: Stop | None = None
        self.told: tuple[str, ...] = ()
        self.choices: dict[str, str] = {}
        self.more: Any = None
        self.sliders: dict[str, tuple[Movable, Any, Any]] = {}
        self.touched: dict[str, float] = {}
        self._when(steps, lambda: self._do(wishes.walk, 1 if steps.value == NEXT else -1))
        self._when(self.show_list, lambda: self._do(wishes.choose))
        self._when(self.asset, self._go)
        for label, key, act in (
            ("Next asset", "N", lambda: self._do(wishes.walk, 1)),
            ("Previous asset", "P", lambda: self._do(wishes.walk, -1)),
            ("Reset", "R", lambda: self._do(wishes.act, RESET)),
            ("Drop", "D", lambda: self._do(wishes.act, DROP)),
        ):
            self._command(label, key, act)

    def _move_tab(self, engine: Engine) -> None:
        gui, wishes = self.server.gui, self.wishes
        gui.add_markdown("Drag a part with the mouse: a spring pulls it there.")
        acts = gui.add_button_group("Do", (RESET, DROP, NUDGE))
        self._when(acts, lambda: self._do(wishes.act, acts.value))
        self.run = gui.add_checkbox("Run", True, hint="Let time pass")
        self.joints = gui.add_folder("Joints")
        self.efforts = gui.add_folder("Torques and forces", expand_by_default=False)
        with gui.add_folder("World", expand_by_default=False):
            self.engine = gui.add_dropdown("Engine", [str(item) for item in ENGINES], initial_value=str(engine))
            self._when(self.engine, lambda: self._do(wishes.go, None))
            self.tilts = tuple(
                gui.add_slider(f"Tilt {axis} °", -TILT_DEG, TILT_DEG, 0.5, 0.0, hint=f"Leans gravity about {axis}")
                for axis in "xy"
            )
            for slider in self.tilts:
                self._when(slider, lambda: self._do(wishes.tilt))

    def _look_tab(self) -> None:
        gui, wishes = self.server.gui, self.wishes
        self.beside = gui.add_checkbox("Raw beside it", True, hint="The object as it came, in step")
        self.true_size = gui.add_checkbox("Raw at its own size", False)
        for box in (self.beside, self.true_size):
            self._when(box, lambda: self._do(wishes.go, None))
        self.pieces = gui.add_checkbox("Collision pieces", False)
        self.centers = gui.add_checkbox("Centres of mass", False, hint="Larger is heavier")
        self.boxes = gui.add_checkbox("Inertia boxes", False, hint="Solid boxes of the same mass and inertia")
        self.contacts = gui.add_checkbox("Contacts", False, hint="Red where they overlap, with the depth")
        for box in (self.pieces, self.centers, self.boxes, self.contacts):
            self._when(box, lambda: self._do(wishes.draw, self.overlays))
        self.dark = gui.add_checkbox("Dark", False)
        self._when(self.dark, self.theme)

    def _review_tab(self) -> None:
        gui = self.server.gui
        self.said = gui.add_markdown("")
        self.note: Any = gui.add_text("Note", "", multiline=True)
        self.who = gui.add_text("By", user_name())
        self.on = gui.add_checkbox("Then the next", True)
        verdicts = gui.add_button_group("It is", (GOOD, BAD), hint="Stores the review in the table reviews")
        self._when(verdicts, lambda: self.wishes.review(verdicts.value.lower()))

    def theme(self) -> None:
        """Light or dark, as its box says."""
        self.server.gui.configure_theme(
            dark_mode=self.dark.value, show_logo=False, show_share_button=False, control_width="small"
        )

    @property
    def show(self) -> Show:
        """Which assets are walked through."""
        return Show(self.show_list.value)

    @property
    def overlays(self) -> Overlays:
        """Overlays to draw."""
        return Overlays(self.pieces.value, self.centers.value, self.boxes.value, self.contacts.value)

    def tell(self, problems: Sequence[str]) -> None:
        """Show what went wrong, a line each."""
        if tuple(problems) == self.told:
            return
        self.told = tuple(problems)
        self.problem.visible = bool(problems)
        self.problem.content = "\n".join(f"- ⚠ {escaped(line)}" for line in problems)

    def list(self, stops: Sequence[Stop], now: str | None) -> None:
        """Offer these assets, and show which one is open."""
        self.choices = {asset_choice(stop): stop.asset_id for stop in stops}
        names = tuple(self.choices) or (NO_ASSET,)
        if names != tuple(self.asset.options):
            self.asset.options = names
        self.asset.value = next((name for name, asset_id in self.choices.items() if asset_id == now), names[0])

    def fill(self, stop: Stop, place: str, said: LatestReview | None, joints: Sequence[Movable]) -> None:
        """Show one asset: who it is, its review, and a slider of each kind for every joint."""
        self.stop = stop
        verdict = f"**{stop.failure_mode}**: {escaped(stop.reason)}" if stop.failed else "passes every check"
        new = " (new)" if stop.new else ""
        prompt = f"\n\n*“{escaped(stop.prompt)}”*" if stop.prompt else ""
        self.head.content = (
            f"#### {escaped(stop.asset_id)}\n{escaped(stop.category)}, {place}{prompt}\n\n{verdict}{new}"
        )
        self.review(said)
        self.note.value = ""
        for _, position, effort in self.sliders.values():
            position.remove()
            effort.remove()
        if self.more is not None:
            self.more.remove()
        self.more = None
        if len(joints) > AT_ONCE:
            self.more = self.server.gui.add_folder(f"{len(joints) - AT_ONCE} more joints", expand_by_default=False)
        self.sliders, self.touched = {}, {}
        names = labels(joints)
        for number, joint in enumerate(joints):
            with self.joints if number < AT_ONCE else self.more:
                span = [shown_position(joint, end) for end in range_ends(joint)]
                position = self._slider(names[joint.name], shown_position(joint), span, DIGITS[joint.unit])
            with self.efforts:
                unit = "N" if joint.slides else "N·m"
                effort = self._slider(f"{names[joint.name]}, {unit}", 0.0, [-joint.effort, joint.effort], EFFORT_DIGITS)
            self._when(position, partial(self._put, joint.name))
            self._when(effort, partial(self._press, joint.name))
            self.sliders[joint.name] = (joint, position, effort)

    def review(self, said: LatestReview | None) -> None:
        """Show the latest review."""
        if said is None:
            self.said.content = "Not reviewed."
            return
        old = "" if said.current else " It was refined again since."
        note = f": {escaped(said.note)}" if said.note else ""
        self.said.content = f"**{said.verdict}**{note} ({escaped(said.reviewer)}, {said.at:%Y-%m-%d %H:%M} UTC).{old}"

    def read(self, readings: Mapping[str, Readings], positions: Mapping[str, float], pace: float) -> None:
        """Show the live numbers of each object; sliders follow the joints (rad or m) of the refined one."""
        if readings:
            names = {name: f"{joint.label} {name}, {joint.unit}/s" for name, (joint, *_) in self.sliders.items()}
            self.numbers.content = table(readings, names, pace)
        now = time.monotonic()
        for name, (joint, slider, _) in self.sliders.items():
            if name in positions and now - self.touched.get(name, 0.0) > TOUCHED_S:
                low, high = (shown_position(joint, end) for end in range_ends(joint))
                slider.value = (
                    round(min(max(shown_position(joint, positions[name]), low), high), DIGITS[joint.unit]) + 0.0
                )

    def share(self, joint: str) -> float:
        """Where a joint's slider is in its range, 0 to 1."""
        item, slider, _ = self.sliders[joint]
        low, high = (shown_position(item, end) for end in range_ends(item))
        return float((slider.value - low) / (high - low))

    def effort(self, joint: str) -> float:
        """A joint's effort, as its slider says, N or N·m."""
        return float(self.sliders[joint][2].value)

    def rest(self) -> None:
        """Effort sliders at zero."""
        for _, _, slider in self.sliders.values():
            slider.value = 0.0

    def _put(self, joint: str) -> None:
        if self._reaches(self.sliders[joint][1]):
            self.touched[joint] = time.monotonic()
            self._do(self.wishes.put, joint)
        # Else the slider follows its joint again.

    def _press(self, joint: str) -> None:
        slider = self.sliders[joint][2]
        if not self._reaches(slider):
            slider.value = 0.0
        self._do(self.wishes.press, joint)

    def _reaches(self, slider: Any) -> bool:
        """Whether a slider's value is in its range: one that is typed may be beyond, which is said."""
        within = bool(slider.min <= slider.value <= slider.max)
        self.refusal.visible = not within
        if not within:
            span = f"{slider.min:g} to {slider.max:g}"
            self.refusal.content = f"- ⚠ {escaped(slider.label)}: {slider.value:g} is refused, it goes from {span}"
        return within

    def _go(self) -> None:
        if self.asset.value in self.choices:
            self._do(self.wishes.go, self.choices[self.asset.value])

    def _slider(self, label: str, value: float, span: Sequence[float], digits: int) -> Any:
        low, high = (round(end, digits) for end in span)
        high = max(high, low + 10.0**-digits)
        step = 10.0 ** max(math.floor(math.log10((high - low) / STEPS)), -digits)
        return self.server.gui.add_slider(label, low, high, step, round(min(max(value, low), high), digits))

    def _command(self, label: str, key: Any, act: Callable[[], None]) -> None:
        async def called(_: Any) -> None:
            act()

        self.server.gui.add_command(label, hotkey=key).on_trigger(called)

    def _do(self, act: Callable[Given, None], *given: Given.args, **options: Given.kwargs) -> None:
        """Have it done in the simulation's thread."""
        self.wishes.commands.put(partial(act, *given, **options))

    def _when(self, control: Any, act: Callable[[], None]) -> None:
        # A coroutine: others are called in no order. What the server itself sets has no client.
        async def called(event: Any) -> None:
            if event.client_id is not None:
                act()

        (control.on_click if hasattr(control, "on_click") else control.on_update)(called)
