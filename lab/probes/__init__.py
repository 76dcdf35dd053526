"""Policies as probes: the DROID scene, what they see and answer, their sockets, and what their trials say."""
