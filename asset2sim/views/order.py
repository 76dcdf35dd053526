"""Drawing order: what lies outside first, so that TinyRenderer skips what is hidden. What is seen stays the same.

It shades every pixel that is not yet covered by something nearer, which costs more than all the rest; this order
saves a tenth to a third of the time of a view.
"""

from collections.abc import Sequence

import numpy as np

from asset2sim.views.surface import Batch, Floats, unit


def outside_first(batches: Sequence[Batch]) -> list[Batch]:
    """The same batches, sorted, each with its faces sorted.

    Of two faces that a camera sees from the front, the one further out along its own normal is likely to be the
    nearer; that needs no camera, so one order serves all views.
    """
    if not batches:
        return []
    low = np.min([batch.vertices.min(axis=0) for batch in batches], axis=0)
    high = np.max([batch.vertices.max(axis=0) for batch in batches], axis=0)
    ranked = [sorted_faces(batch, 0.5 * (low + high)) for batch in batches]
    return [batch for batch, _ in sorted(ranked, key=lambda item: -item[1])]


def sorted_faces(batch: Batch, center: Floats) -> tuple[Batch, float]:
    """The batch with its outermost faces first, and the area-weighted mean of how far out they are, m."""
    corner = batch.vertices[batch.faces]
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    area = np.linalg.norm(normal, axis=1)
    out = np.einsum("ij,ij->i", corner.mean(axis=1) - center, unit(normal))
    rank = float(np.average(out, weights=area)) if area.sum() > 0.0 else 0.0
    order = np.argsort(-out, kind="stable")
    return Batch(batch.vertices, batch.normals, batch.uv, batch.faces[order], batch.paint), rank
