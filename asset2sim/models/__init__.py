"""Model calls: the gateway on LiteLLM, the prompts, and the parsing of answers."""
