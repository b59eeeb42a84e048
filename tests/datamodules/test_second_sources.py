"""Second sources of training clips: how often, what is told, and the share of the first."""

import pytest
import torch
from synthetic_scene import synthetic_scene, synthetic_sounds

from avn.acoustics.microphone import Microphone
from avn.core.errors import UserError
from avn.datamodules.clip_set import ClipSet
from avn.datamodules.second_sources import SecondSources
from avn.modules.spectrogram import Spectrogram

CATEGORIES = ["bell", "dog"]
KNOWN = ["dog", "bell", "water"]
COUNT = 4_000


def second(share=0.4, known=KNOWN, categories=CATEGORIES, seed=1):
    return SecondSources(share, known, categories, "train", seed, Spectrogram())


def drawn(*given, sources=3):
    item = torch.arange(COUNT)
    return second(*given).draw(item, item % sources, item % 2, torch.full((COUNT,), sources))


def clip_set(own):
    # no noise, so that a clip is its sound alone
    scenes = [synthetic_scene("a"), synthetic_scene("b", 2.5)]
    quiet = Microphone(noise_rms=0.0)
    return ClipSet(scenes, synthetic_sounds(), quiet, "train", 1, second=own)


def test_mixtures_are_told_and_some_of_the_other_clips():
    told, source, sound = drawn()
    mixed = source >= 0
    assert abs(mixed.float().mean() - 0.4) < 0.03
    assert torch.equal(mixed, sound >= 0)
    named = torch.where(torch.arange(COUNT) % 2 == 0, 2, 1)  # bell, dog
    assert torch.equal(told[mixed], named[mixed])
    alone = told[~mixed]
    assert abs((alone > 0).float().mean() - 0.3) < 0.03
    assert torch.equal(alone[alone > 0], named[~mixed][alone > 0])


def test_what_cannot_be_told_or_has_no_other_place_is_heard_alone():
    told, source, _ = drawn(0.4, ["dog"])
    assert not (source[::2] >= 0).any()
    assert not told[::2].any()
    assert (source[1::2] >= 0).any()
    assert not (drawn(sources=1)[1] >= 0).any()


def test_sounds_of_one_category_are_refused():
    for known, categories in ((KNOWN, ["dog", "dog"]), (["water"], CATEGORIES)):
        with pytest.raises(UserError, match=r"sound_model\.mixtures: the sounds of the training"):
            second(0.4, known, categories)


@pytest.mark.filterwarnings("error")
def test_without_mixtures_one_category_is_enough():
    told, source, sound = drawn(0.0, KNOWN, ["dog", "dog"])
    assert (source == -1).all()
    assert (sound == -1).all()
    assert set(told.tolist()) == {0, 1}


def test_the_mask_is_the_share_of_the_power():
    random = torch.Generator().manual_seed(0)
    first, other = torch.randn(2, 3, 2, 16000, generator=random)
    first[2], other[1] = 0, 0
    mask = second().mask(first, other * 2)
    assert mask.shape == (3, 64, 8)
    # independent white noise: 1 of 1 + 4 on average
    assert mask[0].mean() == pytest.approx(0.2, abs=0.05)
    assert torch.equal(mask[1], torch.ones(64, 8))
    assert torch.equal(mask[2], torch.zeros(64, 8))


def test_a_mixture_is_the_sum_of_both_clips():
    alone, mixed = clip_set(None), clip_set(second(1.0))
    items = list(range(0, mixed.pairs * 2, 37))
    one, both = (clips.__getitems__(items) for clips in (alone, mixed))
    added = both["clips"] - one["clips"]
    assert (added.square().mean((1, 2)).sqrt() > 1e-4).all()
    number = torch.tensor(items)
    pair = number // 2
    apartment = mixed.apartment[pair]
    shape = [clips.in_sight.shape[0] for clips in mixed.scenes]
    sources = torch.tensor(shape)[apartment]
    _, source, sound = mixed.second.draw(number, mixed.source[pair], number % 2, sources)
    for row in range(len(items)):
        where = mixed.source == source[row]
        where &= mixed.state == mixed.state[pair[row]]
        (other,) = (where & (mixed.apartment == apartment[row])).nonzero()[:, 0]
        expected = alone[int(other) * 2 + int(sound[row])]["clips"][0]
        torch.testing.assert_close(added[row], expected, atol=1e-5, rtol=1e-4)
    for key in ("target", "in_sight", "sound"):
        assert torch.equal(one[key], both[key]), "those of the first source"
    assert set(both["told"].tolist()) <= {1, 2}
    assert one["told"].sum() == 0
