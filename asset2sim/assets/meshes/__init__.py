"""Meshes, their volumes and hulls, and what they say about joints."""
