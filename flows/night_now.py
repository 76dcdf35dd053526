"""One night at once: by the nightly that serves the output folder, or here where none does."""

from uuid import UUID

from prefect.client.schemas.objects import State
from prefect.states import Crashed

from asset2sim.cli.console import output
from asset2sim.cli.night import complain
from asset2sim.cli.request import RefineRequest
from flows.nightly import code_of_state, nightly
from flows.serve_nightly import parameters
from schemas.errors import UsageError
from tasks.deployment import find_deployment, never_began, run_and_follow
from tasks.serving import FLOW, deployment_name


def night_elsewhere(request: RefineRequest) -> int | None:
    """Have the deployment of the request's output folder run once, and wait for it. Returns the exit code.

    None where the server knows no such deployment, or nobody serves it.
    """
    name = deployment_name(request.out)
    found = find_deployment(name)
    if found is None or found.status != "READY":
        return None
    output().print(f"{FLOW}/{name} runs now; Ctrl-C stops the waiting, not the night", markup=False, soft_wrap=True)
    run = run_and_follow(UUID(str(found.id)), parameters(request))
    if never_began(run):
        raise UsageError(f"another night of {FLOW}/{name} is at work; wait until it ends, this one was left out")
    return _told(run.state or Crashed(message="it has no state"))


def night_here(request: RefineRequest) -> int:
    """Run the flow once in this process. Returns the exit code."""
    arguments = (request.data, request.out, request.settings, request.subset, request.asset_ids, request.limit)
    state: State = nightly(*arguments, strict=request.strict, return_state=True)
    return code_of_state(state)


def _told(state: State) -> int:
    code = code_of_state(state)
    if code:
        complain(f"the night ended {state.name}: {state.message or 'without a word'}")
    else:
        output().print(state.message or "", markup=False, soft_wrap=True)
    return code
