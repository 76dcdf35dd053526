"""Kernels that Warp compiles, of all worlds at once: commands in an action, the nearest point of a part, touch."""

import warp

from asset2sim.gym.contacts import LEAST_N

TOUCHING = 3
"""Sum of the sides of a contact between tool and object."""


@warp.kernel
def blend(
    before: warp.array2d[float], after: warp.array2d[float], share: float, commands: warp.array2d[float]
) -> None:  # fmt: skip
    """Commands between those before and after an action."""
    world, servo = warp.tid()
    commands[world, servo] = before[world, servo] + share * (after[world, servo] - before[world, servo])


@warp.kernel
def nearest(
    tool: int,
    geom_places: warp.array2d[warp.vec3],
    places: warp.array2d[warp.vec3],
    turns: warp.array2d[warp.mat33],
    bodies: warp.array[int],
    surfaces: warp.array[warp.uint64],
    found: warp.array[warp.vec3],
) -> None:
    """From the tool's point to the nearest point of a part's surfaces, each in its body's frame, in each world."""
    world = warp.tid()
    at = geom_places[world, tool]
    best = warp.float32(1e10)
    away = warp.vec3(0.0, 0.0, 0.0)
    for index in range(bodies.shape[0]):
        place = places[world, bodies[index]]
        turn = turns[world, bodies[index]]
        point = warp.transpose(turn) * (at - place)
        hit = warp.mesh_query_point_no_sign(surfaces[index], point, 1e4)
        if hit.result:
            vector = turn * (warp.mesh_eval_position(surfaces[index], hit.face, hit.u, hit.v) - point)
            if warp.length(vector) < best:
                best = warp.length(vector)
                away = vector
    found[world] = away


@warp.kernel
def touching(
    count: warp.array[int],
    geoms: warp.array[warp.vec2i],
    worlds: warp.array[int],
    rows: warp.array2d[int],
    forces: warp.array2d[float],
    sides: warp.array[int],
    touched: warp.array[int],
) -> None:
    """Whether tool and object press on each other, as ``contact.Touch``."""
    index = warp.tid()
    if index < count[0]:
        pair = geoms[index]
        row = rows[index, 0]
        if row >= 0 and sides[pair[0]] + sides[pair[1]] == TOUCHING and forces[worlds[index], row] > LEAST_N:
            touched[worlds[index]] = 1
