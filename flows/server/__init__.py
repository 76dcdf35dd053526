"""Prefect's own process: its server, clients of it, and what is deployed on it."""
