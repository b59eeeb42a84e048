import io
import wave

import numpy as np
import torch
from synthetic_scene import synthetic_scene

from avn.dataset.source_locations import relative_locations
from avn.reporting.sound_figures import location_figure, spectrogram_figure, stereo, to_world


def test_to_world_undoes_relative_locations() -> None:
    lattice = torch.tensor([[8, 16], [32, 36], [3, 40]])
    source = torch.tensor([1])
    relative = relative_locations(lattice, source)[0].numpy()
    states = np.arange(12)
    places = lattice.numpy()[states // 4] * 0.5
    np.testing.assert_allclose(to_world(relative, places, states % 4), [[16.0, 18.0]] * 12)


def test_locations_are_drawn_where_they_are_heard() -> None:
    scene = synthetic_scene()
    target = scene.brirs.locations[0].numpy()
    seen = np.repeat(scene.in_sight[0], 4)
    figure = location_figure(scene.plan, scene.grid.lattice, target, target, seen, "title")
    axes = figure.axes[0]
    true = axes.lines[-1]
    np.testing.assert_allclose(true.get_xydata(), [[0.5, 0.5]])
    for dots, count in zip(axes.collections, (seen.sum(), (~seen).sum()), strict=True):
        assert len(dots.get_offsets()) == count
        np.testing.assert_allclose(dots.get_offsets(), [[0.5, 0.5]] * count, atol=1e-6)
    assert axes.get_legend_handles_labels()[1][0] == "estimates in sight: median error 0.0 m"


def test_spectrogram_shows_each_picture_on_the_scale_of_both_ears() -> None:
    pictures = torch.randn(4, 16, 20, generator=torch.Generator().manual_seed(0))
    figure = spectrogram_figure(pictures, "clip")
    images = [axes.images[0] for axes in figure.axes if axes.images]
    assert [image.get_array().shape for image in images] == [(16, 20)] * 4
    assert images[0].get_clim() == images[1].get_clim()
    assert images[3].get_clim() == (-1.0, 1.0)


def test_audio_keeps_both_ears() -> None:
    clip = torch.stack((torch.linspace(-2, 2, 500), torch.zeros(500)))
    audio = stereo(clip, 16000)
    assert (audio.num_channels, audio.length_frames, audio.sample_rate) == (2, 500, 16000)
    with wave.open(io.BytesIO(audio.encoded_audio_string)) as file:
        samples = np.frombuffer(file.readframes(500), "<i2").reshape(500, 2)
    assert samples[0, 0] == -round(0.9 * 32767)
    assert (samples[:, 1] == 0).all()
