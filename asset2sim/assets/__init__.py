"""An asset folder in, a folder out: URDF, meshes, hulls, views, exports, and what is extracted from them."""
