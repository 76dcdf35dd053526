"""Refine a sample with the product's sdist and wheel alone, without the laboratory and without the checkout.

``python -m tests.wheel_alone``, in the checkout's environment, whose installed dependencies the new ones borrow: one
has the sdist and all of them, one the wheel and what the core needs. The wheel is built from the sdist. Exits non-zero
where twine finds a fault, a file of the packages is missing, the wheel or the core is too large, an object is not
refined and drawn, the core needs more than it says or is slow to start, or what is not installed is not named where it
is asked for.
"""

import importlib.util
import json
import os
import re
import subprocess
import sys
import sysconfig
import tempfile
import venv
import zipfile
from collections.abc import Callable
from importlib import metadata
from pathlib import Path

from packaging.requirements import Requirement

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("asset2sim", "flows", "schemas", "tasks")
SAMPLE = "laptop_silver"
OWN = ("asset2sim", "__editable__", "_editable_impl_")
"""Beginnings of the names in an environment's packages that stand for the checkout and its laboratory."""
MOST_BYTES, MOST_CORE_BYTES, MOST_IMPORT_S = 5_000_000, 600_000_000, 1.0
"""Sizes of the wheel and of the core with all that it needs, installed, and processor time of ``--help`` in the core;
0.5 s where nothing else runs."""
PIPELINE = ("dask", "distributed", "duckdb", "fastapi", "litellm", "mlflow", "pandas", "prefect", "pyarrow", "pybullet",
            "sqlalchemy", "uvicorn")  # fmt: skip
"""Packages that the core's environment must not have."""
OF_THE_LABORATORY = (["rate", "out"], ["probe", "out"])

WHERE = """
import importlib, importlib.metadata, importlib.util, sys
names = sys.argv[1].split(",")
assert importlib.util.find_spec("lab") is None, "the laboratory can be imported"
assert not [item for item in importlib.metadata.distributions() if item.name == "asset2sim-lab"], "it is installed"
print("\\n".join(importlib.import_module(name).__file__ for name in names))
"""


def built(folder: Path) -> tuple[Path, Path]:
    """The product's sdist, built from the checkout into a folder, and its wheel, built from the sdist."""
    subprocess.run([sys.executable, "-m", "build", "--outdir", str(folder), str(ROOT)], capture_output=True, check=True)
    (sdist,), (wheel,) = folder.glob("asset2sim-*.tar.gz"), folder.glob("asset2sim-*.whl")
    return sdist, wheel


def check_descriptions(*packed: Path) -> None:
    """Exit where a package index would refuse what an sdist or a wheel says of itself, or not show its README."""
    words = [sys.executable, "-m", "twine", "check", "--strict", *map(str, packed)]
    done = subprocess.run(words, capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"twine finds a fault in the packages: {done.stdout}{done.stderr}")


def check_contents(wheel: Path) -> None:
    """Exit where the wheel lacks a tracked file of the packages, a table or a template as much as a module."""
    listed = subprocess.run(["git", "ls-files", *PACKAGES], cwd=ROOT, capture_output=True, text=True, check=True)
    with zipfile.ZipFile(wheel) as packed:
        lost = sorted(set(listed.stdout.split()) - set(packed.namelist()))
    if wheel.stat().st_size > MOST_BYTES:
        sys.exit(f"the wheel has {wheel.stat().st_size} bytes; at most {MOST_BYTES}")
    if lost or not listed.stdout:
        sys.exit(f"the wheel lacks {len(lost)} files of the packages: {', '.join(lost[:10])}")


def environment(folder: Path, packed: Path, wanted: Callable[[str], bool]) -> Path:
    """The programs of a new environment with a wheel or sdist, and links to the files here of ``wanted``
    distributions."""
    venv.create(folder, with_pip=False, symlinks=True)
    programs = folder / "bin"
    python = str(programs / "python")
    where = [python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"]
    place = Path(subprocess.run(where, capture_output=True, text=True, check=True).stdout.strip())
    here, linked = Path(sysconfig.get_path("purelib")), set[str]()
    for item in metadata.distributions(path=[str(here)]):
        if wanted(canonical(item.name)):
            linked |= {file.parts[0] for file in item.files or () if ".." not in file.parts}
    for name in linked:
        if not name.startswith(OWN) and not name.endswith(".pth") and (here / name).exists():
            (place / name).symlink_to(here / name)
    install = [sys.executable, "-m", "pip", "--python", python, "--quiet", "install", "--no-deps"]
    # An sdist is built first, by what the index has.
    further = ["--no-index"] if packed.suffix == ".whl" else []
    subprocess.run([*install, "--disable-pip-version-check", *further, str(packed)], check=True)
    return programs


def canonical(name: str) -> str:
    """A distribution's name as others name it."""
    return re.sub(r"[-_.]+", "-", name).lower()


def needed(wheel: Path) -> set[str]:
    """The distributions that the wheel needs without an extra, and what these need."""
    with zipfile.ZipFile(wheel) as packed:
        (name,) = (name for name in packed.namelist() if name.endswith(".dist-info/METADATA"))
        lines = packed.read(name).decode().splitlines()
    open_ = [Requirement(line.partition(": ")[2]) for line in lines if line.startswith("Requires-Dist: ")]
    found = dict[str, set[str]]()
    while open_:
        requirement = open_.pop()
        name, extras = canonical(requirement.name), {"", *requirement.extras}
        if requirement.marker is not None and "extra" in str(requirement.marker):
            continue
        if requirement.marker is not None and not requirement.marker.evaluate({"extra": ""}):
            continue
        new = extras - found.setdefault(name, set())
        if not new:
            continue
        found[name] |= new
        for text in metadata.requires(name) or ():
            inner = Requirement(text)
            if inner.marker is None or any(inner.marker.evaluate({"extra": extra}) for extra in new):
                inner.marker = None
                open_.append(inner)
    return set(found)


def check_size(core: set[str], wheel: Path) -> int:
    """The bytes of the core's distributions as they are installed here, and of the wheel's files; exit where they are
    too many."""
    files = [Path(str(file.locate())) for name in core for file in metadata.files(name) or ()]
    total = sum(file.stat().st_size for file in files if file.is_file())
    with zipfile.ZipFile(wheel) as packed:
        total += sum(item.file_size for item in packed.infolist())
    if total > MOST_CORE_BYTES:
        sys.exit(f"the core has {total} bytes with the {len(core)} packages that it needs; at most {MOST_CORE_BYTES}")
    return total


def check_core(programs: Path, run: Callable[..., subprocess.CompletedProcess[str]]) -> None:
    """Exit where the core alone does not check, refine, convert and load an object, names no extra, or is slow."""
    there = run("python", "-c", f"import importlib.util as u; print([n for n in {PIPELINE} if u.find_spec(n)])")
    if there.stdout.strip() != "[]":
        sys.exit(f"the core's environment is none: {there.stdout}{there.stderr}")
    sample = str(next((ROOT / "data" / "raw").glob(f"*/{SAMPLE}")))
    raw = run("asset2sim", "check", sample, "--sarif", "raw.sarif", "--fix", "fixed", "--no-interaction")
    found = json.loads((programs.parents[1] / "raw.sarif").read_text(encoding="utf-8"))["runs"][0]["results"]
    view = programs.parents[1] / "fixed" / "assets" / SAMPLE / "views" / "front.png"
    if raw.returncode or not found or not view.is_file() or "PyBullet is not installed" not in raw.stderr:
        sys.exit(f"the core does not check and mend {SAMPLE}: {raw.stdout}{raw.stderr}")
    loads = "from asset2sim.load import load; item = load('fixed/assets/{}', engine='mujoco'); item.step()"
    for words in (
        ["asset2sim", "convert", f"fixed/assets/{SAMPLE}", "--to", "mjcf", "--out", "converted"],
        ["asset2sim", "describe", f"fixed/assets/{SAMPLE}"],
        ["python", "-c", loads.format(SAMPLE)],
    ):
        done = run(*words)
        if done.returncode:
            sys.exit(f"in the core {' '.join(words)} fails: {done.stdout}{done.stderr}")
    for words in (["query", "SELECT 1", "--out", "fixed"], ["nightly", sample, "--out", "fixed"]):
        refused = run("asset2sim", *words)
        if refused.returncode != 2 or "pip install 'asset2sim[pipeline]'" not in refused.stderr:
            sys.exit(f"in the core {' '.join(words)} does not name the extra: {refused.stdout}{refused.stderr}")
    timed = "import os, subprocess, sys; subprocess.run(['asset2sim', '--help'], stdout=-3); t = os.times()"
    seconds = float(run("python", "-c", f"{timed}; print(t.children_user + t.children_system)").stdout)
    if seconds > MOST_IMPORT_S:
        sys.exit(f"asset2sim --help takes {seconds:.2f} s of a processor in the core, more than {MOST_IMPORT_S}")


def main() -> None:
    """Build, install and refine."""
    lost = [name for name in ("build", "twine") if importlib.util.find_spec(name) is None]
    if lost:
        sys.exit(f"not installed: {', '.join(lost)}; run `make install`, which brings the extra `dev`")
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "ASSET2SIM_", "MAKE"))}
    with tempfile.TemporaryDirectory(prefix="asset2sim-wheel-") as name:
        work = Path(name)
        sdist, wheel = built(work)
        check_descriptions(sdist, wheel)
        check_contents(wheel)
        programs = environment(work / "environment", sdist, lambda name: True)
        path = kept.get("PATH", "")

        def run(*words: str) -> subprocess.CompletedProcess[str]:
            kept["PATH"] = f"{programs}{os.pathsep}{path}"
            return subprocess.run(words, cwd=work, env=kept, capture_output=True, text=True, timeout=600)

        found = run("python", "-c", WHERE, ",".join(PACKAGES))
        if found.returncode or not all(line.startswith(str(work)) for line in found.stdout.split()):
            sys.exit(f"what is imported is not the sdist's: {found.stdout}{found.stderr}")
        done = run("asset2sim", "refine", str(ROOT / "data" / "raw"), "--assets", SAMPLE, "--out", "out", "--strict")
        written = [work / "out" / "report" / "index.html", work / "out" / "assets" / SAMPLE / "mobility.urdf"]
        if done.returncode or not all(file.is_file() for file in written):
            sys.exit(f"the sdist alone does not refine {SAMPLE}:\n{done.stdout}{done.stderr}")
        for words in OF_THE_LABORATORY:
            refused = run("asset2sim", *words)
            if refused.returncode != 2 or "asset2sim-lab" not in refused.stderr:
                sys.exit(f"{' '.join(words)} does not name the laboratory: {refused.stdout}{refused.stderr}")
        core = needed(wheel)
        total = check_size(core, wheel)
        programs = environment(work / "core", wheel, core.__contains__)
        check_core(programs, run)
    sys.stdout.write(f"{sdist.name} with everything and {wheel.name} with {len(core)} packages, {total / 1e6:.0f} MB, "
                     f"refine {SAMPLE}\n")  # fmt: skip


if __name__ == "__main__":
    main()
