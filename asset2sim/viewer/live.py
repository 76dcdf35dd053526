"""A loop that carries out commands, simulates in real time and draws, at a steady rate."""

import math
import time
from collections.abc import Callable
from threading import Event

from asset2sim.viewer.commands import Commands
from asset2sim.viewer.session import ViewerSession

FRAME_S = 1.0 / 30.0
"""Time between two pictures, s."""
STEPPING_S = 0.8 * FRAME_S
"""Time of that which may go into steps, s: a slow simulation gets slower, the page does not."""
CHUNK = 4
"""Steps between two looks at the clock."""


def run_live(
    commands: Commands, ended: Event, frame: Callable[[float, float], float], failed: Callable[[Exception], None]
) -> None:
    """Until ``ended``: carry out what has come, then ``frame`` with the time that is to be simulated (s) and the time
    at which the picture began; it returns what of the former is left. ``failed`` hears of each error."""
    before, late = time.perf_counter(), 0.0
    while not ended.is_set():
        commands.obey(failed)
        began = time.perf_counter()
        late, before = late + began - before, began
        try:
            late = frame(late, began)
        except Exception as error:  # whatever an engine or a page does, the loop goes on
            failed(error)
        ended.wait(max(0.0, began + FRAME_S - time.perf_counter()))


def step_for(session: ViewerSession, seconds: float, timestep_s: float, began: float) -> tuple[int, int]:
    """Simulate so many seconds, as far as there is time in the picture that began then; the steps that were to be
    done, and those that were."""
    count, done = math.floor(seconds / timestep_s), 0
    while done < count and time.perf_counter() - began < STEPPING_S:
        some = min(CHUNK, count - done)
        session.step(some)
        done += some
    return count, done
