"""Trainings of policies in the environment of an object."""
