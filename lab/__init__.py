"""Measurements of the project itself: experiments, comparisons, judges, and the pages of the documentation."""
