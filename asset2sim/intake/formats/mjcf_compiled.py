"""An MJCF file compiled by MuJoCo, as it is or, where that refuses it, as a mended document."""

from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from asset2sim.assets.metric import MOST_DENSITY_KG_M3
from asset2sim.assets.urdf.references import AllowedFolders
from asset2sim.intake.formats.format import unconvertible_error
from asset2sim.intake.formats.mjcf_document import check_files, is_in_radians, mended_document
from schemas.errors import AssetError

LEAST_MASS_KG, LEAST_INERTIA_KG_M2 = 1e-6, 1e-9
"""Given to bodies of a mended file that state none, for MuJoCo's compiler alone: they are not read from it."""
DEFAULT_DENSITY_KG_M3, LEAST_DENSITY_KG_M3 = 1000.0, 200.0
"""A geom's density where its file states none, and the least that says what it is made of: benchmarks of robots write
10, 50 or 100 into whatever it is, light woods have 350."""
ROUNDING = 1e-9
"""Share by which a sum of stated numbers may be off."""


def compiled(file: Path, reach: AllowedFolders) -> tuple[Any, Any, Any, tuple[str, ...]]:
    """MuJoCo, the file's specification and model, and notes on what was mended. Raises AssetError (unreadable_asset)
    where MuJoCo is missing or refuses the file, and where it names files outside ``reach``."""
    pictures_outside = check_files(file, reach)
    try:
        import mujoco
    except ModuleNotFoundError as error:
        problem = "reading MJCF needs MuJoCo: pip install mujoco, or keep a URDF of it"
        raise unconvertible_error(file, "mujoco_missing", problem) from error
    notes: tuple[str, ...] = ()
    radians = False
    with suppress(AssetError, ValueError):  # reading it says what is wrong
        radians = is_in_radians(file)
    try:
        if pictures_outside:
            raise ValueError("pictures that it names lie outside the dataset")
        spec, model = compiled_model(mujoco.MjSpec.from_file(str(file)), radians)
    except (ValueError, OSError) as error:
        text, notes = mended_document(file, reach)
        try:
            spec = mujoco.MjSpec.from_string(text.decode())
            # What has no mass is to be given one later; MuJoCo only has to read it.
            spec.compiler.boundmass, spec.compiler.boundinertia = LEAST_MASS_KG, LEAST_INERTIA_KG_M2
            stated = [body.name for body in spec.bodies if body.explicitinertial and is_impossible(body)]
            spec.compiler.balanceinertia = True
            spec, model = compiled_model(spec, radians)
            notes += tuple(f"the inertia of body '{name}', which no body can have, is made a ball's" for name in stated)
        except (ValueError, OSError) as left:
            raise unconvertible_error(
                file, "mjcf_refused", f"MuJoCo refuses it: {' '.join(str(left).split())}"
            ) from error
    if radians:
        notes += ("it states no unit of angles; none is over 3.15, and they are read as radians, not as degrees",)
    return mujoco, spec, model, notes


def compiled_model(spec: Any, radians: bool) -> tuple[Any, Any]:
    """The specification and its model, in which static bodies and geoms that are only seen are kept, no mass or inertia
    is raised to a bound, which says nothing of a body, and looks of a weighed body weigh nothing; its angles in
    ``radians`` whatever its file says."""
    spec.compiler.degree = spec.compiler.degree and not radians
    spec.compiler.fusestatic = spec.compiler.discardvisual = False
    spec.compiler.boundmass = min(spec.compiler.boundmass, LEAST_MASS_KG)
    spec.compiler.boundinertia = min(spec.compiler.boundinertia, LEAST_INERTIA_KG_M2)
    low, high = spec.compiler.inertiagrouprange
    for body in spec.bodies:
        counted = [geom for geom in body.geoms if low <= geom.group <= high and geom.mass != 0.0]
        touching = [geom for geom in counted if geom.contype or geom.conaffinity]
        # Authors weigh what touches; MuJoCo adds looks that state nothing at the density of water.
        if touching and all(map(states_mass, touching)):
            for geom in counted:
                geom.mass = geom.mass if states_mass(geom) else 0.0
    return spec, spec.compile()


def states_mass(geom: Any) -> bool:
    """Whether a geom states its mass (one that states none has NaN), or a density, as that of what it is made of."""
    of_material = LEAST_DENSITY_KG_M3 <= geom.density <= MOST_DENSITY_KG_M3 and geom.density != DEFAULT_DENSITY_KG_M3
    return bool(np.isfinite(geom.mass) or of_material)


def is_impossible(body: Any) -> bool:
    """Whether no body can have the inertia that one states: one moment is larger than the sum of the others."""
    xx, yy, zz, xy, xz, yz = body.fullinertia
    full = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    moments = np.linalg.eigvalsh(full) if np.isfinite(full).all() else np.asarray(body.inertia)
    return bool(2.0 * np.max(moments) > np.sum(moments) * (1.0 + ROUNDING))
