"""Meaning of words: prompts and labels read into sizes, states, parts and materials, from tables."""
