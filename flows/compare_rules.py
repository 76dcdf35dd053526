"""One dataset raw, by the paper's rules and by ours, compared for the README's table: DATA OUT [README]."""

import sys
from collections.abc import Sequence
from pathlib import Path

from asset2sim.models.gateway.environment import quiet_environment
from asset2sim.runs.check_request import check_request
from asset2sim.runs.request import RefineRequest, usable_cores
from asset2sim.studies.rules import main as print_table
from asset2sim.studies.rules import settings_of
from flows.command import refine
from schemas.settings import RunSettings, Settings, ViewSettings


def main(words: Sequence[str]) -> int:
    """Refine DATA three times, into a folder each under OUT, and write the table. Returns the exit code."""
    data, out = Path(words[0]), Path(words[1])
    base = Settings(views=ViewSettings(write=False), run=RunSettings(workers=usable_cores()))
    quiet_environment()
    folders = {}
    for name, settings in settings_of(base).items():
        folder = out / name.split("'")[0]
        found = check_request(data, folder, settings, None, (), None)
        refine(RefineRequest(data=data, out=folder, settings=settings, found=found))
        folders[name] = folder
    named = [f"{name}={folder}" for name, folder in folders.items()]
    return print_table([*(["--readme", words[2]] if len(words) > 2 else []), *named])


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
