"""Catching what MuJoCo warns of: left alone it writes a log file into the working folder."""

from collections.abc import Iterator
from contextlib import contextmanager

import mujoco


@contextmanager
def collected_warnings() -> Iterator[list[str]]:
    """Collect MuJoCo's warnings while the block runs; whoever listened before hears them too."""
    lines: list[str] = []
    before = mujoco.get_mju_user_warning()

    def hear(message: str) -> None:
        lines.append(" ".join(message.split()))
        if before is not None:
            before(message)

    mujoco.set_mju_user_warning(hear)
    try:
        yield lines
    finally:
        mujoco.set_mju_user_warning(before)
