import numpy as np
import pytest
import torch
from small import option
from synthetic_scene import synthetic_scene, synthetic_sounds

from avn.acoustics.microphone import Microphone
from avn.core.classes import build_object
from avn.datamodules.clip_set import ClipSet
from avn.modules.sound_cnn import SoundCnn
from avn.pipeline.audio_inference import infer, source_estimate_errors


@pytest.fixture(scope="module")
def model() -> SoundCnn:
    config = option("sound_model", "cnn5")
    config.spectrogram.bands = config.spectrogram.frames = 32
    config.net.widths = [4, 4, 8, 8, 8]
    return build_object("sound_model", config).eval()


@pytest.fixture(scope="module")
def heard(model: SoundCnn) -> torch.Tensor:
    scene, sounds = synthetic_scene(), synthetic_sounds()
    return infer(scene, sounds, model, 2, Microphone(), seed=5, progress=False)


def test_every_clip_is_heard(model: SoundCnn, heard: torch.Tensor) -> None:
    scene, sounds = synthetic_scene(), synthetic_sounds()
    assert heard.shape == (2, 4 * scene.grid.cells, 2, 2, 2)
    assert heard.dtype == torch.float32
    # The clips are those that the data module renders for the same take.
    clips = ClipSet([scene], sounds, Microphone(), "eval", 5)
    pairs = torch.tensor([0, 7, clips.pairs - 1])
    for sound in range(2):
        for realisation in range(2):
            batch = clips.__getitems__(clips.item(pairs, torch.tensor(sound), realisation).tolist())
            with torch.inference_mode():
                expected = model(batch["clips"])
            found = heard.flatten(0, 1)[pairs, sound, realisation]
            torch.testing.assert_close(found, expected, atol=1e-4, rtol=1e-4)


def test_takes_and_seeds_differ_and_repeat(model: SoundCnn, heard: torch.Tensor) -> None:
    scene, sounds = synthetic_scene(), synthetic_sounds()

    def again(realisations: int, seed: int) -> torch.Tensor:
        given = (scene, sounds, model, realisations, Microphone(), seed, False)
        return infer(*given)

    assert torch.equal(again(2, 5), heard)
    torch.testing.assert_close(again(1, 5), heard[:, :, :, :1], atol=1e-4, rtol=1e-4)
    assert not torch.allclose(heard[..., 0, :], heard[..., 1, :], atol=1e-4)
    assert not torch.allclose(again(2, 6), heard, atol=1e-4)


def test_errors_are_medians_over_the_right_clips(heard: torch.Tensor) -> None:
    scene, sounds = synthetic_scene(), synthetic_sounds()
    table = source_estimate_errors(scene, heard, sounds.names).set_index(["sound", "sight"])
    truth = scene.brirs.locations.numpy()[:, :, None, None]
    error = np.linalg.norm(heard.numpy() - truth, axis=-1)
    seen = np.repeat(scene.in_sight, 4, axis=1)
    row = table.loc[("hum", "out_of_sight")]
    assert row["error_m"] == pytest.approx(np.median(error[:, :, 1][~seen]), rel=1e-5)
    assert row["clips"] == 2 * (~seen).sum()
    assert table.loc[("all", "all"), "clips"] == error.size


def test_front_back_confusions_are_counted() -> None:
    scene, sounds = synthetic_scene(), synthetic_sounds()
    truth = scene.brirs.locations[:, :, None, None].repeat(1, 1, 2, 1, 1)
    confused = truth.clone()
    confused[:, :, 1] *= -1.0
    table = source_estimate_errors(scene, confused, sounds.names).set_index(["sound", "sight"])
    assert table.loc[("hiss", "all"), "front_back"] == 0.0
    assert table.loc[("hiss", "all"), "error_m"] == 0.0
    # At the source itself there is no bearing.
    place = (truth[:, :, 0].norm(dim=-1) == 0).float().mean().item()
    assert table.loc[("hum", "all"), "front_back"] == pytest.approx(1.0 - place)
    assert table.loc[("hum", "all"), "bearing_deg"] == pytest.approx(180.0)
