"""When a nightly runs: the schedule of ``catalog.yaml``, or one from the command line."""

from datetime import UTC, datetime
from importlib import import_module
from pathlib import Path
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

import yaml

from schemas.errors import UsageError, printable

HERE = Path(__file__).resolve().parent
CATALOG_FILE = next(filter(Path.is_file, (HERE.parent / "catalog.yaml", HERE / "catalog.yaml")), HERE / "catalog.yaml")
"""The checkout's, or that in the wheel."""


def chosen_schedule(cron: str | None, path: Path = CATALOG_FILE) -> tuple[str, str]:
    """(cron line, name of its time zone): ``cron`` in the file's time zone, else the file's own. Raises UsageError."""
    if cron is None:
        return nightly_schedule(path)
    return check_cron(cron, "--cron"), nightly_schedule(path, own=False)[1]


def nightly_schedule(path: Path, *, own: bool = True) -> tuple[str, str]:
    """(cron line of five fields, name of its time zone) from ``metadata: nightly:`` of a catalog file; without ``own``
    its cron line is not looked at. Raises UsageError, naming the file and what to put there, where either is missing or
    malformed."""
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise UsageError(f"cannot read {path}: {error.strerror}") from error
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        raise UsageError(f"{path} is not YAML: {str(error).splitlines()[0]}") from error
    found = content
    for name in ("metadata", "nightly"):
        found = found.get(name) if isinstance(found, dict) else None
    if own and (not isinstance(found, dict) or "cron" not in found):
        raise UsageError(f'{path} has no schedule; add metadata: nightly: cron: "0 2 * * *"')
    stated = found if isinstance(found, dict) else {}
    zone = str(stated.get("timezone", "UTC"))
    cron = check_cron(str(stated["cron"]), f"{path}: cron") if own else ""
    try:
        ZoneInfo(zone)
    except (ZoneInfoNotFoundError, ValueError, OSError) as error:
        raise UsageError(f"{path}: unknown timezone '{zone}'; use a name such as UTC or Europe/Berlin") from error
    return cron, zone


def check_cron(cron: str, where: str) -> str:
    """The cron line, if Prefect takes it and a day will come; else UsageError, which begins with ``where``."""
    shown = printable(" ".join(cron.split()))
    if len(cron.split()) != 5:
        raise UsageError(f"{where} '{shown}' needs five fields: minute, hour, day, month, weekday, as '0 2 * * *'")
    # Late: it takes a second, and the library that Prefect reads cron lines with is one that it carries along.
    from prefect.client.schemas.schedules import CronSchedule

    try:
        CronSchedule(cron=cron, timezone="UTC")
        import_module("prefect._vendor.croniter").croniter(cron, datetime.now(UTC)).get_next()
    except ValueError as error:
        raise UsageError(
            f"{where} '{shown}' is no schedule: minute 0 to 59, hour 0 to 23, day 1 to 31, month 1 to 12, weekday 0 "
            "(Sunday) to 6, and such a day must come; '0 2 * * *' is every night at two"
        ) from error
    return cron
