"""Frozen data models, Arrow table schemas, settings and errors. Imports no other package of this project."""
