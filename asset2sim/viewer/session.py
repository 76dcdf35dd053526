"""A refined object and the raw one in step: what is done to one is done to both, and one that breaks stands still."""

from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, ExitStack
from dataclasses import replace
from types import TracebackType
from typing import Concatenate, ParamSpec, Self

from asset2sim.engines.console import captured_console
from asset2sim.experiments.isolation import Ending
from asset2sim.experiments.isolation.supervise import Work, in_child
from asset2sim.viewer.live_object import ExplodedError, LiveObject, open_live_object
from asset2sim.viewer.viewed_object import ViewedObject
from schemas.errors import Asset2SimError
from schemas.settings import EngineSettings
from schemas.vocabulary import Engine

Options = ParamSpec("Options")

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

    def reset(self) -> None:
        """Every side in its initial state, also one that had broken; nothing applied."""
        for name in self.sides:
            self.problems.pop(name, None)
        self.each(LiveObject.reset)

    def moving(self) -> dict[str, LiveObject]:
        """The sides that have no problem."""
        return {name: side for name, side in self.sides.items() if name not in self.problems}

    def each(
        self, act: Callable[Concatenate[LiveObject, Options], None], *given: Options.args, **options: Options.kwargs
    ) -> None:
        """Do this with every side that moves."""
        for name in self.moving():
            self.only(name, act, *given, **options)

    def only(
        self,
        name: str,
        act: Callable[Concatenate[LiveObject, Options], None],
        *given: Options.args,
        **options: Options.kwargs,
    ) -> None:
        """Do this with one side, if it moves."""
        if name in self.moving():
            try:
                act(self.sides[name], *given, **options)
            except Exception as error:  # see above
                self.problems[name] = one_line(error)


def one_line(error: Exception) -> str:
    """An error in a line."""
    if isinstance(error, ExplodedError | Asset2SimError):
        return str(error).splitlines()[0]
    return f"{type(error).__name__}: {error}".splitlines()[0]


TRIED_STEPS = 60
"""Steps for which it must live: what crashes does so as it is loaded, or at the first contacts."""
LIMIT_S = 20.0
"""Wall time that loading and these steps may take, s."""


def why_not(subject: ViewedObject, engine: Engine, settings: EngineSettings) -> str | None:
    """A line that says why an object cannot be simulated in this process, or None: it was loaded and stepped in another
    one, and that died or hung. What an engine refuses without dying is left to the viewer's own world."""
    shown = replace(subject, source=None)  # which keeps files alive, and is not sent
    outcome = in_child(Work(live_a_little, (shown, engine, settings), LIMIT_S))
    if outcome.ending in (Ending.RETURNED, Ending.RAISED):
        return None
    return f"{engine} dies of it, so it is shown and not moved: {outcome.reason}"


def live_a_little(subject: ViewedObject, engine: Engine, settings: EngineSettings) -> None:
    """Load it and let it be, nothing applied."""
    with open_live_object(subject, engine, settings) as side:
        side.step(TRIED_STEPS)
