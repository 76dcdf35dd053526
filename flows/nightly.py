"""One night: refine the dataset, run the hook, and return a Prefect state that says how it went. ``asset2sim nightly``
serves it on ``catalog.yaml``'s schedule (``flows.serve_nightly``), and ``prefect.yaml`` deploys it to a work pool."""

from contextlib import suppress
from pathlib import Path
from typing import Any

from prefect import Flow, flow
from prefect.client.schemas.objects import FlowRun, State
from prefect.states import Cancelled, Completed, Failed

from asset2sim.experiments.interrupt import sigterm_deferred
from asset2sim.runs.request import settings_for_run
from asset2sim.runs.result import INTERRUPTED, RunResult, alert_error, exit_code, missed_gates
from flows.refine_dataset import alert, opaque, refine_dataset
from flows.run_report import night_line, print_night
from flows.server.night_secrets import with_secrets
from schemas.errors import DONE, FAILED, GATE, MISTAKE, STOPPED, Asset2SimError, UsageError, complain, error_exit_code
from schemas.location import Location
from schemas.settings import Settings

REFUSED = "Refused"
"""Name of the state of a night that could not start as asked."""
MISSED_GATE = "MissedGate"
"""Name of the state of a night that finished and missed a gate."""


def run_crash_hook(flow: Flow[..., Any], flow_run: FlowRun, state: State) -> None:
    """Run the hook for a night whose process ended without a result: killed, or out of memory."""
    settings = Settings.model_validate(flow_run.parameters.get("settings") or {})
    with suppress(UsageError):
        settings = with_secrets(settings, flow_run.parameters.get("secrets"))
        settings = tonight(settings, flow_run.parameters.get("settings_file"))
    error = Asset2SimError(state.message or "the night's process ended without a word")
    warning = alert_error(Location(flow_run.parameters["out"]), settings.run, error)
    for message in (str(error), warning):
        if message is not None:
            complain(message)


@flow(name="nightly", persist_result=False, on_crashed=[run_crash_hook])
def nightly(
    data: Location,
    out: Location,
    settings: Settings | None = None,
    subset: str | None = None,
    asset_ids: tuple[str, ...] = (),
    limit: int | None = None,
    strict: bool = False,
    settings_file: Path | None = None,
    secrets: str | None = None,
) -> State:
    """Refine ``data`` into ``out`` as ``refine_dataset`` does. The state's message is the night in one line.
    ``settings_file`` is read now, and what ``settings`` states goes before it; ``secrets`` names where theirs are. The
    night fails where the run does or a gate is missed, and under ``strict`` where an asset does."""
    chosen = settings or Settings()
    with sigterm_deferred():
        try:
            chosen = tonight(with_secrets(chosen, secrets), settings_file)
            result = refine_dataset(data, out, chosen, subset, asset_ids, limit)
        except (Exception, KeyboardInterrupt) as error:
            return _state_without_result(out, chosen, error)
        told = alert(opaque(result), strict)
        print_night(told)
        return state_of(told, strict)


def tonight(settings: Settings, file: Path | str | None) -> Settings:
    """The settings of a night: as stated, else as the file has them now. Raises UsageError for a broken file."""
    if file is None:
        return settings
    return settings_for_run(Path(file), settings.model_dump(exclude_unset=True))


def _state_without_result(out: Location, settings: Settings, error: BaseException) -> State:
    """Run the hook for a night without a result; raises the error again if it is a broken program's."""
    warning = alert_error(out, settings.run, error)
    if warning is not None:
        complain(warning)
    if isinstance(error, KeyboardInterrupt):
        complain(f"{INTERRUPTED} before the first asset")
        return Cancelled(message=f"{INTERRUPTED} before the first asset")
    if not isinstance(error, Asset2SimError):
        raise error
    complain(str(error))
    return Failed(name=REFUSED if error_exit_code(error) == MISTAKE else "Failed", message=str(error))


def state_of(result: RunResult, strict: bool) -> State:
    """The Prefect state of a finished night."""
    code = exit_code(result, strict)
    if code == GATE:
        return Failed(name=MISSED_GATE, message=" · ".join((*missed_gates(result), night_line(result))))
    return {DONE: Completed, STOPPED: Cancelled, FAILED: Failed}[code](message=night_line(result))


def code_of_state(state: State) -> int:
    """The exit code of a command that waited for a night."""
    if state.is_completed():
        return DONE
    if state.is_cancelled():
        return STOPPED
    return {REFUSED: MISTAKE, MISSED_GATE: GATE}.get(state.name or "", FAILED)
