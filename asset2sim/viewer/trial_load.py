"""An object as it came, tried in a child process before the viewer's own: files may crash an engine's native code."""

from dataclasses import replace

from asset2sim.experiments.isolation import Ending
from asset2sim.experiments.isolation.supervise import Work, in_child
from asset2sim.viewer.live_object import open_live_object
from asset2sim.viewer.viewed_object import ViewedObject
from schemas.settings import EngineSettings
from schemas.vocabulary import Engine

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
