"""``python -m asset2sim.studies.samples [OUT]``: write the sample dataset, to data/raw unless told otherwise."""

import argparse
import sys
from pathlib import Path

from asset2sim.studies.samples import write_samples
from schemas.errors import UsageError


def main() -> int:
    """Write the samples; exit code 2 where the folder named holds something else."""
    parser = argparse.ArgumentParser(
        prog="python -m asset2sim.studies.samples", description="Write the sample dataset."
    )
    parser.add_argument("out", nargs="?", type=Path, default=Path("data/raw"), help="folder to write, default data/raw")
    out: Path = parser.parse_args().out
    try:
        written = write_samples(out)
    except UsageError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    sys.stdout.write(f"{len(written)} assets written to {out}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
