"""How a model is asked: the gateway on LiteLLM, the prompts, and what is made of the answers."""
