"""A network that is told a category: what it is told matters, and nothing told masks nothing."""

import math

import pytest
import torch
from small import option

from avn.core.classes import build_object
from avn.core.errors import UserError
from avn.modules.audio_network import PictureBatch

RATE = 16000


def network(**settings):
    net = {"_target_": "avn.modules.five_layer_cnn.FiveLayerCnn", "output_scale": 1.0}
    net |= {"widths": [4, 4, 4, 4, 4], "hidden": [16], "dropout": 0.0}
    given = {"net": net, "categories": ["low", "high"], **settings}
    return build_object("sound_model", option("sound_model", "arrival_told", **given), rate=RATE)


def tones(count=64):
    """Return the power of clips with a low and a high tone, and the mask of the low one."""
    random = torch.Generator().manual_seed(0)
    power = -3 + 0.1 * torch.randn(count, 2, 64, 64, generator=random)
    low, high = (torch.randint(a, b, (count,), generator=random) for a, b in ((2, 30), (34, 62)))
    rows, mask = torch.arange(count), torch.zeros(count, 64, 8)
    power[rows, :, low], power[rows, :, high], mask[rows, low] = 0.0, 0.0, 1.0
    return power, mask


def test_nothing_told_masks_nothing_and_a_category_does():
    model, clips = network().eval(), torch.randn(3, 2, RATE)
    untold = model.pictures(clips)
    assert torch.equal(untold[:, :4], model.spectrogram(clips))
    assert torch.equal(untold[:, 4], torch.ones(3, 64, 64))
    assert torch.equal(model.arrival(clips), model.arrival(clips, torch.zeros(3).long()))
    one, two = (model.arrival(clips, torch.full((3,), told)) for told in (1, 2))
    assert not torch.allclose(one, two, atol=1e-5)
    masked = model.pictures(clips, torch.tensor([1, 0, 2]))
    assert (masked[[0, 2], :2] < untold[[0, 2], :2]).all()
    assert torch.equal(masked[1], untold[1])


def test_a_mirrored_clip_is_heard_from_the_other_side_whatever_is_told():
    model, clips = network().eval(), torch.randn(2, 2, RATE)
    told = torch.tensor([1, 2])
    straight = model.estimate(model.pictures(clips, told))
    mirrored = model.estimate(model.pictures(clips.flip(1), told))
    torch.testing.assert_close(mirrored, model.mirror_outputs(straight), atol=1e-4, rtol=1e-4)


def test_the_mask_learns_which_of_two_tones_belongs_to_a_category():
    model = network(epochs=1)
    power, low = tones()
    optimizer = torch.optim.Adam(model.mask.parameters(), 1e-2)
    told = torch.arange(len(power)) % 2 + 1
    heard = power[:, 0, :, ::8] > -1
    mask = torch.where((told == 1)[:, None, None], low, heard.float() - low)
    weight = 1 + 30 * heard
    for _ in range(60):
        loss = torch.nn.functional.binary_cross_entropy_with_logits(
            model.mask(power, told), mask, weight=weight
        )
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    odds = model.mask.eval()(power, 3 - told)  # told the other one
    right = (odds > 0) == (mask == 0)
    assert right[heard].float().mean() > 0.9


def test_the_loss_of_the_mask_counts_where_a_category_is_told():
    torch.manual_seed(0)
    model = network().eval()
    model.name_sounds(["a"])
    pictures, target = torch.randn(4, 4, 64, 64), torch.randn(4, 5)
    nothing, told = torch.zeros(4).long(), torch.tensor([0, 0, 1, 2])
    losses = []
    for share, named in ((0.0, told), (1.0, told), (0.0, nothing)):
        mask = torch.full((4, 64, 8), share)
        batch = PictureBatch(
            pictures=pictures,
            target=target,
            in_sight=nothing.bool(),
            sound=nothing,
            told=named,
            mask=mask,
        )
        torch.manual_seed(1)
        losses.append(float(model.training_step(batch, 0).detach()))
    odds = model.mask(pictures[2:, :2], told[2:])
    # the cross-entropies of 0 and of 1 differ by the log-odds
    expected = model.mask_weight * float(odds.detach().mean())
    assert losses[0] - losses[1] == pytest.approx(expected, rel=1e-3)
    assert math.isfinite(losses[2]), "a batch in which nothing is told"


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"categories": []}, r"sound_model\.categories: empty"),
        ({"mixtures": 1.5}, r"sound_model\.mixtures: 1\.5; give a share"),
        ({"mask_weight": -1.0}, r"sound_model\.mask_weight: -1\.0; give 0 or more"),
        ({"spectrogram": {"frames": 50}}, r"sound_model\.spectrogram\.frames: 50; give a multiple"),
    ],
)
def test_what_cannot_work_is_refused(settings, message):
    with pytest.raises(UserError, match=message):
        network(**settings)
