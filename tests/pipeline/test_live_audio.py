"""Outputs computed when they are heard equal those of the table, on the real pipeline."""

import torch
from small import SMALL, composed, fitting

from avn.core.clip_id import ClipId
from avn.navigation.episodes import ONE_SOUND
from avn.pipeline.apartments import TRAINING, Apartments
from avn.pipeline.building import build
from avn.pipeline.observations import Observed
from avn.pipeline.run import Evaluation
from avn.pipeline.scenes import Geometry

ROW = "agent=greedy"


def observed(outputs, *options):
    cfg = composed(ROW, *fitting(ROW, *SMALL), f"outputs={outputs}", *options)
    found = Observed(Apartments(cfg, "test"), ("source_estimate",))
    geometry = Geometry(cfg, found.apartments)
    for stage in (geometry, *found.stages.values()):
        build(stage)
    return found.load(geometry.load())


def test_it_is_the_table_row_by_row(outputs):
    (table,), (live,) = observed(outputs), observed(outputs, f"episodes={ONE_SOUND}")
    assert not live.audio
    heard, known = live.rendered["source_estimate"], table.audio["source_estimate"]
    assert (heard.sounds, heard.realisations) == known.shape[2:4]
    random = torch.Generator().manual_seed(0)
    clip = ClipId(*(torch.randint(size, (150,), generator=random) for size in known.shape[:4]))
    torch.testing.assert_close(heard(clip), known[clip], atol=1e-4, rtol=1e-4)


def test_networks_of_the_training_world_keep_their_tables(outputs):
    cfg = composed(ROW, *SMALL, f"episodes={ONE_SOUND}", f"outputs={outputs}")
    names = ("source_estimate", "waveform")
    assert Observed(Apartments(cfg, "test"), names).is_live("source_estimate")
    assert not Observed(Apartments(cfg, "test"), names).is_live("waveform")
    assert not Observed(Apartments(cfg, "train", TRAINING), names).is_live("source_estimate")


def test_a_run_hears_one_sound_an_episode_and_is_the_same_twice(command, outputs):
    arguments = (ROW, *fitting(ROW, *SMALL), f"episodes={ONE_SOUND}", f"outputs={outputs}")
    runs = []
    for force in ("false", "true"):
        code, _, err = command("eval", *arguments, f"force={force}")
        assert code == 0, err
        cfg = composed(*arguments)
        runs.append((Evaluation(cfg).folder / "episodes.csv").read_bytes())
    assert runs[0] == runs[1]
    lines = runs[0].decode().splitlines()
    starts = cfg.protocol.num_starts * len(Apartments(cfg, "test").plans[0].sources)
    assert len(lines) == 1 + starts, "one episode a start, with two sounds"
    sounds = lines[0].split(",").index("sound")
    assert {line.split(",")[sounds] for line in lines[1:]} == {"alarm", "clock"}
