"""Common model providers: how their models are named, and which environment variables they need."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Provider:
    """One row: ``variables`` as LiteLLM reads them, all needed or, where ``either``, one of them."""

    name: str
    example: str
    variables: tuple[str, ...]
    either: bool = False
    also: str = ""


PROVIDERS: tuple[Provider, ...] = (
    Provider("OpenAI", "openai/gpt-4o", ("OPENAI_API_KEY",)),
    Provider("Anthropic", "anthropic/claude-sonnet-4-5", ("ANTHROPIC_API_KEY",)),
    Provider("Google AI Studio", "gemini/gemini-2.5-flash", ("GEMINI_API_KEY", "GOOGLE_API_KEY"), either=True),
    Provider(
        "Google Vertex AI",
        "vertex_ai/gemini-2.5-pro",
        ("VERTEXAI_PROJECT", "VERTEXAI_LOCATION"),
        also="credentials from `gcloud auth application-default login` or `GOOGLE_APPLICATION_CREDENTIALS`",
    ),
    Provider("Azure OpenAI", "azure/<deployment>", ("AZURE_API_KEY", "AZURE_API_BASE", "AZURE_API_VERSION")),
    Provider(
        "AWS Bedrock",
        "bedrock/<model id>",
        ("AWS_ACCESS_KEY_ID", "AWS_SECRET_ACCESS_KEY"),
        also="`AWS_REGION_NAME`; a profile or a role will do instead of the keys",
    ),
    Provider("Mistral", "mistral/mistral-large-latest", ("MISTRAL_API_KEY",)),
    Provider("OpenRouter", "openrouter/openai/gpt-4o", ("OPENROUTER_API_KEY",)),
    Provider("Groq", "groq/<model>", ("GROQ_API_KEY",)),
    Provider("DeepSeek", "deepseek/deepseek-chat", ("DEEPSEEK_API_KEY",), also="text alone: takes no images"),
    Provider("Ollama", "ollama/<model>", (), also="`OLLAMA_API_BASE` where it is not `http://localhost:11434`"),
    Provider("vLLM", "hosted_vllm/<model>", (), also="`--api-base http://host:8000/v1`"),
    Provider(
        "any OpenAI-compatible server",
        "openai/<model>",
        (),
        also="`--api-base http://host:port/v1`; `OPENAI_API_KEY` where it is not on your own network",
    ),
)


def provider_table() -> str:
    """The table of providers in Markdown, as the documentation has it; ends with a line break."""
    rows = ["| provider | `--model` | variables | also |", "|---|---|---|---|"]
    rows += [f"| {p.name} | `{p.example}` | {_variables(p)} | {p.also or '–'} |" for p in PROVIDERS]
    return "\n".join(rows) + "\n"


def _variables(provider: Provider) -> str:
    names = [f"`{name}`" for name in provider.variables]
    return (" or " if provider.either else ", ").join(names) or "none"
