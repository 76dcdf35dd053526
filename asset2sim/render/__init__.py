"""Pictures of objects: the five canonical views, marked views, and moving ones over a floor."""

from asset2sim.render.canonical import VIEW_NAMES, png_bytes, render_views, write_views

__all__ = ["VIEW_NAMES", "png_bytes", "render_views", "write_views"]
