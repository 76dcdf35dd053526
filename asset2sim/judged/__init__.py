"""Outer judges: the page on which people rate anonymous variants, models that score their films, the paper's ratings and
scores, and the figures of all."""
