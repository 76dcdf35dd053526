"""Outer judges: the page on which people rate anonymous variants, the paper's ratings and scores, and their figures."""
