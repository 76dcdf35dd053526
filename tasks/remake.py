"""A refined folder's recipe, and the folder made again from it and a copy of its asset, with no model and no engine."""

import os
import shutil
from pathlib import Path
from time import perf_counter

from asset2sim.assets.authored import read_overlay
from asset2sim.assets.checksums import FILE, changed_files, file_digest
from asset2sim.assets.extract import INPUTS, Extraction, folder_of
from asset2sim.assets.folder import URDF_NAME, Folder, staged_folder, write_folder
from asset2sim.assets.hulls import box_corners, obj_text
from asset2sim.assets.meshes.load import mesh_points
from asset2sim.assets.urdf.bake import bake_file, baked
from asset2sim.assets.urdf.mesh_files import material_files
from asset2sim.baselines.declared_method import known_methods
from asset2sim.engines.registry import versions_of
from asset2sim.intake.blocked_joints import find_blocked_joints
from asset2sim.intake.origin import extract
from asset2sim.refinement.collision.shapes import collision_shapes
from asset2sim.refinement.collision.trim import cut_again
from schemas.asset import AssetRef
from schemas.errors import AssetError, first_words
from schemas.inputs import InputSettings
from schemas.overlay import PhysicsOverlay
from schemas.recipe import DECIDING, MEASUREMENT_NAME, RECIPE_NAME, Outcome, Recipe, Remade
from schemas.vocabulary import DECIDING_PACKAGES, CollisionMode, StateMode, UpAxis
from tasks.progress import AssetJob
from tasks.publish import finish_folder

PACKAGE_URI = "package://"


def recipe_of(job: AssetJob, extraction: Extraction, overlay: PhysicsOverlay, folder: Folder | None) -> Recipe | None:
    """How the folder is made of the asset; None without one."""
    if folder is None:
        return None
    opened, settings = extraction.opened, job.settings
    made = {"mode": folder.mode, "cut_primitives": folder.cut_primitives}
    collision = settings.collision.model_copy(update=made)
    decided = settings.model_copy(update={"collision": collision}).model_dump(mode="json", include=DECIDING)
    return Recipe(
        asset_id=job.ref.asset_id,
        originals={
            _named(file, extraction.folder, settings.inputs): file_digest(file) for file in _originals(extraction)
        },
        part=job.ref.part,
        keep=extraction.features.keep,
        up=UpAxis.Z if opened is None else opened.up,
        corrected=known_methods()[settings.method].rules,
        settings=decided,
        cuts=folder.cuts,
        boxed=folder.boxed,
        overlay=overlay if settings.state is StateMode.BAKE else None,
        made_with=made_with(),
    )


def made_with() -> dict[str, str]:
    """Version of each installed package that decides what is written."""
    return versions_of(("asset2sim", *DECIDING_PACKAGES))


def _originals(extraction: Extraction) -> list[Path]:
    """All files of the asset that were read; not those that were made of them on the way."""
    opened = extraction.opened
    meshes = [file for file in extraction.mesh_files.values() if file is not None]
    looks = [companion for file in meshes for companion in material_files(file)]
    files = {*(() if opened is None else opened.files), *meshes, *looks, *extraction.companions.values()}
    made = None if opened is None or opened.work is None else Path(opened.work.name).resolve()
    return sorted(file for file in files if made is None or not file.resolve().is_relative_to(made))


def _named(file: Path, folder: Path, inputs: InputSettings) -> str:
    """A file's path from the asset's folder; ``package://NAME/...`` for one below the folder of a named package."""
    for name, place in inputs.package_folders.items():
        if file.resolve().is_relative_to(Path(place).resolve()):
            return f"{PACKAGE_URI}{name}/{file.resolve().relative_to(Path(place).resolve()).as_posix()}"
    return Path(os.path.relpath(file, folder)).as_posix()


def _found(name: str, folder: Path, inputs: InputSettings) -> Path:
    """The file that a recipe names. A package without a folder has none of its files."""
    if not name.startswith(PACKAGE_URI):
        return folder / name
    package, _, rest = name.removeprefix(PACKAGE_URI).partition("/")
    return Path(inputs.package_folders.get(package, folder / PACKAGE_URI)) / rest


def remake_asset(ref: AssetRef, brought: Path, out: Path, inputs: InputSettings = INPUTS) -> Remade:
    """Make ``out/assets/<asset_id>`` of a copy of the asset and of the recipe, overlay, measurements and checksums in a
    folder; ``inputs`` says where packages are and what may be read. An asset that cannot be made again is an answer,
    too, and leaves nothing."""
    started = perf_counter()
    try:
        outcome, reason = made_again(ref, brought, out, inputs)
    except (AssetError, OSError, ValueError) as error:
        outcome, reason = "failed", " ".join(str(error).split())
    return Remade(asset_id=ref.asset_id, outcome=outcome, reason=reason, seconds=perf_counter() - started)


def made_again(ref: AssetRef, brought: Path, out: Path, inputs: InputSettings) -> tuple[Outcome, str]:
    """Outcome of making an asset again, and the reason. Raises AssetError, OSError and ValueError."""
    recipe = Recipe.model_validate_json((brought / RECIPE_NAME).read_bytes())
    other = differing(recipe, folder_of(Path(ref.path)), inputs)
    if other:
        return "original", other
    final = out / "assets" / ref.asset_id
    with staged_folder(final) as folder:
        write_again(ref, recipe, brought, folder, inputs)
    changed = changed_files(final) or ()
    if not changed:
        return "same", ""
    here = made_with()
    others = [f"{name} {old}, here {here.get(name, 'none')}" for name, old in recipe.made_with.items()
              if here.get(name) != old]  # fmt: skip
    why = f"made with {'; '.join(others)}: install those" if others else "the same packages are installed: report this"
    return "differs", f"{first_words(changed, 4)} ({why})"


def differing(recipe: Recipe, folder: Path, inputs: InputSettings) -> str:
    """Which files of an asset are not there, or not those that the recipe is for, in words; empty where all are."""
    files = {name: _found(name, folder, inputs) for name in recipe.originals}
    lacking = [name for name, file in files.items() if not file.is_file()]
    others = [name for name, digest in recipe.originals.items()
              if name not in lacking and file_digest(files[name]) != digest]  # fmt: skip
    kinds = ((lacking, "not there"), (others, "another file than was refined"))
    said = [f"{first_words(names, 4)}: {what}" for names, what in kinds if names]
    packed = any(name.startswith(PACKAGE_URI) for name in lacking)
    where = "; --package NAME=FOLDER says where a package is" if packed else ""
    return f"{folder}: {'; '.join(said)}; bring the dataset's own release of it{where}" if said else ""


def write_again(ref: AssetRef, recipe: Recipe, brought: Path, target: Path, inputs: InputSettings) -> None:
    """Write the refined folder, and into it the checksums that it had. Raises AssetError and ValueError."""
    settings = recipe.run_settings
    ref = ref.model_copy(update={"keep": recipe.keep, "part": recipe.part})
    extraction = extract(ref, up=recipe.up, inputs=inputs)
    if recipe.corrected:
        extraction, _ = find_blocked_joints(extraction)
    overlay = recipe.overlay or read_overlay(brought)
    whole, _ = collision_shapes(extraction, overlay.scale, settings.collision)
    mode = settings.collision.mode
    hulls = whole if mode is CollisionMode.KEEP else cut_again(whole, recipe.cuts)
    cut_primitives = settings.collision.cut_primitives
    write_folder(extraction, overlay, hulls, target, settings.physics, mode, cut_primitives=cut_primitives)
    for name in recipe.boxed:
        text = obj_text(box_corners(mesh_points(target / name)))
        assert text is not None, "a box with thickness has volume"
        (target / name).write_text(text, encoding="ascii")
    for name in (RECIPE_NAME, MEASUREMENT_NAME):
        shutil.copyfile(brought / name, target / name)
    if settings.state is StateMode.BAKE:
        bake_file(target / URDF_NAME, overlay.initial_positions, target / URDF_NAME)
        overlay = baked(overlay)
    finish_folder(target, overlay, settings)
    shutil.copyfile(brought / FILE, target / FILE)
