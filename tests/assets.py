"""Small assets written by tests: URDF text, OBJ boxes, and models that answer what a test wants."""

import csv
import hashlib
import json
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from asset2sim.assets.extract import Extraction
from asset2sim.baselines.declared_method import known_methods
from asset2sim.intake.origin import extract
from asset2sim.models.prior.answer import answer
from schemas.asset import AssetRef
from schemas.request import ModelAnswer, ModelRequest
from schemas.settings import Settings, ViewSettings
from tasks.extract import extract_asset
from tasks.progress import AssetJob
from tasks.synthesize import with_users_numbers
from tasks.validate import Validated, validate_overlay

ROOT = Path(__file__).resolve().parents[1]
RAW = ROOT / "data" / "raw"
SHARED = ROOT.parent / "shared"
NO_VIEWS = Settings(views=ViewSettings(write=False))
"""The settings of a run without pictures, which take longer than all the rest."""
WALL = ((1, 2, 3), (1, 3, 4), (5, 7, 6), (5, 8, 7), (1, 5, 6), (1, 6, 2), (4, 3, 7), (4, 7, 8), (1, 4, 8), (1, 8, 5),
        (2, 6, 7), (2, 7, 3))  # fmt: skip

Ask = Callable[[ModelRequest], ModelAnswer]
Vector = tuple[float, float, float]


def box_obj(low: Vector, high: Vector, head: str = "") -> str:
    """The OBJ text of a closed box, wound outwards, after ``head``'s lines."""
    (a, b, c), (d, e, f) = low, high
    corners = [(a, b, c), (a, e, c), (d, e, c), (d, b, c), (a, b, f), (a, e, f), (d, e, f), (d, b, f)]
    lines = [f"v {x} {y} {z}" for x, y, z in corners] + [f"f {i} {j} {k}" for i, j, k in WALL]
    return head + "\n".join(lines) + "\n"


def shape(size: str, tags: str = "visual collision", xyz: str = "0 0 0") -> str:
    """A URDF box as visual, collision or both."""
    return "".join(
        f'<{tag}><origin xyz="{xyz}"/><geometry><box size="{size}"/></geometry></{tag}>' for tag in tags.split()
    )


def mesh(file: str, tags: str = "visual collision") -> str:
    """A URDF mesh reference as visual, collision or both."""
    return "".join(f'<{tag}><geometry><mesh filename="{file}"/></geometry></{tag}>' for tag in tags.split())


def link(name: str, inside: str = "") -> str:
    return f'<link name="{name}">{inside}</link>'


def joint(name: str, kind: str, parent: str, child: str, *, xyz: str = "0 0 0", axis: str | None = None,
          limit: str | None = None, more: str = "") -> str:  # fmt: skip
    """A URDF joint; ``limit`` is "lower upper"."""
    body = f'<origin xyz="{xyz}"/><parent link="{parent}"/><child link="{child}"/>'
    body += f'<axis xyz="{axis}"/>' if axis else ""
    if limit:
        lower, upper = limit.split()
        body += f'<limit lower="{lower}" upper="{upper}"/>'
    return f'<joint name="{name}" type="{kind}">{body}{more}</joint>'


def robot(*parts: str) -> str:
    return '<?xml version="1.0"?>\n<robot name="thing">' + "\n".join(parts) + "</robot>"


def written(folder: Path, urdf: str, files: Mapping[str, str | bytes] | None = None) -> Path:
    """Write an asset folder with ``mobility.urdf`` and other files, and return it."""
    return laid_out(folder, {"mobility.urdf": urdf, **(files or {})})


def laid_out(folder: Path, files: Mapping[str, str | bytes]) -> Path:
    """Write these files below a folder, and return it."""
    for name, data in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data.encode() if isinstance(data, str) else data)
    return folder


def read(folder: Path, category: str | None = None) -> Extraction:
    return extract(AssetRef(asset_id=folder.name, path=str(folder), category=category))


def cabinet() -> str:
    """A body of 1 x 1 x 1 m, a lid that lies level on a hinge along y, a drawer along x and a knob that turns for ever.

    The lid's centre is 0.2 m from its hinge. Every link is a box that its URDF states, so all volumes are known.
    """
    return robot(
        link("body", shape("1 1 1")),
        link("lid", shape("0.4 0.2 0.1", xyz="0.2 0 0")),
        link("drawer", shape("0.5 0.4 0.2")),
        link("knob", shape("0.1 0.1 0.1", xyz="0 0.05 0")),
        joint("lid_hinge", "revolute", "body", "lid", xyz="0 0 0.8", axis="0 -1 0", limit="0 1"),
        joint("drawer_slide", "prismatic", "body", "drawer", xyz="1 0 0", axis="1 0 0", limit="0 0.4"),
        joint("knob_turn", "continuous", "drawer", "knob", xyz="0 0.3 0", axis="0 1 0"),
    )


def saying(overlay: Mapping[str, object]) -> Ask:
    """A model that always answers this overlay."""
    return lambda request: ModelAnswer(content=json.dumps(overlay), calls=())


def prior(request: ModelRequest) -> ModelAnswer:
    """The offline model, without the gateway."""
    return ModelAnswer(content=answer(request.text), calls=())


def sample(asset_id: str, base: Path = RAW) -> AssetRef:
    """One asset of a dataset with a manifest."""
    with (base / "manifest.csv").open(newline="", encoding="utf-8") as file:
        row = next(row for row in csv.DictReader(file) if row["asset_id"] == asset_id)
    return AssetRef(
        asset_id=asset_id, path=str(base / row["path"]), category=row["category"] or None, prompt=row["prompt"]
    )


def validated(ref: AssetRef, out: Path, settings: Settings = NO_VIEWS) -> Validated:
    """The overlay that the rules make of an asset with the offline model; no engine has seen it."""
    job, method = AssetJob(ref, out, settings, prior), known_methods()[settings.method]
    extracted = extract_asset(job, correct_joints=method.rules)
    ask, known = method.given(job.ask, extracted.extraction)
    job = replace(job, guidance=extracted.guidance, ask=ask)
    proposal = with_users_numbers(method.propose, job, known).proposal
    return validate_overlay(job, known, proposal, rules=method.rules)


def fingerprint(folder: Path) -> dict[str, str]:
    """Every file under a folder, by its relative path → the hash of its bytes."""
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return {path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def near(found: object, wanted: object, tolerance: float = 1e-9) -> bool:
    """Whether two numbers or arrays agree to a relative and absolute tolerance."""
    return bool(np.allclose(np.asarray(found, float), np.asarray(wanted, float), rtol=tolerance, atol=tolerance))
