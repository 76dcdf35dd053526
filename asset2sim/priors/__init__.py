"""The offline model's reasoning: tables of household sizes, materials and mechanisms, and the words of the guidance."""

from asset2sim.priors.answer import answer

__all__ = ["answer"]
