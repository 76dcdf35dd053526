"""Weights of our objects and their parts beside published weights."""
