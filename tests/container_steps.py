"""Run the Dockerfile's steps without a daemon: ``python -m tests.container_steps``, as root on Linux, with a network.

Over this machine's files lies an overlay in a mount namespace of its own. In it every step is run as it stands, by the
user and in the folder that it names; Python 3.11 of this machine in a new environment is the base image, and the
checkout is hidden. Then the image's command refines a sample, serves its pages, and the health check must pass.
Exits non-zero, with the step, where one fails. Nothing of it is left, and this machine's own files stay as they are.
"""

import json
import os
import re
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
KNOWN = ("FROM", "RUN", "WORKDIR", "COPY", "USER", "ENV", "EXPOSE", "HEALTHCHECK", "ENTRYPOINT", "CMD")
BASE = "/opt/base"
"""Where the environment lies that stands for the base image's Python."""
PASSED_ON = ("PIP_", "http_", "https_", "HTTP_", "HTTPS_", "NO_PROXY", "no_proxy", "SSL_", "REQUESTS_")
"""Beginnings of the variables by which this machine reaches its package index."""
SAMPLE = "laptop_silver"
PAGES = ((4100, "index.html", SAMPLE), (4200, "", "<script"), (5000, "", "<script"))
"""Port, path, and what the page has: the report, Prefect's and MLflow's."""
HEALTHY_S = 120.0
"""Time in which the pages must answer, s: the health check's start period."""


def steps(text: str) -> list[tuple[str, str]]:
    """The instructions of a Dockerfile with their arguments, continued lines joined."""
    lines = [line for line in text.splitlines() if not line.lstrip().startswith("#")]
    joined = re.sub(r"\\\n\s*", " ", "\n".join(lines))
    return [(words[0], words[1]) for line in joined.splitlines() if len(words := line.split(maxsplit=1)) == 2]


class Image:
    """The image as it is built: its files below ``files``, and what its steps have set."""

    def __init__(self, files: Path) -> None:
        self.files, self.user, self.folder = files, "root", "/"
        passed = {name: value for name, value in os.environ.items() if name.startswith(PASSED_ON)}
        path = f"{BASE}/bin:/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"
        self.environment = {"HOME": "/root", "LANG": "C.UTF-8", "PATH": path, **passed}
        self.health: list[str] = []
        self.entry: list[str] = []
        self.command: list[str] = []

    def words(self, command: list[str]) -> list[str]:
        """A command of the image as one of this machine."""
        variables = [f"{name}={value}" for name, value in self.environment.items()]
        inner = ["sh", "-c", f"cd {shlex.quote(self.folder)} && exec {shlex.join(command)}"]
        return ["chroot", f"--userspec={self.user}", str(self.files), "env", "-i", *variables, *inner]

    def run(self, *command: str) -> None:
        """Run a command of the image; exit where it fails."""
        began = time.monotonic()
        done = subprocess.run(self.words(list(command)), check=False)
        if done.returncode:
            sys.exit(f"exit code {done.returncode}: {shlex.join(command)}")
        print(f"  {time.monotonic() - began:.0f} s", flush=True)

    def copy(self, names: list[str], to: str) -> None:
        """Copy files and folders of the checkout, as .dockerignore lets them in."""
        target = self.files / self.folder.lstrip("/") / to
        for name in names:
            source = ROOT / name
            if source.is_dir():
                shutil.copytree(source, target, ignore=shutil.ignore_patterns("__pycache__"))
            else:
                shutil.copy2(source, target)

    def step(self, name: str, said: str) -> None:
        """Do one instruction."""
        print(f"{name} {said}", flush=True)
        match name:
            case "RUN":
                self.run("sh", "-c", said)
            case "WORKDIR":
                self.folder = said
                (self.files / said.lstrip("/")).mkdir(parents=True, exist_ok=True)
            case "COPY":
                *names, to = said.split()
                self.copy(names, to)
            case "USER":
                self.user = said
            case "ENV":
                self.environment |= dict(word.split("=", 1) for word in shlex.split(said))
            case "HEALTHCHECK":
                self.health = json.loads(said.partition("CMD ")[2])
            case "ENTRYPOINT":
                self.entry = json.loads(said)
            case "CMD":
                self.command = json.loads(said)


def base_image(work: Path) -> Image:
    """This machine's files under an overlay, without the checkout, with a new environment of this Python."""
    places = {name: work / name for name in ("upper", "working", "files")}
    for place in places.values():
        place.mkdir()
    options = f"lowerdir=/,upperdir={places['upper']},workdir={places['working']}"
    files = places["files"]
    for words in (
        ["mount", "-t", "overlay", "overlay", "-o", options, str(files)],
        ["mount", "-t", "proc", "proc", f"{files}/proc"],
        ["mount", "--rbind", "/dev", f"{files}/dev"],
        ["mount", "-t", "tmpfs", "tmpfs", f"{files}{ROOT}"],
        [os.path.realpath(sys.executable), "-m", "venv", f"{files}{BASE}"],
        # The image has no users yet.
        ["chroot", str(files), "sh", "-c", 'user=$(id -nu 1000 2>/dev/null) && userdel "$user" || true'],
    ):
        subprocess.run(words, check=True)
    # Scripts begin with the environment's own path, which is another one within.
    for script in (files / BASE.lstrip("/") / "bin").iterdir():
        if not script.is_symlink():
            script.write_text(script.read_text(encoding="utf-8").replace(str(files), ""), encoding="utf-8")
    for folder in Path(f"{files}{os.path.realpath(sys.executable)}").parents:
        if folder.is_relative_to(files) and folder != files:
            folder.chmod(folder.stat().st_mode | 0o055)
    return Image(files)


def answer(opener: urllib.request.OpenerDirector, address: str) -> str:
    """The text served at an address, or why nothing is."""
    try:
        with opener.open(address, timeout=30.0) as served:
            return str(served.read().decode())
    except OSError as error:
        return str(error)


def check_pages(image: Image) -> None:
    """Serve the pages of what was refined; exit where the health check fails or another address than this machine's
    loopback gets no answer."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.connect(("192.0.2.1", 9))
        address = probe.getsockname()[0]
    served = subprocess.Popen(image.words([*image.entry, "ui", "--out", "/out", "--host", "0.0.0.0"]))
    try:
        end = time.monotonic() + HEALTHY_S
        while subprocess.run(image.words(image.health), stderr=subprocess.DEVNULL, check=False).returncode:
            if time.monotonic() > end or served.poll() is not None:
                sys.exit("the health check fails")
            time.sleep(1.0)
        print(f"healthy after {HEALTHY_S - (end - time.monotonic()):.0f} s", flush=True)
        opener = urllib.request.build_opener(urllib.request.ProxyHandler({}))
        for port, path, word in PAGES:
            while word not in (said := answer(opener, f"http://{address}:{port}/{path}")):
                if time.monotonic() > end:
                    sys.exit(f"port {port} says at {address}, which is not loopback: {said[:300]}")
                time.sleep(1.0)
            print(f"port {port} answers at an address that is not loopback", flush=True)
    finally:
        served.send_signal(signal.SIGTERM)
        served.wait(timeout=60.0)


def inside(work: Path) -> None:
    """Build the image, refine a sample in it and serve the pages."""
    image = base_image(work)
    found = steps((ROOT / "Dockerfile").read_text(encoding="utf-8"))
    for name, said in found:
        image.step(name, said)
    data = image.files / "data"
    shutil.copytree(next((ROOT / "data" / "raw").glob(f"*/{SAMPLE}")), data / SAMPLE)
    image.run(*image.entry, *image.command)
    image.run(*image.entry, "refine", "/data", "--out", "/out", "--strict")
    check_pages(image)


def main() -> None:
    """Run the steps in namespaces of their own, which end with them."""
    if sys.argv[1:2] == ["--inside"]:
        inside(Path(sys.argv[2]))
        return
    with tempfile.TemporaryDirectory(prefix="asset2sim-container-") as name:
        words = ["unshare", "--mount", "--pid", "--fork", "--kill-child"]
        code = subprocess.run([*words, sys.executable, "-m", "tests.container_steps", "--inside", name], cwd=ROOT)
    if code.returncode:
        sys.exit(code.returncode)
    print("every step of the Dockerfile ran, and its pages answer")


if __name__ == "__main__":
    main()
