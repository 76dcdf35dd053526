"""Example questions to a catalog, an SQL file each, whose first line is the question in words; see ``answers``."""
