"""Semantic accuracy: how well a refined asset is what its user asked for (paper, evaluation, section 2)."""
