"""The documentation's table of providers says what LiteLLM reads."""

from pathlib import Path

import pytest

from asset2sim.models.gateway.abilities import check_model
from asset2sim.models.gateway.environment import load_litellm
from schemas.errors import UsageError
from schemas.settings import ModelSettings
from tests.provider_table import PROVIDERS, Provider, provider_table

PAGE = Path(__file__).resolve().parents[1] / "docs/models.md"
LOCAL = "http://127.0.0.1:8000/v1"


@pytest.fixture(autouse=True)
def no_variables(monkeypatch: pytest.MonkeyPatch) -> None:
    names = [name for provider in PROVIDERS for name in provider.variables]
    for name in (*names, "OPENAI_API_BASE", "ANTHROPIC_AUTH_TOKEN"):
        monkeypatch.delenv(name, raising=False)


def test_the_readme_has_the_table_as_it_is_made() -> None:
    assert provider_table() in PAGE.read_text(encoding="utf-8")


@pytest.mark.parametrize("provider", [p for p in PROVIDERS if p.variables], ids=lambda provider: provider.name)
@pytest.mark.system  # the first import of LiteLLM opens a socket
def test_the_variables_are_those_that_litellm_reads(provider: Provider, monkeypatch: pytest.MonkeyPatch) -> None:
    report = load_litellm().validate_environment(provider.example)
    assert set(report["missing_keys"]) == set(provider.variables)
    for name in provider.variables[: 1 if provider.either else None]:
        monkeypatch.setenv(name, "test-value-0123456789")
    assert load_litellm().validate_environment(provider.example)["keys_in_environment"]
    check_model(ModelSettings(model=provider.example))


@pytest.mark.parametrize(
    "provider", [p for p in PROVIDERS if any(n.endswith("_API_KEY") for n in p.variables)], ids=lambda p: p.name
)
@pytest.mark.system  # as above
def test_a_missing_key_is_a_usage_error_that_names_it(provider: Provider) -> None:
    if provider.name == "Azure OpenAI":
        pytest.skip("a login may stand for its key")
    with pytest.raises(UsageError, match=provider.variables[0]):
        check_model(ModelSettings(model=provider.example))


@pytest.mark.parametrize("provider", [p for p in PROVIDERS if not p.variables], ids=lambda provider: provider.name)
@pytest.mark.system  # as above
def test_servers_of_ones_own_need_none(provider: Provider) -> None:
    address = None if provider.name == "Ollama" else LOCAL
    check_model(ModelSettings(model=provider.example, api_base=address))
