"""Hash of source files: Python code without comments, layout and docstrings, other files as they are."""

import ast
import hashlib
from collections.abc import Mapping, MutableMapping
from contextlib import suppress
from pathlib import Path

PARSE_TRIES = 20
"""Times that a source is parsed beside other threads: of 450, with garbage collected, 14 failed the first."""


def code_digest(
    files: Mapping[str, Path], *, prose: bool = False, known: MutableMapping[str, str] | None = None
) -> str:
    """SHA-256, in hexadecimal, over the names and contents of files, whatever their order; of Python files the code.
    With ``prose`` comments and docstrings count as well, which takes a fiftieth of the time. ``known`` holds the hash
    of a source's code by that of its text, and is added to."""
    digest = hashlib.sha256()
    known = {} if known is None else known
    for name, file in sorted(files.items()):
        content = file.read_bytes()
        text = hashlib.sha256(content).hexdigest()
        if prose or not name.endswith(".py"):
            code = text
        elif (code := known.get(text, "")) == "":
            code = known[text] = hashlib.sha256(bare_code(content)).hexdigest()
        digest.update(f"{name}\0{code}\n".encode())
    return digest.hexdigest()


def bare_code(source: bytes) -> bytes:
    """A source's syntax tree as text: no comments, no layout, and no texts that are statements, as docstrings are."""
    words: list[str] = []
    _spell(_parsed(source), words)
    return " ".join(words).encode(errors="surrogatepass")


def _parsed(source: bytes) -> ast.Module:
    """A source's syntax tree, also while another thread parses. Python 3.11 counts the depth of all threads together,
    and raises SystemError where garbage collection, as Dask watches it, lets another one go on in between
    (python/cpython#106905)."""
    for _ in range(PARSE_TRIES - 1):
        with suppress(SystemError):
            return ast.parse(source)
    return ast.parse(source)


def _spell(part: object, words: list[str]) -> None:
    if isinstance(part, ast.AST):
        if isinstance(part, ast.Expr) and isinstance(part.value, ast.Constant) and isinstance(part.value.value, str):
            return
        words.append(type(part).__name__)
        for field in part._fields:
            _spell(getattr(part, field, None), words)
    elif isinstance(part, list):
        words.append("[")
        for item in part:
            _spell(item, words)
        words.append("]")
    else:
        words.append(repr(part))
