"""Another sampling rate is one value, `acoustics.rate`, for world, clips and networks alike."""

from pathlib import Path

import pandas as pd
import pytest
import soundfile
import torch
from small import QUIET, SMALL, fitting


@pytest.mark.parametrize("rate", [8000, 48000])
def test_mini_is_trained_and_evaluated_at_it(command, outputs, rate):
    chosen = ("agent=greedy", f"acoustics.rate={rate}")
    settings = fitting(chosen, *SMALL, *QUIET)
    code, out, err = command("eval", *chosen, *settings, f"outputs={outputs}")
    assert code == 0, err
    heard = pd.read_csv(Path(out[-1]) / "source_estimates.csv")
    assert (heard["error_m"] < 10).all()
    assert len([path for path in outputs.glob("train/sound_cnn-*") if rate_of(path) == rate]) == 1


def rate_of(folder):
    return torch.load(folder / "best.ckpt", weights_only=True)["hyper_parameters"]["rate"]


@pytest.mark.parametrize("rate", [8000, 48000])
def test_clips_are_written_at_it(command, outputs, rate):
    options = ("export=wav", "clips=[[0,4]]", "apartments=room_1", f"acoustics.rate={rate}")
    code, _, err = command("generate", *fitting("generate", *SMALL), *options, f"outputs={outputs}")
    assert code == 0, err
    files = [soundfile.info(path) for path in outputs.glob("generate/room_1-*/wav/*.wav")]
    assert rate in {own.samplerate for own in files}
    assert all(own.frames == own.samplerate for own in files)


def test_a_network_of_another_rate_is_not_used(command, outputs):
    options = ("acoustics.rate=8000", "training.acoustics=resonance", "auto=false")
    code, _, err = command("eval", "agent=greedy", "split=mini", *options, f"outputs={outputs}")
    assert code == 2
    assert "acoustics.rate: 8000" in err[0]
    assert "trained at 16000 Hz" in err[0]


def test_rates_out_of_range_are_one_line(command, outputs):
    given = ("agent=greedy", "split=mini", f"outputs={outputs}")
    code, _, err = command("eval", *given, "acoustics.rate=96000")
    assert code == 2
    assert err == ["avn.eval: training.acoustics.rate: 96000 is out of range; use 8000 to 48000"]
    code, _, err = command("eval", *given, "acoustics.rate=44100")
    assert code == 2
    assert "spectrogram.frames is 64; give a divisor of 44100" in err[0]
