"""Records of runs that nobody walked, and their folders."""

from pathlib import Path

import numpy as np
import pandas as pd
import yaml

from avn.reporting.results import EPISODE_COLUMNS, summarise, write_csv


def records(
    agent="greedy",
    seed=0,
    *,
    scenes=5,
    sources=5,
    starts=4,
    sounds=("ring", "alarm"),
    rate=0.5,
    draw=0,
):
    """Records of an agent; those of all agents have the same episodes for a seed.

    `starts` is the number of starts of each source, or one for each apartment.
    """
    counts = [starts] * scenes if isinstance(starts, int) else starts
    rows = [
        (sound, f"room_{scene + 1}", source * count + start, start, source)
        for sound in sounds
        for scene, count in enumerate(counts)
        for source in range(sources)
        for start in range(count)
    ]
    frame = pd.DataFrame(rows, columns=["sound", "scene", "episode", "start_cell", "source"])
    frame = frame.assign(agent=agent, protocol="var", acoustics="resonance", look="once", seed=seed)
    frame = frame.assign(start_heading=frame["episode"] % 4, source_cell=100 + frame["source"])
    frame["geodesic"] = 1.0 + frame["start_cell"] + frame["source"]
    rng = np.random.default_rng([seed, draw, *agent.encode()])
    frame["success"] = (rng.random(len(frame)) < rate).astype(int)
    for column in ("spl", "softspl", "sna", "sna_goal"):
        frame[column] = frame["success"] * (0.5 + 0.5 * rng.random(len(frame)))
    frame["dtg"] = 5 * rng.random(len(frame))
    frame["outcome"] = np.where(frame["success"] == 1, "success", "out_of_moves")
    return frame.reindex(columns=list(EPISODE_COLUMNS), fill_value=0)


def write_run(outputs: Path, walked, train_seed=0, code="00000000", **changes):
    """Write the folder of a finished run, and return it; `changes` are of its config."""
    agent, seed = walked["agent"].iloc[0], int(walked["seed"].iloc[0])
    sounds = list(dict.fromkeys(walked["sound"]))
    folder = outputs / "eval" / agent / "-".join(sounds) / f"seed{seed}-{code}"
    write_csv(walked, folder / "episodes.csv")
    write_csv(summarise(walked, draws=0), folder / "results.csv")
    cfg = {group: {"name": name} for group, name in (("agent", agent), ("acoustics", "resonance"))}
    cfg |= {"protocol": {"name": "var", "max_moves_ratio": 2.0}, "split": {"name": "var"}}
    cfg |= {"sound": {name: name for name in sounds}, "seed": seed, "train_seed": train_seed}
    cfg |= {"subset": "test", "episodes": "frozen", "outputs": str(outputs)} | changes
    (folder / "config.yaml").write_text(yaml.safe_dump(cfg, sort_keys=False))
    hashes = pd.DataFrame({"sound": sounds, "path": sounds, "sha256": [8 * "0"] * len(sounds)})
    write_csv(hashes, folder / "recordings.csv")
    return folder
