"""A USD file as a stage: opened where its layers lie within reach, with places in metres, kilograms and z up."""

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from asset2sim.assets.urdf.references import AllowedFolders, lies_outside
from asset2sim.intake.formats.format import unconvertible_error
from asset2sim.physics.arrays import Array
from asset2sim.storage.regular_files import file_problem
from schemas.errors import AssetError

if TYPE_CHECKING:
    from pxr import Usd

SUFFIXES = (".usd", ".usda", ".usdc", ".usdz")
Y_UP_TO_Z_UP = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""What is y-up faces +z by custom; turned upright it faces +x (see ``intake.origin.TO_Z_UP``)."""
LARGEST_UNIT = 1e12
"""Largest unit, m or kg, that is taken for one, and the inverse of the least: a nanogram is 1e-12 kg."""
LEAST_SCALE = 1e-12
"""Length of a transform's axis, m, below which it leaves nothing of what it scales."""


class UsdStage:
    """An opened stage: its units, and the (4, 4) places of its prims. Times are the earliest that the file holds."""

    def __init__(self, file: Path, stage: "Usd.Stage", layers: tuple[Path, ...], notes: list[str]) -> None:
        from pxr import Usd, UsdGeom, UsdPhysics

        self.file, self.stage, self.layers, self.notes = file, stage, layers, notes
        self.time = Usd.TimeCode.EarliestTime()
        self.metre = float(UsdGeom.GetStageMetersPerUnit(stage))
        self.kilogram = float(UsdPhysics.GetStageKilogramsPerUnit(stage))
        self.states_metres = bool(stage.HasAuthoredMetadata(UsdGeom.Tokens.metersPerUnit))
        if not all(1.0 / LARGEST_UNIT <= unit <= LARGEST_UNIT for unit in (self.metre, self.kilogram)):
            problem = (
                f"its metersPerUnit is {self.metre:g} and its kilogramsPerUnit {self.kilogram:g}: "
                f"state both, from {1.0 / LARGEST_UNIT:g} to {LARGEST_UNIT:g}"
            )
            raise unconvertible_error(file, "usd_number", problem)
        if not self.states_metres:
            notes.append("it states no metersPerUnit: USD's own is taken, centimetres")
        upright = UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z
        self.to_world = np.diag([self.metre] * 3 + [1.0])
        self.to_world[:3, :3] = (np.eye(3) if upright else Y_UP_TO_Z_UP) * self.metre
        self.cache = UsdGeom.XformCache(self.time)
        self.everything = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)

    def prims(self, top: "Usd.Prim") -> Iterator["Usd.Prim"]:
        """A prim and all below it, those of instances too, but for what a point instancer repeats."""
        from pxr import Usd, UsdGeom

        found = iter(Usd.PrimRange(top, self.everything))
        for prim in found:
            if prim.IsA(UsdGeom.PointInstancer):
                found.PruneChildren()
                self.notes.append(f"{prim.GetPath()} is left out: a URDF has no PointInstancer")
            yield prim

    def world(self, prim: "Usd.Prim") -> Array:
        """(4, 4) from a prim's own coordinates, in its own scale, to the world in metres, z up."""
        found: Array = self.to_world @ np.array(self.cache.GetLocalToWorldTransform(prim)).T
        if not np.isfinite(found).all():
            raise self.refused("usd_number", f"the transform of {prim.GetPath()} is not finite: mend its xformOps")
        return found

    def rigid(self, prim: "Usd.Prim") -> Array:
        """(4, 4) from a prim's frame, without scale, to the world: the rotation nearest to its transform, of a mirror
        image that of all three axes reversed, as UsdPhysics has it."""
        found = self.world(prim)
        left, sizes, right = np.linalg.svd(found[:3, :3])
        if sizes[-1] < LEAST_SCALE:
            raise self.refused("usd_number", f"the transform of {prim.GetPath()} has a scale of 0: mend its xformOps")
        turn = left @ right
        found[:3, :3] = turn * np.sign(np.linalg.det(turn))
        return found

    def number(self, prim: "Usd.Prim", *names: str, default: float = 0.0) -> float:
        """The value of the first of these attributes that is authored and finite or infinite. Raises AssetError for
        one that is no number."""
        for name in names:
            attribute = prim.GetAttribute(name)
            if attribute and attribute.HasAuthoredValue() and (value := attribute.Get(self.time)) is not None:
                if not isinstance(value, int | float) or np.isnan(value):
                    raise self.refused("usd_number", f"'{name}' of {prim.GetPath()} is {value}: state a number")
                return float(value)
        return default

    def axis(self, prim: "Usd.Prim", name: str, default: str) -> str:
        """X, Y or Z, as an attribute says. Raises AssetError for any other word."""
        attribute = prim.GetAttribute(name)
        found = str(attribute.Get() or default) if attribute else default
        if found not in tuple("XYZ"):
            raise self.refused("usd_axis", f"'{name}' of {prim.GetPath()} is '{found}': state X, Y or Z")
        return found

    def refused(self, code: str, problem: str) -> AssetError:
        """The error that names the file."""
        return unconvertible_error(self.file, code, problem)


def wxyz(quaternion: Any) -> Array:
    """(4,) of USD's quaternion."""
    return np.array([quaternion.GetReal(), *quaternion.GetImaginary()], dtype=float)


@contextmanager
def opened(file: Path, reach: AllowedFolders) -> Iterator[UsdStage]:
    """The stage of a USD file, without USD's own messages on the console. Raises AssetError where usd-core is not
    installed, and where the file or a layer of it cannot be read, lies outside ``reach`` or refers to itself."""
    try:
        from pxr import Pcp, Tf, Usd, UsdUtils
    except ModuleNotFoundError as error:
        problem = "reading USD needs usd-core: pip install 'asset2sim[usd]', or keep a URDF of it"
        raise unconvertible_error(file, "usd_missing", problem) from error
    quiet = UsdUtils.CoalescingDiagnosticDelegate()
    try:
        layers = checked_layers(file, reach)
        stage, notes = Usd.Stage.Open(str(file.resolve())), list[str]()
        for problem in stage.GetCompositionErrors():
            where, text = str(problem.rootSite.path), " ".join(str(problem).split())
            if isinstance(problem, Pcp.ErrorArcCycle):
                raise unconvertible_error(file, "usd_cycle", f"{where} refers to itself: break the circle ({text})")
            if isinstance(problem, Pcp.ErrorInvalidSublayerPath):
                raise unconvertible_error(file, "usd_layer", f"{text} Restore the layer")
            notes.append(f"{where}: {text}")
        yield UsdStage(file, stage, layers, list(dict.fromkeys(notes)))
    except Tf.ErrorException as error:
        raise unconvertible_error(
            file, "usd_unreadable", f"no USD that can be read; export it again: {told(error)}"
        ) from error
    finally:
        quiet.TakeUncoalescedDiagnostics()
        del quiet


def told(error: Exception) -> str:
    """USD's own words on an error, without the places in its source; where they quote what is no text, that."""
    try:
        text = str(error)
    except UnicodeDecodeError:
        return "it is no UTF-8"
    said = re.findall(r" : '(.*?)'\s*(?=\n\s*Error in|$)", text, re.DOTALL)
    return " ".join("; ".join(said or [text]).split())


def checked_layers(file: Path, reach: AllowedFolders) -> tuple[Path, ...]:
    """The files of the layers of which a USD file consists, each opened only after it was found to lie within
    ``reach``. Raises AssetError for one that does not, and for what would name files as it is evaluated."""
    from pxr import Ar, Sdf

    unread, read, files = [str(file.resolve())], set[str](), dict[Path, None]()
    while unread:
        name = unread.pop()
        place = str(Ar.GetResolver().Resolve(name))
        if not place or place in read:
            continue  # of what is not there the stage says by whom it is missed
        read.add(place)
        path = Path(Ar.SplitPackageRelativePathOuter(place)[0])
        if not reach.allows(path):
            raise unconvertible_error(file, "outside_dataset", f"'{path.name}' {lies_outside(path, reach)}")
        if (problem := file_problem(path)) is not None:
            raise unconvertible_error(file, "usd_layer", f"'{path.name}' {problem}: replace it by a file")
        layer = Sdf.Layer.FindOrOpen(name)
        if layer is None:
            problem = f"'{path.name}' is no USD that can be read, or is cut off: export it again"
            raise unconvertible_error(file, "usd_unreadable", problem)
        files[path] = None
        for dependency in filter(None, layer.GetCompositionAssetDependencies()):
            if Sdf.VariableExpression.IsExpression(dependency):
                refuse_unchecked(file, reach, f"its reference {dependency} is an expression: flatten it")
            unread.append(Sdf.ComputeAssetPathRelativeToLayer(layer, dependency))
        if not reach.anywhere:
            layer.Traverse(Sdf.Path.absoluteRootPath, lambda at, layer=layer: refuse_clips(file, reach, layer, at))
    return tuple(path for path in files if path != file.resolve())


def refuse_clips(file: Path, reach: AllowedFolders, layer: Any, at: Any) -> None:
    """Refuse a prim whose values would come from files of clips."""
    if at.IsPrimPath() and layer.GetPrimAtPath(at).HasInfo("clips"):
        refuse_unchecked(file, reach, f"{at} takes its values from clips: flatten it")


def refuse_unchecked(file: Path, reach: AllowedFolders, problem: str) -> None:
    """Refuse what names files only as it is evaluated, but where all may be read."""
    if not reach.anywhere:
        raise unconvertible_error(
            file, "outside_dataset", f"{problem} (usdcat --flatten), or allow it by --allow-outside"
        )
