"""The table of what a URDF cannot say: what every engine's own loader honours, measured, and the remedy.
``make loaders`` writes it from a refined sample dataset."""

import math
import shutil
import tempfile
import textwrap
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from operator import attrgetter
from pathlib import Path

from asset2sim.assets.authored import read_overlay
from asset2sim.assets.exports.mjcf import export_mjcf
from asset2sim.assets.exports.refined_object import ExportJoint, ExportObject, read_object
from asset2sim.catalog.text import markdown_table
from asset2sim.engines.registry import engine_version, installed, known_engines
from lab.loaders import probes
from lab.loaders.loaded import Loader
from schemas.errors import UsageError
from schemas.settings import EngineSettings

BLOCK = "loaders"
"""Name of the page's block."""
LID, PEDAL, BUCKET, BOX = "laptop_silver", "trashcan_pedal", "bucket_yellow", "box_wooden"
"""Samples with a lid that friction holds, with a part that a spring returns, with a hollow, and one that slides on a
slope before it topples."""
MODULES = {engine: name for engine in known_engines() if find_spec(name := f"lab.loaders.load_{engine}") is not None}
"""Engine → the module with its own ways to load a URDF, which is named for it."""
SAME = 0.1
"""A term is honoured if what is measured differs from what is stated by at most this share."""
CREEP = 1e-2
"""Largest motion of a held part, rad or m, over three seconds: the rest check's own bound."""
YES, NO, PARTLY = "yes", "no", "partly"
friction_of, stiffness_of = attrgetter("dynamics.friction"), attrgetter("dynamics.stiffness")
"""Friction (N·m or N) and stiffness (N·m/rad or N/m) of a joint."""

ELSEWHERE = (
    (
        "Drake",
        "warns of a joint's `friction` and leaves it out; `effort` counts only with a `<transmission>`",
        "none in a file: apply the friction torque from `overlay.json` yourself",
    ),
    (
        "Genesis",
        "adds 0.1 kg·m² (kg) of armature to every joint: `default_armature=0.1`; our laptop's lid has {inertia:.2g}",
        "`gs.morphs.URDF(…, default_armature=0.0)`; `gs.morphs.MJCF` has the same default",
    ),
)
"""What is known of engines that are not installed here, from their sources: ``ParseJointDynamics`` of Drake's
``multibody/parsing/detail_urdf_parser.cc``, and ``URDF.default_armature`` of Genesis' ``options/morphs.py``."""


@dataclass(frozen=True)
class Sample:
    """A refined sample in a folder of its own, with its MJCF, and the joint that is looked at."""

    folder: Path
    item: ExportObject
    joint: ExportJoint


@dataclass(frozen=True)
class SampleObjects:
    """The samples that the rows are measured on."""

    lid: Sample
    pedal: Sample
    bucket: Sample
    box: Sample


@dataclass(frozen=True)
class Cell:
    """Whether a loader honours a term, and what was measured."""

    verdict: str
    note: str = ""

    @property
    def text(self) -> str:
        """As it stands in the table."""
        return f"{self.verdict}: {self.note}" if self.note else self.verdict


Row = Callable[[Loader, SampleObjects], Cell]


def compared(measured: float, stated: float, unit: str) -> Cell:
    """Yes where the measured value is the stated one; else no, with the measured value."""
    if abs(measured - stated) <= SAME * abs(stated):
        return Cell(YES)
    return Cell(NO, f"{measured:.2g} {unit}".strip())


def inertia(loader: Loader, samples: SampleObjects) -> Cell:
    """Mass and inertia, as a push on the box's lid meets them, which is thicker at its latch."""
    one = samples.box
    point = probes.stated_inertia(one.item, one.joint, own=False)
    met = probes.read_inertia(loader, one.folder, one.item, one.joint) - point
    share = met / (probes.stated_inertia(one.item, one.joint) - point)
    return Cell(YES) if abs(share - 1.0) <= SAME else Cell(NO, f"{share:.2g} times its own")


def damping(loader: Loader, samples: SampleObjects) -> Cell:
    """Damping of the lid's hinge."""
    one = samples.lid
    measured = probes.read_damping(loader, one.folder, one.item, one.joint)
    return compared(measured, one.joint.dynamics.damping, "N·m·s/rad")


def friction(loader: Loader, samples: SampleObjects) -> Cell:
    """Dry friction of the lid's hinge: what moves it."""
    one = samples.lid
    stated = one.joint.dynamics.friction
    measured = probes.breakaway(loader, one.folder, one.item, one.joint, EngineSettings().timestep_s)
    if math.isinf(measured):
        return Cell(NO, "a hidden motor: no push moves it")
    if measured > 0.0:
        return compared(measured, stated, "N·m")
    taken = probes.push_taken(loader, one.folder, one.joint, stated)
    return Cell(NO, f"0 N·m, but {100.0 * taken:.0f} % of every push is lost" if taken > SAME else "0 N·m")


def spring(loader: Loader, samples: SampleObjects) -> Cell:
    """The pedal's spring: the share of its force that is there."""
    one = samples.pedal
    share = probes.spring_share(loader, one.folder, one.item, one.joint)
    return Cell(NO, "no force") if abs(share) < SAME else compared(share, 1.0, "times it")


def state(loader: Loader, samples: SampleObjects) -> Cell:
    """The state after loading."""
    found, wanted = probes.loaded_state(loader, samples.lid.folder), samples.lid.item.initial
    name = samples.lid.joint.name
    same = all(abs(found[joint] - value) < 1e-3 for joint, value in wanted.items())
    return Cell(YES) if same else Cell(NO, f"{found[name]:.2g} rad")


def contact(loader: Loader, samples: SampleObjects) -> Cell:
    """Friction of the object on a floor."""
    one = samples.box
    return compared(probes.slope_that_holds(loader, one.folder, one.item), one.item.contact_friction, "")


def hollows(loader: Loader, samples: SampleObjects) -> Cell:
    """Convex pieces of a hollow body, each by itself: a ball falls through the hollow."""
    return Cell(YES if probes.ball_falls_inside(loader, samples.bucket.folder, samples.bucket.item) else NO)


def effort(loader: Loader, samples: SampleObjects) -> Cell:
    """The effort limit, against a push of twice as much."""
    one = samples.lid
    share = probes.effort_share(loader, one.folder, one.item, one.joint)
    return Cell(YES, "of motors") if share < SAME else Cell(NO if share > 1.0 - SAME else PARTLY)


def free_root(loader: Loader, samples: SampleObjects) -> Cell:
    """A root that nothing holds."""
    return Cell(YES) if probes.root_falls(loader, samples.lid.folder) else Cell(NO, "fixed to the world")


def holding(loader: Loader, samples: SampleObjects) -> Cell:
    """Section on holding: the lid in its state, left alone."""
    one = samples.lid
    moved = probes.creep(loader, one.folder, one.joint, one.item.initial)
    return Cell(YES if moved <= CREEP else NO, f"{moved:.2g} rad")


ROWS: dict[str, Row] = {
    "mass and inertia": inertia,
    "free root": free_root,
    "joint damping": damping,
    "joint friction": friction,
    "spring": spring,
    "initial state": state,
    "contact friction": contact,
    "hollow shapes stay hollow": hollows,
    "effort limit": effort,
    "held lid stays, 3 s": holding,
}
"""Row of the table → how it is measured."""


def loaders() -> tuple[Loader, ...]:
    """Every way to load that can be tried here, engine by engine."""
    found: list[Loader] = []
    for engine in filter(MODULES.get, installed()):
        found.extend(import_module(MODULES[engine]).LOADERS)
    return tuple(found)


@contextmanager
def samples_of(out: Path) -> Iterator[SampleObjects]:
    """Copies of the refined samples in OUT, each with its MJCF, until the block ends. Raises UsageError where OUT has
    them not, or they have no such joint."""
    with tempfile.TemporaryDirectory() as place:
        copies = [prepared(out / "assets" / name, Path(place) / name) for name in (LID, PEDAL, BUCKET, BOX)]
        terms = (friction_of, stiffness_of, friction_of, friction_of)
        joints = [
            max((joint for joint in item.joints if joint.moves), key=term)
            for item, term in zip(copies, terms, strict=True)
        ]
        if not friction_of(joints[0]) or not stiffness_of(joints[1]):
            raise UsageError(f"'{LID}' has no joint with friction, or '{PEDAL}' none with a spring")
        yield SampleObjects(*(Sample(item.folder, item, joint) for item, joint in zip(copies, joints, strict=True)))


def prepared(refined: Path, copy: Path) -> ExportObject:
    """A copy of a refined folder with its MJCF, read. Raises UsageError where it is not there."""
    if not (refined / "overlay.json").is_file():
        raise UsageError(f"no refined '{refined.name}' in {refined.parent}; run make flow")
    shutil.copytree(refined, copy)
    overlay = read_overlay(copy)
    export_mjcf(copy, overlay, EngineSettings().timestep_s)
    return read_object(copy, overlay)


def measured(samples: SampleObjects, ways: Sequence[Loader]) -> dict[str, dict[str, Cell]]:
    """Row → loader → cell."""
    return {name: {way.name: row(way, samples) for way in ways} for name, row in ROWS.items()}


def loaders_block(out: Path) -> str:
    """Both tables with what they are of: the measured one, and that of engines not installed here."""
    ways = loaders()
    with samples_of(out) as samples:
        cells = measured(samples, ways)
        lid = samples.lid
        stated = probes.stated_inertia(lid.item, lid.joint)
        friction_stated = samples.box.item.contact_friction
    rows = [[name, *(cells[name][way.name].text for way in ways)] for name in ROWS]
    table = markdown_table(("", *(way.name for way in ways)), rows)
    calls = "; ".join(f"{way.name}: `{way.how}`" for way in ways)
    versions = ", ".join(f"{engine} {engine_version(engine)}" for engine in installed())
    terms = lid.joint.dynamics
    about = (
        f"Measured, with {versions}, on `{LID}` (its lid has damping {terms.damping:.2g} N·m·s/rad, friction "
        f"{terms.friction:.2g} N·m, and starts at {lid.joint.initial:.2g} rad), `{BOX}` (inertia, and contacts: "
        f"{friction_stated:.2g}), `{PEDAL}` (spring) and `{BUCKET}` (hollow). Where an engine itself holds "
        f"a joint (PyBullet's motor, SAPIEN's friction), inertia, damping and effort are measured without it. {calls}."
    )
    others = markdown_table(
        ("engine", "what it does", "remedy"),
        [(name, does.format(inertia=stated), remedy) for name, does, remedy in ELSEWHERE],
    )
    about = textwrap.fill(about, 130, break_long_words=False, break_on_hyphens=False)
    return f"{table}\n\n{about}\n\nReported by others or read in their sources, not measured here:\n\n{others}"
