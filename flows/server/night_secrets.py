"""Secrets of a nightly's settings: Prefect keeps a night's parameters in its database, so they hold a token only, which
names a file of this user's in Prefect's folder."""

import json
import os
import uuid
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from asset2sim.runs.request import RefineRequest, merged_mappings
from flows.server.server import FOLDER, deployment_name, prefect_home
from schemas.errors import UsageError
from schemas.secret import WHOLE
from schemas.settings import Settings


@contextmanager
def secrets_kept(request: RefineRequest) -> Iterator[RefineRequest]:
    """The request without secrets and with a token for them, whose file lasts until the block is done."""
    chosen = Settings.model_validate(request.stated)
    # What a settings file states is read from it each night.
    found = hidden(request.settings if request.settings_file is None else chosen)
    stated = chosen.model_dump(mode="json", exclude_unset=True)
    if not found:
        yield request.model_copy(update={"stated": stated})
        return
    file = _file(f"{deployment_name(request.out)}-{uuid.uuid4().hex}")
    file.parent.mkdir(parents=True, exist_ok=True)
    handle = os.open(file, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
    with os.fdopen(handle, "w", encoding="utf-8") as stream:
        json.dump(found, stream)
    yield request.model_copy(update={"stated": stated, "secrets": file.stem})
    # After Ctrl-C the file stays: the night that was asked for may not have begun.
    with suppress(OSError):
        file.unlink()


def with_secrets(settings: Settings, token: str | None) -> Settings:
    """The settings with the secrets that a token names. Raises UsageError where they are gone."""
    if token is None:
        return settings
    try:
        found: dict[str, Any] = json.loads(_file(token).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise UsageError(
            f"the hook or the address that this night was given is not in {_file(token)} any more; start "
            "`asset2sim nightly` again"
        ) from error
    return Settings.model_validate(merged_mappings(settings.model_dump(exclude_unset=True), found))


def remove_old_secrets(out: Path | str) -> None:
    """Remove what nightlies of this OUT have left; for the one process that serves it."""
    for file in _file("any").parent.glob(f"{deployment_name(out)}-*.json"):
        with suppress(OSError):
            file.unlink()


def hidden(settings: Settings) -> dict[str, Any]:
    """The stated settings that JSON does not show as they are, nested."""
    whole = settings.model_dump(mode="json", exclude_unset=True, context={WHOLE: True})
    return _difference(whole, settings.model_dump(mode="json", exclude_unset=True))


def _difference(whole: dict[str, Any], shown: dict[str, Any]) -> dict[str, Any]:
    found = {}
    for name, value in whole.items():
        if isinstance(value, dict) and isinstance(shown[name], dict):
            if inner := _difference(value, shown[name]):
                found[name] = inner
        elif value != shown[name]:
            found[name] = value
    return found


def _file(token: str) -> Path:
    return prefect_home() / FOLDER / "secrets" / f"{Path(token).name}.json"
