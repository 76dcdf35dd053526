"""``python -m asset2sim.studies.samples [OUT]``: write the sample dataset, to data/raw unless told otherwise."""

import sys
from pathlib import Path

from pydantic import Field
from pydantic_settings import CliPositionalArg

from asset2sim.runs.command_line import Options, parse
from asset2sim.studies.samples import write_samples
from schemas.errors import UsageError


class SamplesOptions(Options):
    """Write the sample dataset."""

    out: CliPositionalArg[Path] = Field(Path("data/raw"), description="folder to write")


def main() -> int:
    """Write the samples; exit code 2 where the folder named holds something else."""
    try:
        out = parse(SamplesOptions, sys.argv[1:], "python -m asset2sim.studies.samples").out
        written = write_samples(out)
    except UsageError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    sys.stdout.write(f"{len(written)} assets written to {out}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
