"""One dataset raw, by the paper's rules and by ours, compared for the README's table: DATA OUT [README]."""

import sys
from collections.abc import Sequence
from pathlib import Path

from asset2sim.catalog.read import latest_rows
from asset2sim.cli.parser import usable_cores
from asset2sim.cli.request import RefineRequest
from asset2sim.models.gateway.environment import quiet_environment
from asset2sim.runs.alert import DONE, run_program
from asset2sim.runs.check_request import check_request
from asset2sim.studies.methods.rules import BLOCK, engine_results, rules_table, settings_of
from asset2sim.studies.readme.blocks import check_readme, write_block
from flows.command import refine
from schemas.errors import UsageError
from schemas.settings import RunSettings, Settings, ViewSettings


def compare_rules(data: Path, out: Path, readme: Path | None) -> int:
    """Refine the dataset three times, into a folder each under ``out``, and write the table. Returns the exit code."""
    base = Settings(views=ViewSettings(write=False), run=RunSettings(workers=usable_cores()))
    ways = {name: (out / name.split("'")[0], settings) for name, settings in settings_of(base).items()}
    if readme is not None:
        check_readme(readme, BLOCK)
    for folder, settings in ways.values():
        check_request(data, folder, settings, None, (), None)
    for folder, settings in ways.values():
        refine(RefineRequest(data=data, out=folder, settings=settings))
    rules = {}
    for name, (folder, _) in ways.items():
        assets, measured, interactions = latest_rows(folder, "assets", "measurements", "interactions")
        rules[name] = engine_results(assets, measured, interactions, base.thresholds)
    if readme is None:
        sys.stdout.write(f"{rules_table(rules)}\n")
    else:
        write_block(readme, BLOCK, rules_table(rules))
    return DONE


def main(words: Sequence[str]) -> int:
    """Run one command line and return its exit code."""
    quiet_environment()

    def run() -> int:
        if len(words) not in (2, 3):
            raise UsageError("usage: python -m flows.compare_rules DATA OUT [README]")
        data, out, *readme = map(Path, words)
        return compare_rules(data, out, readme[0] if readme else None)

    return run_program("compare_rules", run)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
