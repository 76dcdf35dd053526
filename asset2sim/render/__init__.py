"""Pictures of objects: the five canonical views, marked views, and the splats of moving ones."""

from asset2sim.render.canonical import VIEW_NAMES, png_bytes, render_views, write_views
from asset2sim.render.renderer import can_draw

__all__ = ["VIEW_NAMES", "can_draw", "png_bytes", "render_views", "write_views"]
