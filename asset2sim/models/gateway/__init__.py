"""Every model call: LiteLLM behind one function, with budgets, limits, caches, prices and typed failures."""
