"""The structure of the product's imports: every room is placed in the contract, and no circle of files."""

import ast
import tomllib
from functools import cache
from pathlib import Path

import networkx as nx

from tests.assets import ROOT

ROOTS = ("schemas", "asset2sim", "tasks", "flows")
MOST_FLOORS = 9


@cache
def sources() -> dict[str, Path]:
    files = (file.relative_to(ROOT) for root in ROOTS for file in (ROOT / root).rglob("*.py"))
    return {".".join(file.with_suffix("").parts).removesuffix(".__init__"): ROOT / file for file in files}


def imported(module: str) -> set[str]:
    """The modules that a module imports anywhere in it: in functions and for types alone, too."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(sources()[module].read_bytes())):
        if isinstance(node, ast.Import):
            names |= {item.name for item in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module is not None:
            inner = {item.name: f"{node.module}.{item.name}" for item in node.names}
            names |= {whole if whole in sources() else node.module for whole in inner.values()}
    return (names & sources().keys()) - {module}


def test_no_files_import_each_other_in_a_circle() -> None:
    graph = nx.DiGraph([(module, other) for module in sources() for other in imported(module)])
    assert graph.number_of_edges() > 1000
    assert [sorted(circle) for circle in nx.strongly_connected_components(graph) if len(circle) > 1] == []


def test_every_room_of_the_product_has_its_floor() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    contracts = project["tool"]["importlinter"]["contracts"]
    (floors,) = (item["layers"] for item in contracts if item["type"] == "layers")
    placed = [room for floor in floors for room in floor.split(" | ") if room != "lab"]
    inside = {path for path in (ROOT / "asset2sim").iterdir() if (path / "__init__.py").is_file()}
    inside |= {path for path in (ROOT / "asset2sim").glob("*.py") if path.stem != "__init__"}
    assert sorted(placed) == sorted({"schemas", "tasks", "flows"} | {f"asset2sim.{path.stem}" for path in inside})
    assert len([floor for floor in floors if floor != "lab"]) <= MOST_FLOORS
