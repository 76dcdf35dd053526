"""A model server on this machine that answers like a competent model: OpenAI's chat protocol, the prior's tables.

``python -m tests.scripted_server --port 8123 --log requests.jsonl`` serves until it is interrupted; then
``asset2sim refine DATA --out OUT --model openai/scripted --api-base http://127.0.0.1:8123/v1`` asks it, with images,
over real HTTP. The log has a line of JSON per request: model, purpose, asset, image labels and sizes, status.
"""

import argparse
import base64
import io
import json
import re
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from PIL import Image

from asset2sim.models.prior.answer import answer
from asset2sim.validation.second_look import ENDS
from tests.model_server import Reply, serve

CHARACTERS_PER_TOKEN = 4
LABEL = "Image: "
"""What the text part before each image begins with."""

_INFORMATION = re.compile(r"<structured_information>\s*(.*?)\s*</structured_information>", re.DOTALL)


@dataclass(frozen=True)
class Asked:
    """One request; ``images`` holds (label, width, height, bytes) of each."""

    model: str
    purpose: str
    asset_id: str
    images: tuple[tuple[str, int, int, int], ...]
    characters: int
    text: str
    system: str
    body: Mapping[str, Any]

    def row(self, status: int) -> dict[str, object]:
        """The request's row in the log, without its text."""
        images = [dict(zip(("label", "width", "height", "bytes"), image, strict=True)) for image in self.images]
        return {
            "model": self.model, "purpose": self.purpose, "asset_id": self.asset_id, "images": images,
            "characters": self.characters, "status": status,
        }  # fmt: skip


Script = Callable[[Asked], Reply]
"""Answers a request; called by one thread at a time."""


@dataclass
class ScriptedServer:
    """Where the server listens, and what it was asked so far."""

    api_base: str
    asked: list[Asked]

    def of(self, asset_id: str, purpose: str | None = None) -> list[Asked]:
        """The requests about one asset."""
        return [item for item in self.asked if item.asset_id == asset_id and purpose in (None, item.purpose)]


def competent(asked: Asked) -> Reply:
    """The prior's answer, in place of a competent model's; of guessed ends the one that means less that is odd."""
    if asked.purpose != ENDS:
        return Reply(answer(asked.text))
    joints = information(asked.text)["joints"]
    ends = {item["name"]: min("ab", key=lambda end: len(item[end]["would"])) for item in joints}
    return Reply(json.dumps({"joints": {name: {"closed": end, "sure": 0.6} for name, end in ends.items()}}))


@contextmanager
def scripted(script: Script = competent, port: int = 0, log: Path | None = None) -> Iterator[ScriptedServer]:
    """Serve a script on this machine, on a free port if ``port`` is 0."""
    asked: list[Asked] = []

    def reply_to(body: dict[str, Any]) -> Reply:
        request = read_request(body)
        reply = counted(script(request), request)
        asked.append(request)
        if log is not None:
            with log.open("a", encoding="utf-8") as file:
                file.write(json.dumps(request.row(reply.status)) + "\n")
        return reply

    with serve(reply_to, port) as server:
        yield ScriptedServer(server.api_base, asked)


def counted(reply: Reply, asked: Asked) -> Reply:
    """The reply with tokens that go with the lengths of question and answer."""
    characters = asked.characters + len(asked.system), len(reply.content or "")
    sent, said = (-(-count // CHARACTERS_PER_TOKEN) for count in characters)
    return replace(reply, prompt_tokens=sent, completion_tokens=said)


def read_request(body: Mapping[str, Any]) -> Asked:
    """The user's part of a chat request: text, labelled images, purpose and asset id."""
    parts: list[dict[str, Any]] = []
    for message in body["messages"]:
        if message["role"] == "user":
            content = message["content"]
            parts += [{"type": "text", "text": content}] if isinstance(content, str) else content
    texts = [part["text"] for part in parts if part["type"] == "text"]
    images, label = [], ""
    for part in parts:
        if part["type"] == "text":
            label = part["text"].removeprefix(LABEL)
        else:
            data = base64.b64decode(part["image_url"]["url"].split(",", 1)[1])
            images.append((label, *Image.open(io.BytesIO(data)).size, len(data)))
    text = "\n".join(texts)
    about = information(text)
    return Asked(
        model=str(body.get("model")),
        purpose=str(about.get("purpose", "")),
        asset_id=str(about.get("asset_id", "")),
        images=tuple(images),
        characters=len(text),
        text=text,
        system="\n".join(str(m["content"]) for m in body["messages"] if m["role"] == "system"),
        body=body,
    )


def information(text: str) -> dict[str, Any]:
    """The structured information in a prompt; empty if there is none."""
    found = _INFORMATION.search(text)
    value = json.loads(found.group(1)) if found else {}
    return value if isinstance(value, dict) else {}


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.scripted_server", description=__doc__)
    parser.add_argument("--port", type=int, default=8123)
    parser.add_argument("--log", type=Path, help="a file that gets a line of JSON per request")
    options = parser.parse_args()
    with scripted(port=options.port, log=options.log) as server:
        print(f"--model openai/scripted --api-base {server.api_base}", flush=True)
        try:
            threading.Event().wait()
        except KeyboardInterrupt:
            print(f"{len(server.asked)} requests answered")


if __name__ == "__main__":
    main()
