"""Print the ladders from the paper's agents to ours, one change a line, as Markdown.

    python scripts/ladder.py [KEY=VALUE ...]

The settings are those of `avn.eval` and hold for every line, for example `acoustics=diffraction
subset=validation`. `seeds=0,1,2` and `train_seeds=0,1,2` name the seeds of the episodes and of the
networks, of which success rate and SPL are means; both are 0 by default. Runs and networks that
exist are read.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence

import numpy as np

import avn

# Settings that runs with odometry do not read, and that end there.
OF_RETRIEVAL = "mapper.grows=true"
# Each line: its name, and the setting that it adds to those of the lines above.
LADDERS = {
    "ours_noexp": [
        ("the paper's agent", ""),
        ("our occupancy network", "occupancy_model=small"),
        ("squares lose their node below 0.001", "planner.obstacle_threshold=0.001"),
        ("a collision costs 2 moves", "planner.collision_cost=2"),
        ("our sound network: `plan_noexp`", "sound_model=cnn5"),
    ],
    "ours_exp": [
        ("the paper's agent", ""),
        ("memory and graph grow", OF_RETRIEVAL),
        ("unknown squares are nodes", "planner.obstacle_threshold=0.001"),
        ("odometry", "localisation=retrieval+odometry"),
        ("a collision costs 4 moves", "planner.collision_cost=4"),
        ("our sound network: `plan_exp`", "sound_model=cnn5"),
    ],
}


def rates(agent: str, settings: Sequence[str], seeds: str, train_seeds: str) -> np.ndarray:
    """Return success rate and SPL in % of each network, apartments with equal weight, (N, 2)."""
    found = []
    for train_seed in train_seeds.split(","):
        runs = []
        for seed in seeds.split(","):
            given = [*settings, f"seed={seed}", f"train_seed={train_seed}"]
            episodes = avn.evaluate(agent, given)
            runs.append(episodes.groupby("scene")[["success", "spl"]].mean().mean())
        found.append(np.mean(runs, axis=0))
    return 100 * np.array(found)


def main(arguments: Sequence[str]) -> None:
    """Walk every line and print the tables."""
    options = dict.fromkeys(("seeds", "train_seeds"), "0")
    common = []
    for argument in arguments:
        key, _, value = argument.partition("=")
        if key in options:
            options[key] = value
        else:
            common.append(argument)
    print(
        f"{' '.join(common) or 'defaults'}; seeds {options['seeds']}; "
        f"train_seed {options['train_seeds']}\n"
    )
    for agent, lines in LADDERS.items():
        print(f"| `{agent}` and | setting | success / SPL |\n| --- | --- | --- |")
        settings: list[str] = []
        for name, setting in lines:
            settings += [setting] if setting else []
            if setting.startswith("localisation=") and OF_RETRIEVAL in settings:
                settings.remove(OF_RETRIEVAL)
            each = rates(agent, [*common, *settings], **options)
            spread = ""
            if len(each) > 1:
                spread = " (networks " + ", ".join(f"{a:.1f} / {b:.1f}" for a, b in each) + ")"
            success, spl = each.mean(axis=0)
            text = f"`{setting}`" if setting else "-"
            print(f"| {name} | {text} | {success:.1f} / {spl:.1f}{spread} |", flush=True)
        print()


if __name__ == "__main__":
    main(sys.argv[1:])
