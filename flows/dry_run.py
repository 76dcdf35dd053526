"""``--dry-run``: what a run would refine and why, and what that would take, on the terminal."""

from rich.text import Text

from asset2sim.catalog.text import duration, output, significant, titled_table
from asset2sim.runs.check_request import check_request, with_yardsticks
from asset2sim.runs.plan.forecast import Forecast, ForecastCost, forecast
from asset2sim.runs.remote.output import view_output
from asset2sim.runs.request import RefineRequest, bounded_by_memory
from asset2sim.storage.objects import working_folder
from flows import PIPELINE
from schemas.model_names import described
from schemas.settings import Settings

MAX_EXAMPLES = 8
"""Assets that a reason names."""


def print_dry_run(request: RefineRequest) -> None:
    """Print what a run of this request would do; writes nothing into OUT."""
    settings, sentence = bounded_by_memory(request.settings)
    data, out = request.data.absolute(), request.out.absolute()
    found = request.found or check_request(data, out, settings, request.subset, request.asset_ids, request.limit)
    refs = with_yardsticks(data, found.refs).refs
    folder, there = view_output(out, views=settings.views.write) if out.is_url else (working_folder(out), None)
    told = forecast(refs, folder, settings, PIPELINE, there)
    console = output()
    console.print(Text(f"dry run: {request.data} into {request.out}; nothing is written\n"))
    if told.reasons:
        table = titled_table(f"{len(told.plan.todo)} of {len(found.refs)} assets would be refined")
        table.add_column("why", overflow="fold")
        table.add_column("assets", justify="right", no_wrap=True)
        table.add_column("for example", overflow="fold")
        for why, ids in sorted(told.reasons.items(), key=lambda item: -len(item[1])):
            more = ", …" if len(ids) > MAX_EXAMPLES else ""
            table.add_row(Text(why), str(len(ids)), Text(", ".join(ids[:MAX_EXAMPLES]) + more))
        console.print(table)
    for line in [*unchanged_lines(told), *expected_lines(told.expected, settings, len(told.plan.todo)), sentence]:
        if line is not None:
            console.print(Text(line))


def unchanged_lines(told: Forecast) -> list[str]:
    """How many assets would be left as they are, failed ones among them."""
    if not told.plan.unchanged:
        return []
    failing = f", {len(told.failing)} of them failed (--retry-failed tries those again)" if told.failing else ""
    return [f"{len(told.plan.unchanged)} assets would be left as they are{failing}"]


def expected_lines(found: ForecastCost, settings: Settings, assets: int) -> list[str]:
    """Cost of the run, in words."""
    if assets == 0:
        return ["expected: no model calls, and only the time to look"]
    model = described(settings.model.model)
    if found.calls is None or found.work_s is None or found.wall_s is None:
        return [f"expected: not known, nothing was refined here yet; --limit 5 shows what {model} takes"]
    tokens = [found.prompt_tokens, found.completion_tokens]
    sent = f"{tokens[0]:.0f} + {tokens[1]:.0f} tokens" if None not in tokens else "tokens not known"
    cost = f"{found.cost_usd:.2f} USD" if found.cost_usd is not None else "cost not known: no price is listed"
    calls = f"at most {found.calls:.0f} calls of {model} ({significant(found.calls / assets)} an asset)"
    basis = f"by {found.assets} refinements in the history" + (", of other models" if found.others else "")
    wall, work = duration(found.wall_s), duration(found.work_s)
    lines = [
        f"expected: {calls}, {sent}, {cost}; answers that are in the cache cost nothing",
        f"          {wall} on {settings.run.workers} workers, {work} of work; {basis}",
    ]
    limits = (
        ("--budget-calls", settings.model.run_calls, found.calls),
        (
            "--budget-tokens",
            settings.model.run_tokens,
            None if None in tokens else sum(map(float, filter(None, tokens))),
        ),
        ("--budget-usd", settings.model.run_usd, found.cost_usd),
    )
    over = [
        f"{name} {limit:g}"
        for name, limit, value in limits
        if limit is not None and value is not None and value > limit
    ]
    return [*lines, *(f"          more than {budget} allows" for budget in over)]
