"""Refine a sample with the product's wheel alone, in an environment without the laboratory and without the checkout.

``python -m tests.wheel_alone``, in the checkout's environment, whose installed dependencies the new one borrows. Exits
non-zero where a file of the packages is not in the wheel, an object is not refined, or the laboratory is not named
where one of its names is asked for.
"""

import os
import subprocess
import sys
import sysconfig
import tempfile
import venv
import zipfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("asset2sim", "flows", "schemas", "tasks")
SAMPLE = "laptop_silver"
OWN = ("asset2sim", "__editable__", "_editable_impl_")
"""Beginnings of the names in an environment's packages that stand for the checkout and its laboratory."""
OF_THE_LABORATORY = (["rate", "out"], ["probe", "out"])

WHERE = """
import importlib, importlib.metadata, importlib.util, sys
names = sys.argv[1].split(",")
assert importlib.util.find_spec("lab") is None, "the laboratory can be imported"
assert not [item for item in importlib.metadata.distributions() if item.name == "asset2sim-lab"], "it is installed"
print("\\n".join(importlib.import_module(name).__file__ for name in names))
"""


def wheel_of(folder: Path) -> Path:
    """The product's wheel, built from the checkout into a folder."""
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--disable-pip-version-check", "--no-deps"]
    subprocess.run([*build, "--wheel-dir", str(folder), str(ROOT)], check=True)
    (wheel,) = folder.glob("asset2sim-*.whl")
    return wheel


def check_contents(wheel: Path) -> None:
    """Exit where the wheel lacks a tracked file of the packages, a table or a template as much as a module."""
    listed = subprocess.run(["git", "ls-files", *PACKAGES], cwd=ROOT, capture_output=True, text=True, check=True)
    with zipfile.ZipFile(wheel) as packed:
        lost = sorted(set(listed.stdout.split()) - set(packed.namelist()))
    if lost or not listed.stdout:
        sys.exit(f"the wheel lacks {len(lost)} files of the packages: {', '.join(lost[:10])}")


def environment(folder: Path, wheel: Path) -> Path:
    """The programs of a new environment with the wheel, and links to what else is installed here."""
    venv.create(folder, with_pip=False, symlinks=True)
    programs = folder / "bin"
    python = str(programs / "python")
    where = [python, "-c", "import sysconfig; print(sysconfig.get_path('purelib'))"]
    place = Path(subprocess.run(where, capture_output=True, text=True, check=True).stdout.strip())
    for path in Path(sysconfig.get_path("purelib")).iterdir():
        if not path.name.startswith(OWN) and path.suffix != ".pth":
            (place / path.name).symlink_to(path)
    install = [sys.executable, "-m", "pip", "--python", python, "--quiet", "install", "--no-deps"]
    subprocess.run([*install, "--disable-pip-version-check", "--no-index", str(wheel)], check=True)
    return programs


def main() -> None:
    """Build, install and refine."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "ASSET2SIM_", "MAKE"))}
    with tempfile.TemporaryDirectory(prefix="asset2sim-wheel-") as name:
        work = Path(name)
        wheel = wheel_of(work)
        check_contents(wheel)
        programs = environment(work / "environment", wheel)
        kept["PATH"] = f"{programs}{os.pathsep}{kept.get('PATH', '')}"

        def run(*words: str) -> subprocess.CompletedProcess[str]:
            return subprocess.run(words, cwd=work, env=kept, capture_output=True, text=True, timeout=600)

        found = run("python", "-c", WHERE, ",".join(PACKAGES))
        if found.returncode or not all(line.startswith(str(work)) for line in found.stdout.split()):
            sys.exit(f"what is imported is not the wheel's: {found.stdout}{found.stderr}")
        done = run("asset2sim", "refine", str(ROOT / "data" / "raw"), "--assets", SAMPLE, "--out", "out", "--strict")
        written = [work / "out" / "report" / "index.html", work / "out" / "assets" / SAMPLE / "mobility.urdf"]
        if done.returncode or not all(file.is_file() for file in written):
            sys.exit(f"the wheel alone does not refine {SAMPLE}:\n{done.stdout}{done.stderr}")
        for words in OF_THE_LABORATORY:
            refused = run("asset2sim", *words)
            if refused.returncode != 2 or "asset2sim-lab" not in refused.stderr:
                sys.exit(f"{' '.join(words)} does not name the laboratory: {refused.stdout}{refused.stderr}")
    sys.stdout.write(f"{wheel.name} alone refines {SAMPLE}\n")


if __name__ == "__main__":
    main()
