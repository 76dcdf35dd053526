"""Options that cannot be: wrong values, two that exclude each other, folders, addresses and schedules that are none."""

from collections.abc import Sequence

from tests.hostile.case import Case
from tests.hostile.tiny import asset

ESCAPE = "\x1b[31mred"
WHOLE = ("--limit", "--workers")
COUNTS = ("--budget-calls", "--budget-tokens", "--asset-budget-calls", "--max-new-failures")
AMOUNTS = ("--budget-usd", "--asset-budget-usd")
POSITIVE = ("--rpm", "--asset-timeout")
CHOICES = (
    *("--engines", "--collision", "--dynamics", "--state", "--support", "--base", "--up", "--export", "--method"),
    "--gate",
)
WRONG: Sequence[tuple[str, ...]] = (
    *((name, value) for name in WHOLE for value in ("0", "-1", "1.5", "many", "", "1e3", "nan", ESCAPE)),
    *((f"{name}={value}",) for name in COUNTS for value in ("-1", "1.5", "all", "", "inf")),
    *((f"{name}={value}",) for name in AMOUNTS for value in ("-1", "nan", "inf", "much", "")),
    *((f"{name}={value}",) for name in POSITIVE for value in ("0", "-1", "nan", "inf", "soon", "")),
    *((f"--min-success={value}",) for value in ("-0.1", "1.1", "95", "nan", "most", "")),
    *((name, value) for name in CHOICES for value in ("nonsense", ESCAPE)),
    *((("--force", "--retry-failed"), ("--frob",), ("--limit",), ("more",))),
    *(("--model", name) for name in ("", "nonsense", "prior/magic", "prior/noisy@99", "prior/noisy@1:x", ESCAPE)),
    *(
        ("--model", "openai/x", "--api-base", base)
        for base in (
            "", "127.0.0.1", "ftp://h/v1", "http://", "http://h:0/v1", "http://h:port/v1", "http://[::1", ESCAPE,
        )
    ),
    *(("--scheduler", place) for place in ("", "localhost", "http://h:1", "tcp://h", "tcp://h:x", "tcp://127.0.0.1:1")),
    *(("--settings", name) for name in ("", "absent.yaml", "/", "/dev/null", "settings.ini")),
    *(("--assets", ids) for ids in ("", ",", "absent", "../zz_good", ESCAPE)),
    *(("--subset", name) for name in ("", "absent", ESCAPE)),
    *(
        ("--out", place)
        for place in ("", " ", "gopher://a/b", "s4://b/c", "s3://", "x://..", "s3://b/c::zip://d", "/dev/null")
    ),
)  # fmt: skip
"""Words that are refused in one line."""


def cases() -> Sequence[Case]:
    """The cases."""
    return [
        Case(name=f"{number:03} {' '.join(words)!a}", write=asset(), words=words) for number, words in enumerate(WRONG)
    ]
