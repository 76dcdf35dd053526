"""Experiments as Prefect flows and as programs of make."""
