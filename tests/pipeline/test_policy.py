"""The actor-critic rows on the real pipeline, with the mini split, small pictures and few steps."""

import json
from pathlib import Path

import pandas as pd
import pytest
from small import EYES, SMALL, fitting
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from avn.pipeline.trained import METRICS
from avn.reporting.model_card import CARD
from avn.rl.checkpoints import BEST, CURVE, LAST

ROWS = ("a3c_v", "a3c_va", "a3c_va_mapper", "a3c_va_m", "a3c_va_m_mapper")
# One take of each clip, and sounds that the tests name.
WORLD = (
    *(own for own in SMALL if not own.startswith(("sound=", "realisations="))),
    "realisations=1",
)
RECIPE = (
    "protocol.exploration_steps=30",
    "algorithm.workers=1",
    "algorithm.num_envs=8",
    "algorithm.rollout_length=5",
    "algorithm.total_steps=800",
    "algorithm.validate_every=400",
    "algorithm.validation_starts=1",
    "algorithm.realisations=1",
    "algorithm.exploration_walks=2",
    "algorithm.memory_refresh_interval=5",
)


def walking(row, outputs, *more):
    return ("eval", f"agent={row}", *arguments(row, outputs, *more, kind="agent"))


def arguments(row, outputs, *more, kind="model"):
    eyes = EYES if "mapper" in row else ()
    settings = fitting(f"{kind}={row}", *WORLD, *eyes, *RECIPE)
    return (*settings, f"outputs={outputs}", *more)


@pytest.mark.parametrize("row", ROWS)
def test_a_row_is_trained_measured_and_walks(command, outputs, row):
    code, out, err = command("train", f"model={row}", *arguments(row, outputs))
    assert code == 0, err
    folder = Path(out[-1])
    assert folder.name.startswith(f"{row}-")
    assert {BEST, LAST, CURVE, METRICS, CARD} <= {path.name for path in folder.iterdir()}
    curve = json.loads((folder / CURVE).read_text())
    assert [own["steps"] for own in curve] == [0, 400, 800]
    (named,) = (path for path in folder.iterdir() if path.is_dir())
    assert named.name.startswith(f"{row}-")
    assert named.name.endswith("-seed0")
    events = EventAccumulator(str(named)).Reload().Tags()["scalars"]
    wanted = {"return", "success", "spl"}
    wanted = {f"{part}/{name}" for part in ("train", "validation") for name in wanted}
    rates = {"steps/return", "steps/entropy", "loss/value", "steps/gradient_norm"}
    assert wanted | rates | {"steps/steps_per_second"} <= set(events)
    code, out, err = command(
        "eval", f"agent={row}", *arguments(row, outputs, "sound=alarm", kind="agent")
    )
    assert code == 0, err
    episodes = pd.read_csv(Path(out[-1]) / "episodes.csv")
    assert set(episodes["agent"]) == {row}
    first = (Path(out[-1]) / "episodes.csv").read_bytes()
    for name in ("episodes.csv", "results.csv"):
        (Path(out[-1]) / name).unlink()
    _, out, _ = command(
        "eval", f"agent={row}", *arguments(row, outputs, "sound=alarm", kind="agent")
    )
    assert (Path(out[-1]) / "episodes.csv").read_bytes() == first


def test_the_likeliest_actions_are_another_run_of_the_same_network(command, outputs):
    folders = []
    for samples in ("true", "false"):
        more = (f"baseline.samples={samples}", "sound=alarm")
        code, out, err = command(
            "eval", "agent=a3c_v", *arguments("a3c_v", outputs, *more, kind="agent")
        )
        assert code == 0, err
        folders.append(out[-1])
    assert len(set(folders)) == 2
    assert len(list((Path(outputs) / "train").glob("a3c_v-*"))) == 1


def test_a_training_that_ended_is_reused_and_one_that_is_missing_is_refused(command, outputs):
    code, out, _ = command("train", "model=a3c_v", *arguments("a3c_v", outputs, "auto=false"))
    assert code == 0
    before = (Path(out[-1]) / BEST).read_bytes()
    _, out, _ = command("train", "model=a3c_v", *arguments("a3c_v", outputs))
    assert (Path(out[-1]) / BEST).read_bytes() == before
    more = ("auto=false", "algorithm.gamma=0.9", "sound=alarm")
    code, _, err = command(*walking("a3c_v", outputs, *more))
    assert code == 2
    assert len(err) == 1
    assert "missing and auto=false" in err[0]


@pytest.mark.parametrize(
    ("option", "line"),
    [
        (
            "algorithm.update_order=sideways",
            "algorithm.update_order: 'sideways' is none of free, round_robin",
        ),
        ("algorithm.workers=0", "algorithm.workers: 0; give 1 or more"),
        ("algorithm.gamma=1.5", "algorithm.gamma: 1.5; give 0 to 1"),
        ("baseline.map_width=4", "baseline.map_width: 4; give an odd number"),
        ("agent.oracle_inputs=[source_estimate]", "agent.oracle_inputs: only agents that plan"),
    ],
)
def test_what_cannot_work_is_one_line(command, outputs, option, line):
    row = "a3c_va_mapper" if "map_width" in option else "a3c_v"
    name, kind = ("eval", "agent") if "oracle" in option else ("train", "model")
    code, _, err = command(name, f"{kind}={row}", *arguments(row, outputs, option, kind=kind))
    assert code == 2
    assert len(err) == 1, err
    assert line in err[0]


def test_memory_needs_a_walk(command, outputs):
    more = arguments("a3c_va_m", outputs, "protocol.exploration_steps=0")
    code, _, err = command("train", "model=a3c_va_m", *more)
    assert code == 2
    assert "protocol.exploration_steps: 0, and an agent with memory explores" in err[-1]


def test_a_damaged_checkpoint_is_refused(command, outputs):
    _, out, _ = command("train", "model=a3c_v", *arguments("a3c_v", outputs))
    best = Path(out[-1]) / BEST
    whole = best.read_bytes()
    best.write_bytes(whole[: len(whole) // 2])
    code, _, err = command(
        "eval", "agent=a3c_v", *arguments("a3c_v", outputs, "sound=ring", kind="agent")
    )
    best.write_bytes(whole)
    assert code == 2
    assert "best.ckpt: damaged" in err[-1]
