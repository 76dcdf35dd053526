"""Incremental runs: what a result depends on, what must be refined again, what a killed run had finished."""
