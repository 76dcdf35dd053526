"""Pages of the viewer, the report, Prefect and MLflow, served until interrupted; the programs that serve them."""

import os
import signal
import subprocess
import sys
from collections.abc import Mapping, Sequence
from contextlib import suppress
from itertools import combinations
from pathlib import Path

from rich.text import Text

from asset2sim.catalog.text import output
from asset2sim.runs.option_groups import PagesOptions, ViewOptions
from asset2sim.storage.objects import open_store, working_folder
from asset2sim.viewer.serve import check_address
from schemas.errors import Asset2SimError, UsageError, complain
from schemas.settings import Settings


def serve_viewer(options: ViewOptions, settings: Settings) -> None:
    """Serve the viewer until interrupted, by Ctrl-C or SIGTERM. Raises UsageError for a port that is in use, an unknown
    asset, and where viser is not installed."""
    from asset2sim.experiments.interrupt import sigterm_as_interrupt
    from asset2sim.viewer.serve import open_viewer

    opened = open_viewer(
        options.out,
        options.asset_id,
        engine=options.engine,
        host=options.host,
        port=options.port,
        settings=settings.engine,
    )
    with suppress(KeyboardInterrupt), sigterm_as_interrupt(), opened as viewer:
        output().print(Text(f"viewer: {viewer.address}, until Ctrl-C"))
        sys.stdout.flush()
        viewer.wait()


def serve_pages(options: PagesOptions, _: Settings) -> None:
    """Serve the report and the pages of Prefect and MLflow for the runs in OUT at an address of this machine until
    interrupted, by Ctrl-C or SIGTERM. Raises UsageError for an address or port that cannot be used, a port that is
    twice the same, and a URL of no store."""
    from asset2sim.experiments.interrupt import sigterm_as_interrupt

    out, host = options.out, options.host
    if out.is_url:
        open_store(out)
        # Before the first run, MLflow begins its database there.
        working_folder(out).mkdir(parents=True, exist_ok=True)
    ports = {"Prefect": options.prefect_port, "MLflow": options.mlflow_port, "report": options.report_port}
    for name, port in ports.items():
        check_address(host, port, f" for {name}", f"--{name.lower()}-port")
    for (name, port), (other, same) in combinations(ports.items(), 2):
        if port == same:
            raise UsageError(f"--{name.lower()}-port and --{other.lower()}-port are both {port}; choose two")
    console = output()
    for name, port in ports.items():
        console.print(f"{name}: http://{host}:{port}")
    if not report_folder(out).is_dir():
        console.print(f"report: none yet; a run or asset2sim report --out {out} writes it", soft_wrap=True)
    sys.stdout.flush()
    if host not in LOOPBACK:
        complain(f"warning: {host} is open to every machine that reaches this one; {UNGUARDED}")
        # Prefect's pages would ask at the address that the server listens on, which another machine has not.
        os.environ.setdefault("PREFECT_UI_API_URL", "/api")
    with suppress(KeyboardInterrupt), sigterm_as_interrupt():
        servers = commands(out, options.prefect_port, options.mlflow_port, options.report_port, host)
        run_programs(servers, together=False)


LOOPBACK = ("127.0.0.1", "localhost")
UNGUARDED = "the pages ask for no password, and who sees them can change runs"


def report_folder(out: Path | str) -> Path:
    """The folder of this machine in which the report of ``out`` lies, where there is one."""
    from asset2sim.report.page_files import FOLDER

    return working_folder(out) / FOLDER


def commands(
    out: Path | str, prefect_port: int = 4200, mlflow_port: int = 5000, report_port: int = 4100, host: str = LOOPBACK[0]
) -> dict[str, list[str]]:
    """Name → command line of each server: MLflow of this machine, and the report from when there is one."""
    from asset2sim.catalog.mlflow_log import tracking_uri

    programs, folder = Path(sys.executable).parent, report_folder(out)
    # MLflow answers under the names of this machine alone, unless told that others are its own, too.
    named = () if host in LOOPBACK else ("--allowed-hosts", "*")
    store = tracking_uri(working_folder(out))
    return {
        "Prefect": [str(programs / "prefect"), "server", "start", "--host", host, "--port", str(prefect_port)],
        "MLflow": [str(programs / "mlflow"), "server", "--backend-store-uri", store, "--host", host, "--port",
                   str(mlflow_port), *named],
        "report": [sys.executable, "-m", "http.server", "--bind", host, "--directory", str(folder), str(report_port)],
    }  # fmt: skip


STOP_LIMIT_S = 10.0
"""Time that a program gets to end by itself, s."""


class ProgramError(Asset2SimError):
    """A program ended by itself."""


def run_programs(commands: Mapping[str, Sequence[str]], stop_limit_s: float = STOP_LIMIT_S, *, together: bool) -> None:
    """Run programs, name → command line, until interrupted. Raises ``ProgramError`` when one has ended by itself, or,
    where they do not run ``together``, the last one: of each before it, a line on standard error. Neither they nor what
    they start survives this call: they are asked to end, and killed after ``stop_limit_s`` s."""
    # Sessions of their own: a program may start others, and Ctrl-C must reach none of them twice.
    running = {name: subprocess.Popen(command, start_new_session=True) for name, command in commands.items()}
    left = dict(running)
    try:
        while left:
            for name, process in list(left.items()):
                with suppress(subprocess.TimeoutExpired):
                    code = process.wait(timeout=0.5)
                    del left[name]
                    said = f"{name} ended with exit code {code}; what it said is above"
                    if together:
                        raise ProgramError(said)
                    on = f"; {', '.join(left)} goes on" if left else ""
                    complain(f"{said}{on}")
    finally:
        _stop(list(running.values()), stop_limit_s)
    raise ProgramError("nothing is served any more")


def _stop(processes: Sequence[subprocess.Popen[bytes]], limit_s: float) -> None:
    for process in processes:
        _signal(process, signal.SIGTERM)
    for process in processes:
        with suppress(subprocess.TimeoutExpired):
            process.wait(timeout=limit_s)
    # The whole group once more: a program may end before what it started.
    for process in processes:
        _signal(process, signal.SIGKILL)
        process.wait()


def _signal(process: subprocess.Popen[bytes], number: signal.Signals) -> None:
    with suppress(ProcessLookupError):
        os.killpg(process.pid, number)
