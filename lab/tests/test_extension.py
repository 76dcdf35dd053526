"""What the laboratory declares of itself exists, and the product knows whom to name where it is absent."""

import subprocess
import sys
from collections.abc import Iterator

import pytest

from asset2sim.baselines.declared_method import known_methods
from asset2sim.models.prior.answer import answers_of
from asset2sim.runs.command_line import Options
from asset2sim.runs.options import parse
from asset2sim.runs.plan.content_hash import extension_sources, module_files, source_version
from asset2sim.runs.request import parse_request
from lab.extension import EXTENSION
from schemas import declared, extensions
from schemas.errors import UsageError
from schemas.hand_settings import HAND_CHECKS
from schemas.model_names import ModelSettings, described
from schemas.settings import Settings
from schemas.table import Table
from schemas.tables import PUBLISHED, TABLES
from schemas.vocabulary import Method

pytest.importorskip("mujoco")  # its import starts a program, which is no test's doing


def test_it_is_installed_beside_the_product() -> None:
    assert EXTENSION in declared.extensions()


@pytest.mark.parametrize("command", EXTENSION.commands, ids=lambda command: str(command.name))
def test_every_command_has_options_and_a_function(command: declared.DeclaredCommand) -> None:
    assert issubclass(extensions.object_at(command.options), Options) and callable(extensions.object_at(command.run))


def test_the_hands_checks_the_model_and_the_tables_are_there() -> None:
    for check in HAND_CHECKS:
        assert callable(extensions.object_at(check.run))
        columns = [name for name, *_ in extensions.object_at(check.columns)]
        assert columns[0] == check.name and set(columns) <= set(TABLES["assets"].schema.names)
    assert described("prior/noisy@2:7").startswith("prior/noisy@2:7 (simulation")
    tables = extensions.object_at(EXTENSION.tables)
    assert all(isinstance(table, Table) and table.name == name for name, table in tables.items())
    assert not set(tables) & set(PUBLISHED)


def test_the_product_knows_all_its_names() -> None:
    names = {module.METHOD.method for module in declared.modules_in("lab.methods") if hasattr(module, "METHOD")}
    names |= {item.name for item in EXTENSION.commands} | {EXTENSION.models[0].name}
    assert names | set(extensions.object_at(EXTENSION.tables)) == set(extensions.KNOWN["asset2sim-lab"])


def test_its_code_counts_where_it_decides() -> None:
    plain, noisy = Settings(), Settings(model=ModelSettings(model="prior/noisy@2"))
    assert extension_sources(plain) == () and extension_sources(noisy) == ("lab.noise",)
    assert extension_sources(Settings(method=Method.IVW)) == ("lab.methods",)
    assert "asset2sim.gym.hand" in extension_sources(Settings(checks=("used",)))
    assert {"lab/noise/__init__.py", "lab/noise/noise.py"} <= set(module_files("lab.noise"))
    assert {"asset2sim/load/__init__.py", "asset2sim/load/shapes.py"} <= set(module_files("asset2sim.load"))
    versions = {source_version(modules=extension_sources(item)) for item in (plain, noisy)}
    assert len(versions) == 2
    for name in (*HAND_CHECKS[0].sources, *EXTENSION.models[0].sources, *EXTENSION.declares["METHOD"]):
        assert module_files(name)


@pytest.mark.system
def test_a_method_is_imported_where_methods_are_asked_for_alone() -> None:
    """A command that asks which engines there are takes no engine and no renderer along."""
    asked = "from asset2sim.engines.registry import installed; installed()"
    told = "import sys; print('lab.methods' in sys.modules, 'pybullet' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", f"{asked}; {told}"], capture_output=True, text=True, check=True)
    assert done.stdout == "False False\n"


@pytest.fixture
def alone(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """The product without any extension."""
    monkeypatch.setattr(declared, "entry_points", lambda **_: [])
    kept = declared.extensions, declared.outside, known_methods
    for cached in kept:
        cached.cache_clear()
    yield
    for cached in kept:
        cached.cache_clear()


@pytest.mark.usefixtures("alone")
def test_without_it_one_line_says_what_is_missing() -> None:
    for command in EXTENSION.commands:
        with pytest.raises(UsageError, match=f"'{command.name}' needs asset2sim-lab, which is not installed"):
            parse([command.name, "out"])
    with pytest.raises(UsageError, match="'prior/noisy@2' needs asset2sim-lab"):
        answers_of("prior/noisy@2")
    assert described("prior/noisy") == "prior/noisy"
    assert set(known_methods()) < set(Method)
    for method in set(Method) - set(known_methods()):
        with pytest.raises(UsageError, match=f"'{method}' needs asset2sim-lab, which is not installed"):
            parse_request(["refine", "data", "--out", "out", "--method", method])
