"""`avn COMMAND ...`, the same as `python -m avn.COMMAND ...`."""

from __future__ import annotations

import importlib
import sys

COMMANDS = {
    "demo": "a first try: one home, the networks of the package, a film of an episode",
    "generate": "build the apartments of a split, their sound and their views",
    "train": "train a network or an actor-critic agent",
    "eval": "evaluate an agent, and print its row of the table",
    "reproduce": "run all rows with all seeds, and print the whole table",
    "figures": "draw trajectories, estimates and maps of finished runs",
    "report": "write one HTML page of finished runs, with views and sound",
    "compare": "compare runs over the same episodes",
    "ls": "list finished runs with their world, success rate and SPL",
    "rm": "list products that no run needs, and delete them on request",
}


def main() -> int:
    """Run the command of the command line and return its exit code."""
    name, rest = (sys.argv[1] if len(sys.argv) > 1 else "--help"), sys.argv[2:]
    if name in ("-h", "--help"):
        print(_usage())
        return 0
    if name not in COMMANDS:
        print(f"avn: '{name}' is none of {', '.join(COMMANDS)}", file=sys.stderr)
        return 2
    sys.argv = [f"avn {name}", *rest]
    return int(importlib.import_module(f"avn.{name}").main())


def _usage() -> str:
    width = max(map(len, COMMANDS))
    lines = [f"  {name:{width}}  {text}" for name, text in COMMANDS.items()]
    return "\n".join(
        [
            "usage: avn COMMAND [key=value ...]",
            "",
            *lines,
            "",
            "avn COMMAND --help says more; python -m avn.COMMAND is the same.",
        ]
    )


if __name__ == "__main__":
    sys.exit(main())
