"""``make clone``: a network learns from the scripted expert what to do with an output's objects: OUT TO. Recordings and
the network are written into the folder TO; recordings that are there are kept."""

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TextIO

from pydantic import Field
from pydantic_settings import CliPositionalArg

from asset2sim.runs.command_line import Options, parse
from asset2sim.runs.option_types import N
from lab.probes.cloning import clone
from schemas.errors import DONE, UsageError, exit_code_of

PROGRAM = "python -m lab.flows.clone_expert"
COUNT = 10
"""Demonstrations of each task where no number is asked for."""


class CloneOptions(Options):
    """Let a network learn from the scripted expert what to do with refined objects."""

    out: CliPositionalArg[Path] = Field(description="an output folder of a run: the objects to learn with")
    to: CliPositionalArg[Path] = Field(description="the folder that gets recordings and network")
    count: N = Field(COUNT, description="demonstrations of each task")


def clone_expert(options: CloneOptions) -> int:
    """Demonstrate, train and say where the network is. Returns the exit code."""
    folders = {path.parent.name: path.parent for path in sorted(options.out.glob("assets/*/overlay.json"))}
    if not folders:
        raise UsageError(f"{options.out} holds no refined object to learn with")
    found = clone(folders, options.to, options.count, lambda line: print_line(sys.stderr, line))
    print_line(sys.stdout, f"asset2sim probe OUT --policy cloned --network {found}")
    return DONE


def print_line(stream: TextIO, line: str) -> None:
    """A line, at once."""
    stream.write(f"{line}\n")
    stream.flush()


def main(words: Sequence[str]) -> int:
    """Run one command line and return its exit code."""
    return exit_code_of("clone_expert", lambda: clone_expert(parse(CloneOptions, words, PROGRAM)))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
