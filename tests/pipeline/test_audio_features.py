"""Sound features on the real pipeline: they are of the very clips that `hearing` is of."""

import torch
from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra

from avn.config import schema
from avn.config.folder import conf_folder
from avn.pipeline import audio_features, audio_inference, scenes, sound_network

SMALL = (
    "split=mini",
    "processes=1",
    "acoustics.rays=300",
    "acoustics.seconds=0.2",
    "sound_model.epochs=1",
    "takes=1",
    "sound=alarm",
)


def composed(outputs, *more):
    GlobalHydra.instance().clear()
    schema.register()
    with initialize_config_dir(str(conf_folder().resolve()), version_base="1.3"):
        return compose("eval", overrides=["agent=greedy", *SMALL, f"outputs={outputs}", *more])


def test_the_last_two_numbers_are_what_the_network_says_and_are_kept(outputs):
    cfg = composed(outputs, "microphone.noise_rms=0.004")  # of its own, so that nothing is there
    rooms = scenes.scenes(cfg, ("test",), audible=True)["test"]
    clips = audio_features.evaluated_clips(cfg)
    found = audio_features.sound_features(cfg, rooms, clips)[0]
    kept = list((outputs / "hear").glob(f"alarm-{sound_network.hear_hash(cfg)[:8]}/*.h5"))
    assert len(kept) == 1
    on_the_way = sound_network.hearing(cfg, rooms)[0]
    assert torch.allclose(found[..., -2:].float(), on_the_way, atol=2e-2)
    kept[0].unlink()
    alone = sound_network.hearing(cfg, rooms)[0]
    assert torch.equal(alone, on_the_way)


def test_training_and_evaluation_never_hear_the_same_take(outputs):
    cfg = composed(outputs)
    rooms = scenes.scenes(cfg, ("test",), audible=True)["test"]
    sounds = audio_inference.sound_files(cfg)
    one, other = (
        audio_features.sound_features(cfg, rooms, audio_features.Clips(sounds, 1, purpose))[0]
        for purpose in ("eval", "train")
    )
    assert one.shape == other.shape
    assert not (one == other).all(dim=-1).any()
