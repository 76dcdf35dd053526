"""A refined object and the raw one in step: what is done to one is done to both, and one that breaks stands still."""

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, ExitStack
from types import TracebackType
from typing import Self

from asset2sim.engines.console import captured_console
from asset2sim.physics.arrays import Array
from asset2sim.viewer.live_object import ExplodedError, LiveObject, open_live_object
from asset2sim.viewer.viewed_object import ViewedObject
from schemas.errors import Asset2SimError
from schemas.settings import EngineSettings
from schemas.vocabulary import Engine

REFINED, RAW = "refined", "raw"


class ViewerSession(AbstractContextManager["ViewerSession"]):
    """Sides by name, ``REFINED`` first; ``problems`` says in a line why one does not move. Use it in one thread."""

    def __init__(
        self,
        subjects: Mapping[str, ViewedObject | str],
        engine: Engine,
        settings: EngineSettings,
        unmoved: Mapping[str, str] | None = None,
    ) -> None:
        """A subject may be a line that says why there is none; of those in ``unmoved`` one says why it is not tried."""
        self.engine, self.settings = engine, settings
        self.sides: dict[str, LiveObject] = {}
        self.problems: dict[str, str] = {}
        self._open = ExitStack()
        for name, subject in subjects.items():
            if isinstance(subject, str):
                self.problems[name] = subject
                continue
            if unmoved and name in unmoved:
                self.problems[name] = unmoved[name]
                continue
            try:
                # PyBullet prints when it is connected to.
                with captured_console():
                    self.sides[name] = self._open.enter_context(open_live_object(subject, engine, settings))
            except Exception as error:  # an engine raises what it likes, and the other object goes on
                self.problems[name] = one_line(error)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._open.close()

    def step(self, count: int = 1) -> None:
        """Advance every side that moves by that many time steps."""
        self._each(lambda side, _: side.step(count))

    def reset(self) -> None:
        """Every side in its initial state, also one that had broken; nothing applied."""
        for name in self.sides:
            self.problems.pop(name, None)
        self._each(lambda side, _: side.reset())

    def drop(self) -> None:
        """Let both fall from the height of the drop check."""
        self._each(lambda side, _: side.drop())

    def nudge(self) -> None:
        """Nudge all joints."""
        self._each(lambda side, _: side.nudge())

    def tilt(self, about_x_rad: float, about_y_rad: float) -> None:
        """Lean gravity."""
        self._each(lambda side, _: side.tilt(about_x_rad, about_y_rad))

    def set_position(self, joint: str, share: float) -> None:
        """Put one joint at a share (0 to 1) of its range, in each object of its own range."""

        def put(side: LiveObject, _: str) -> None:
            if joint in side.joints:
                found = side.joints[joint]
                side.set_position(joint, found.lower + share * (found.upper - found.lower))

        self._each(put)

    def set_effort(self, joint: str, effort: float) -> None:
        """Apply an effort (N·m or N) on one joint of the refined object: raw it may be a hundred times as heavy."""
        self._each(lambda side, _: side.set_effort(joint, effort), only=REFINED)

    def grab(self, name: str, link: str, point: Array, even_n_m: float | None = None) -> None:
        """Take hold of a link of one object at a (3,) point in its world, by a spring that suits it or by an even one
        (see ``LiveObject.hand``)."""
        self._each(lambda side, _: side.grab(link, point, even_n_m=even_n_m), only=name)

    def drag(self, target: Array) -> None:
        """Move the hand."""
        self._each(lambda side, _: side.drag(target))

    def release(self) -> None:
        """Let go."""
        self._each(lambda side, _: side.release())

    def moving(self) -> dict[str, LiveObject]:
        """The sides that have no problem."""
        return {name: side for name, side in self.sides.items() if name not in self.problems}

    def _each(self, act: Callable[[LiveObject, str], None], only: str | None = None) -> None:
        for name, side in self.moving().items():
            if only is None or name == only:
                try:
                    act(side, name)
                except Exception as error:  # see above
                    self.problems[name] = one_line(error)


def one_line(error: Exception) -> str:
    """An error in a line."""
    if isinstance(error, ExplodedError | Asset2SimError):
        return str(error).splitlines()[0]
    return f"{type(error).__name__}: {error}".splitlines()[0]
