"""The five canonical views of an asset at given joint positions, in PyBullet's software renderer."""

from asset2sim.assets.views.canonical import VIEW_NAMES, png_bytes, render_views, write_views

__all__ = ["VIEW_NAMES", "png_bytes", "render_views", "write_views"]
