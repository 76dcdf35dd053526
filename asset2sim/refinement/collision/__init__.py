"""Collision shapes as explicit convex hulls, the same in every engine, cut where no joint state avoids an overlap."""
