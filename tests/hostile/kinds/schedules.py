"""Schedules that no clock knows: nothing is served, and one line says why."""

from collections.abc import Sequence

from tests.hostile.case import Case
from tests.hostile.tiny import asset

WRONG = (
    *("", " ", "nonsense", "* * * *", "* * * * * * *", "60 * * * *", "* 24 * * *", "* * 0 * *", "* * * 13 *"),
    *("* * * * 9", "0 2 * * mon-noday", "@sometimes", "-1 * * * *", "*/0 * * * *", "0 2 30 2 *", "0,, * * * *"),
    *("\x1b[31m 2 * * *", "0 2 * * *\n0 3 * * *", "9" * 500, "0 2 * * * ; rm -rf /", "½ * * * *"),
)


def cases() -> Sequence[Case]:
    """The cases."""
    found = enumerate(WRONG)
    return [Case(f"{n:02} {cron[:20]!a}", asset(), words=("--cron", cron), command="nightly") for n, cron in found]
