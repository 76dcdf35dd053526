"""Methods and models compared on the same objects: DATA OUT [--subset S] [--methods …] [--models …] [--levels …]."""

import sys
from collections.abc import Sequence
from dataclasses import replace

from asset2sim.catalog.text import output
from asset2sim.experiments.isolation.children import warm_up
from asset2sim.intake.dataset import load_dataset
from asset2sim.models.gateway.environment import quiet_environment
from asset2sim.runs.check_request import check_run
from flows import PIPELINE
from flows.server.server import temporary_server
from lab.comparisons.comparison import BLOCK, Comparison, compare, write_comparison, write_page
from lab.comparisons.first_table import FIRST, first_table
from lab.comparisons.meaning import experts_apart
from lab.comparisons.method_runs import CompareMethodsOptions, parse_request, planned_runs
from lab.comparisons.object_rows import read_objects
from lab.comparisons.shapes import SHAPES, shapes_block, shapes_section
from lab.pages.blocks import Pages, check_page
from schemas.asset import FoundAssets
from schemas.errors import DONE, STOPPED, exit_code_of
from schemas.location import Location


def compare_methods(request: CompareMethodsOptions) -> int:
    """Refine the dataset by every method with every model, then write the tables. Returns the exit code. Raises
    UsageError for what cannot be done as asked, before anything is refined."""
    runs = planned_runs(request.out, request.methods, request.all_models)
    base, console = request.shared_settings(), output()
    chosen = (request.subset, request.assets, request.limit)
    engines = ", ".join(base.engine.verify or ("every engine installed",))
    if request.page is not None:
        check_page(request.page, BLOCK)
    tables = (
        Pages[Comparison](FIRST, {request.first: lambda made: first_table(made.objects, request.subset, engines)}),
        Pages[Comparison](SHAPES, {request.shapes: lambda made: shapes_block(made.shapes)}),
    )
    found = FoundAssets(load_dataset(request.data, *chosen))
    for run in runs:
        check_run(found, request.data, run.folder, run.settings(base))
    with temporary_server() as address:
        warm_up(PIPELINE)
        from flows.refine_dataset import refine_dataset
        from flows.server.client import use_server

        with use_server(address):
            for number, run in enumerate(runs, start=1):
                console.print(f"{number} of {len(runs)}: {run.method.value}, {run.label}")
                result = refine_dataset(
                    Location(request.data), Location(run.folder), run.settings(base), *chosen, found=found
                )
                if result.stopped is not None:
                    sys.stderr.write(f"{result.stopped}; run it again to compare\n")
                    return STOPPED
    compared = compare(read_objects(runs, base.thresholds), request.subset, engines, experts_apart(runs))
    compared = replace(compared, shapes=shapes_section(runs, base.engine))
    report = write_comparison(request.out, runs, compared)
    if request.page is not None:
        write_page(request.page, request.out, compared)
    for pages in tables:
        pages.write(compared)
    console.print(f"tables and charts: {report}", markup=False)
    return DONE


def main(words: Sequence[str]) -> int:
    """Run one command line and return its exit code."""
    quiet_environment()
    return exit_code_of("compare_methods", lambda: compare_methods(parse_request(words)))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
