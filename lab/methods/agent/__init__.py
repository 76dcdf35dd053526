"""Coding-agent baseline (paper, baselines): a model with tools and a simulator, without our structure."""
