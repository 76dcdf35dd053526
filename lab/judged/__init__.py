"""Outer judges: a page on which people rate anonymous variants, models that score films, and the figures of both."""
