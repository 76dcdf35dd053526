"""Coding-agent baseline (paper, baselines): a model with tools and a simulator, without our structure."""

from asset2sim.baselines.agent.run import run_agent

__all__ = ["run_agent"]
