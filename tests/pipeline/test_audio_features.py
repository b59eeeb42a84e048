"""Audio embeddings on the real pipeline: they are of the very clips that estimates are of."""

import torch
from small import composed

from avn.pipeline.apartments import Apartments
from avn.pipeline.audio_features import AudioEmbeddings
from avn.pipeline.audio_inference import Clips
from avn.pipeline.building import build
from avn.pipeline.sound_network import SourceEstimates

SMALL = (
    "agent=greedy",
    "split=mini",
    "processes=1",
    "acoustics.rays=300",
    "acoustics.seconds=0.2",
    "sound_model.epochs=1",
    "sound_model.validation_clips=100",
    "logger=none",
    "realisations=1",
    "sound=alarm",
)


def test_the_last_two_numbers_are_what_the_network_says_and_are_kept(outputs):
    # a microphone of its own, so that nothing is there
    cfg = composed(*SMALL, "microphone.noise_rms=0.004", f"outputs={outputs}")
    apartments = Apartments(cfg, "test")
    embeddings, estimates = AudioEmbeddings(cfg, apartments), SourceEstimates(cfg, apartments)
    assert not estimates.done()
    build(embeddings)
    assert estimates.done()
    on_the_way = estimates.load()[0]
    assert torch.allclose(embeddings.load()[0][..., -2:].float(), on_the_way, atol=2e-2)
    estimates.paths[0].unlink()
    build(estimates)
    assert torch.equal(estimates.load()[0], on_the_way)


def test_training_and_evaluation_never_hear_the_same_take(outputs):
    cfg = composed(*SMALL, f"outputs={outputs}")
    one, other = (
        AudioEmbeddings(cfg, Apartments(cfg, "test"), Clips("realisations", purpose))
        for purpose in ("eval", "train")
    )
    for stage in (one, other):
        build(stage)
    heard, trained = one.load()[0], other.load()[0]
    assert heard.shape == trained.shape
    assert not (heard == trained).all(dim=-1).any()
