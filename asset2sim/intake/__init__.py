"""Datasets, formats and the user's own numbers as they come in, and findings on files and authored numbers."""
