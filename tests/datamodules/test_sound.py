import pytest
import torch
from small import option
from synthetic_scene import synthetic_scene, synthetic_sounds

from avn.acoustics.microphone import Microphone
from avn.core.errors import UserError
from avn.datamodules.clip_set import ClipSet
from avn.datamodules.sound import ClipSampler, SoundData
from avn.dataset.source_locations import relative_locations


@pytest.fixture(scope="module")
def clips() -> ClipSet:
    scenes = [synthetic_scene("a"), synthetic_scene("b", 2.5)]
    return ClipSet(scenes, synthetic_sounds(), Microphone(), "train", 1)


def data(**changes: int) -> SoundData:
    recipe = option("sound_model", "cnn5", batch=16, validation_clips=50, **changes)
    scenes = [synthetic_scene("a")], [synthetic_scene("b", 2.5)]
    return SoundData(*scenes, synthetic_sounds(), Microphone(), recipe)


def test_relative_location_of_the_documented_example() -> None:
    lattice = torch.tensor([[8, 16], [32, 36]])  # (4, 8) and (16, 18) metres
    locations = relative_locations(lattice, torch.tensor([1]))
    assert locations.shape == (1, 8, 2)
    expected = torch.tensor([[12.0, 10.0], [-10.0, 12.0], [-12.0, -10.0], [10.0, -12.0]])
    assert torch.equal(locations[0, :4], expected)
    assert torch.equal(locations[0, 4:], torch.zeros(4, 2))


def test_items_name_clips(clips: ClipSet) -> None:
    first = clips.scenes[0].in_sight.numel()
    pairs = torch.tensor([0, 5, first, first + 9, clips.pairs - 1])
    sounds = torch.tensor([1, 0, 1, 0, 1])
    batch = clips.__getitems__(clips.item(pairs, sounds, 3).tolist())
    assert batch["clips"].shape == (5, 2, 16000)
    assert batch["clips"].dtype == batch["target"].dtype == torch.float32
    assert torch.equal(batch["sound"], sounds)
    assert torch.equal(batch["target"][2], clips.scenes[1].locations[0, 0])
    assert torch.equal(batch["in_sight"], clips.in_sight[pairs])
    assert len(clips) == 2 * clips.pairs == 2 * sum(c.in_sight.numel() for c in clips.scenes)


def test_a_clip_does_not_depend_on_its_batch(clips: ClipSet) -> None:
    items = [3, 4, clips.pairs, 2 * clips.pairs - 1, 5 * len(clips) + 3, 3]
    batch = clips.__getitems__(items)
    for row, item in enumerate(items):
        alone = clips[item]
        torch.testing.assert_close(alone["clips"][0], batch["clips"][row], atol=1e-5, rtol=0)
        assert torch.equal(alone["target"][0], batch["target"][row])
    assert torch.equal(batch["clips"], clips.__getitems__(items)["clips"])


def test_a_clip_is_its_response_heard() -> None:
    scene, sounds = synthetic_scene(), synthetic_sounds()
    quiet = Microphone(noise_rms=0.0)
    clips = ClipSet([scene], sounds, quiet, "train", 1)
    # Facing the source from far and from near: level falls as the formula says.
    batch = clips.__getitems__(clips.item(torch.arange(clips.pairs), torch.tensor(0), 0).tolist())
    level = batch["clips"].square().mean(-1).sqrt()
    target = clips.target
    left, right = level.unbind(1)
    aside = target[:, 0].abs() > 1.4
    louder = torch.where(target[:, 0] > 0, right > left, left > right)
    assert louder[aside].all()
    gain = level.square().sum(1).sqrt() * target.norm(dim=1).clamp_min(0.5)
    ahead = (target[:, 0] == 0) & (target[:, 1] > 0)
    assert gain[ahead].std() / gain[ahead].mean() < 0.1


def test_training_takes_are_fresh_and_apart_from_evaluation(clips: ClipSet) -> None:
    pair, sound = torch.tensor([4]), torch.tensor([0])
    realisations = [
        clips.__getitems__(clips.item(pair, sound, t).tolist())["clips"] for t in (0, 1)
    ]
    assert not torch.allclose(*realisations, atol=1e-3)
    scenes = [synthetic_scene("a"), synthetic_scene("b", 2.5)]
    others = ClipSet(scenes, clips.sounds, Microphone(), "eval", 1)
    other = others.__getitems__(others.item(pair, sound, 0).tolist())["clips"]
    assert not torch.allclose(realisations[0], other, atol=1e-3)


@pytest.mark.parametrize("sounds_per_pair", [1, 2])
def test_an_epoch_hears_every_pair_in_its_own_take(clips: ClipSet, sounds_per_pair: int) -> None:
    sampler = ClipSampler(clips, 7, sounds_per_pair)
    orders = []
    for epoch in (0, 1, 1):
        sampler.set_epoch(epoch)
        items = torch.tensor(list(sampler))
        assert len(items) == len(sampler) == sounds_per_pair * clips.pairs
        assert (items // len(clips) == epoch).all()
        counts = torch.bincount(items % len(clips) // 2, minlength=clips.pairs)
        assert (counts == sounds_per_pair).all()
        assert len(items.unique()) == len(items)
        orders.append(items)
    assert torch.equal(orders[1], orders[2])
    assert not torch.equal(orders[0] % len(clips), orders[1] % len(clips))
    assert 0 < (orders[0] % 2).float().mean() < 1


def test_loaders_give_whole_batches() -> None:
    module = data()
    batch = next(iter(module.train_dataloader()))
    assert batch["pictures"].shape == (16, 4, 64, 64)
    validation, training = module.val_dataloader()
    for loader in (validation, training):
        assert sum(len(batch["target"]) for batch in loader) == 50
    again = next(iter(module.val_dataloader()[0]))["pictures"]
    assert torch.equal(next(iter(validation))["pictures"], again)


def test_validation_clips_are_the_same_for_every_train_seed() -> None:
    first, second = data(train_seed=0), data(train_seed=1)
    batches = [next(iter(module.val_dataloader()[0]))["pictures"] for module in (first, second)]
    assert torch.equal(*batches)
    batches = [next(iter(module.train_dataloader()))["pictures"] for module in (first, second)]
    assert not torch.equal(*batches)


def test_empty_split_is_named() -> None:
    for split, scenes in (("train", ([], [1])), ("validation", ([1], []))):
        with pytest.raises(UserError, match=f"split.{split} has no apartment"):
            SoundData(*scenes, synthetic_sounds(), Microphone(), None)


@pytest.mark.parametrize("key", ["sounds_per_pair", "validation_clips"])
def test_number_that_cannot_work_is_named(key: str) -> None:
    with pytest.raises(UserError, match=f"sound_model.{key}"):
        SoundData(
            [synthetic_scene()],
            [synthetic_scene()],
            synthetic_sounds(),
            Microphone(),
            option("sound_model", "cnn5", **{key: 0}),
        )
