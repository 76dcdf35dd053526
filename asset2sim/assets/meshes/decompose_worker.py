"""One decomposition in a process that can be killed; its arguments are METHOD FOLDER CPU_S SETTINGS PARENT.

Reads ``mesh.npz`` in FOLDER and leaves ``pieces.npz`` there, whole or not at all.
"""

import json
import resource
import sys
from pathlib import Path

import numpy as np

from asset2sim.assets.child_process import end_with_parent
from asset2sim.assets.meshes.array_file import write_clouds
from asset2sim.physics.arrays import Array


def main(method: str, folder: Path, cpu_s: int, settings: dict[str, float], parent: int) -> None:
    """Decompose ``mesh.npz`` by ``coacd`` or ``vhacd`` within ``cpu_s`` seconds of processor time, for this parent."""
    end_with_parent(parent)
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    resource.setrlimit(resource.RLIMIT_CPU, (cpu_s, cpu_s + 1))
    with np.load(folder / "mesh.npz") as mesh:
        vertices, faces = mesh["vertices"], mesh["faces"]
    # Cut at unit size about the origin: both methods round, and neither says at what size.
    low, extent = vertices.min(axis=0), float(np.ptp(vertices, axis=0).max())
    unit = (vertices - low) / extent
    found = by_coacd(unit, faces, settings) if method == "coacd" else by_vhacd(unit, faces, settings, folder)
    pieces = [piece * extent + low for piece in found]
    write_clouds(folder / "pieces.npz", pieces)


def by_coacd(vertices: Array, faces: Array, settings: dict[str, float]) -> list[Array]:
    """CoACD's pieces of a closed surface; its own repair, which fattens thin walls, is off."""
    import coacd

    coacd.set_log_level("off")
    found = coacd.run_coacd(
        coacd.Mesh(vertices, faces),
        threshold=settings["threshold"],
        max_convex_hull=int(settings["max_hulls"]),
        preprocess_mode="off",
        resolution=int(settings["sample_resolution"]),
        mcts_nodes=int(settings["mcts_nodes"]),
        mcts_iterations=int(settings["mcts_iterations"]),
        mcts_max_depth=int(settings["mcts_max_depth"]),
        seed=int(settings["seed"]),
    )
    return [np.asarray(piece, dtype=np.float64) for piece, _ in found]


def by_vhacd(vertices: Array, faces: Array, settings: dict[str, float], folder: Path) -> list[Array]:
    """V-HACD's pieces of any triangle soup, half a voxel too thick."""
    import pybullet

    source, target = folder / "mesh.obj", folder / "pieces.obj"
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in vertices]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in faces]
    source.write_text("\n".join(lines) + "\n", encoding="ascii")
    pybullet.vhacd(
        str(source),
        str(target),
        str(folder / "vhacd.log"),
        resolution=int(settings["preprocess_resolution"]),
        concavity=0.01,
        planeDownsampling=8,
        convexhullDownsampling=8,
        maxNumVerticesPerCH=int(settings["max_hull_vertices"]),
    )
    points: list[list[float]] = []
    starts: list[int] = []
    for line in target.read_text(encoding="ascii").splitlines():
        if line.startswith("o "):
            starts.append(len(points))
        elif line.startswith("v "):
            points.append([float(word) for word in line.split()[1:4]])
    cloud = np.asarray(points, dtype=np.float64).reshape(-1, 3)
    return [cloud[a:b] for a, b in zip(starts, [*starts[1:], len(points)], strict=True)]


if __name__ == "__main__":
    main(sys.argv[1], Path(sys.argv[2]), int(sys.argv[3]), json.loads(sys.argv[4]), int(sys.argv[5]))
