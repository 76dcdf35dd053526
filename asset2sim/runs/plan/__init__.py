"""Incremental runs: what an asset's result depends on, which assets have to be refined again, and what a killed run
had finished."""
