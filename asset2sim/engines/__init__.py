"""Simulators, each behind the same small interface: a file per engine."""
