"""Keys where people put them, in addresses and hooks: they come into no table, log or database."""

from collections.abc import Sequence

from schemas.vocabulary import FailureMode
from tests.hostile.case import KEY, Case
from tests.hostile.tiny import asset

ADDRESSES = {
    "user": f"http://{KEY}@127.0.0.1:1/v1",
    "password": f"http://user:{KEY}@127.0.0.1:1/v1",
    "query": f"http://127.0.0.1:1/v1?api_key={KEY}",
    "path_and_query": f"http://127.0.0.1:1/v1/x?a=1&token={KEY}",
    "both": f"https://user:{KEY}@127.0.0.1:1/v1?key={KEY}",
}
WRONG = {
    "hostless": ("--model", "openai/x", "--api-base", f"http://user:{KEY}@"),
    "no_scheme": ("--model", "openai/x", "--api-base", f"user:{KEY}@127.0.0.1/v1"),
    "scheme": ("--model", "openai/x", "--api-base", f"gopher://{KEY}@127.0.0.1/v1"),
    "hook": ("--hook", f"https://127.0.0.1:1/services/{KEY}"),
    "scheduler": ("--scheduler", f"http://user:{KEY}@127.0.0.1:1"),
}


def cases() -> Sequence[Case]:
    """Model addresses where no server runs, hooks, and mistakes in what holds a key."""
    asked = [
        Case(f"base_{name}", asset(), frozenset({FailureMode.MODEL_ERROR}),
             words=("--method", "direct", "--model", "openai/x", "--api-base", base))
        for name, base in ADDRESSES.items()
    ]  # fmt: skip
    hooks = [
        Case(f"hook_{name}", asset(), frozenset(FailureMode), words=("--method", "raw", "--hook", hook))
        for name, hook in (
            ("url", f"true http://127.0.0.1:1/{KEY}"),
            ("fails", f"false {KEY}"),
            ("none", f"/nowhere/hook {KEY}"),
        )
    ]
    return [*asked, *hooks, *(Case(f"wrong_{name}", asset(), words=words) for name, words in WRONG.items())]
