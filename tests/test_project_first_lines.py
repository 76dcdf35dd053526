"""First lines of docstrings: each says what is returned or done, and none begins with "What"."""

import ast
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
ROOMS = ("asset2sim", "tasks", "flows", "schemas", "lab")
DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


def first_lines(file: Path) -> list[str]:
    """The first line of every docstring of a module, with the line of what it documents."""
    nodes = [node for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))) if isinstance(node, DOCUMENTED)]
    found = [(getattr(node, "lineno", 1), ast.get_docstring(node)) for node in nodes]
    return [f"{file.relative_to(ROOT)}:{line}: {text.splitlines()[0]}" for line, text in found if text]


def test_no_first_line_begins_with_what() -> None:
    files = [file for room in ROOMS for file in (ROOT / room).rglob("*.py") if "tests" not in file.parts]
    lines = [line for file in files for line in first_lines(file)]
    assert len(lines) > 3000
    assert not [line for line in lines if line.split(": ", 1)[1].startswith("What ")]
