"""Collision shapes that every engine reads alike: explicit convex hulls, cleared of overlaps that no state avoids."""
