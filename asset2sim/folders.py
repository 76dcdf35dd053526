"""Writing a folder so that readers see the old one or the new one, never half of one."""

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def staged_folder(final: Path) -> Iterator[Path]:
    """A fresh folder beside ``final`` that takes its place when the block ends well, and vanishes when it does not."""
    final.parent.mkdir(parents=True, exist_ok=True)
    staged = final.parent / f".{final.name}.new"
    retired = final.parent / f".{final.name}.old"
    # Leftovers of a killed run: at most one per asset, and one process at a time works on an asset.
    shutil.rmtree(staged, ignore_errors=True)
    if retired.is_dir() and not final.exists():
        os.replace(retired, final)
    shutil.rmtree(retired, ignore_errors=True)
    staged.mkdir()
    try:
        yield staged
    except BaseException:
        shutil.rmtree(staged, ignore_errors=True)
        raise
    if final.exists():
        os.replace(final, retired)
    os.replace(staged, final)
    shutil.rmtree(retired, ignore_errors=True)
