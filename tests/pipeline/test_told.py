"""The category of the goal's sound reaches the network that can be told it, and no other."""

from types import SimpleNamespace

import pytest
import torch
from small import composed

from avn.core.errors import UserError
from avn.pipeline.apartments import Apartments
from avn.pipeline.live_audio import LiveInference
from avn.pipeline.observations import Observed
from avn.pipeline.sounds import sound_categories
from avn.pipeline.told import can_be_told, check_told, told_categories

TOLD = ("agent=belief_told", "condition=distractor_told")


class Heads:
    """Network that answers with what it is told."""

    device = torch.device("cpu")

    def eval(self):
        return self

    def arrival(self, clips, told=None):
        return torch.full((len(clips), 1), -1.0) if told is None else told[:, None].float()


def heard(*options):
    cfg = composed(*options)
    stage = Observed(Apartments(cfg, "test"), ["arrival"]).stages["arrival"]
    assert isinstance(stage, LiveInference)
    network = SimpleNamespace(load=Heads)
    forward = type(stage._table).output_of
    stage._table = SimpleNamespace(network=network, output_of=lambda m: forward(stage._table, m))
    output, shape = stage.output()
    assert shape == (1,)
    sounds = torch.arange(len(cfg.sound))
    return cfg, output(torch.zeros(len(sounds), 2, 16000), sounds)[:, 0]


def test_the_network_is_told_the_category_of_each_sound():
    cfg, told = heard(*TOLD)
    names = list(cfg.sound_model.categories)
    assert [names[int(number) - 1] for number in told] == [*sound_categories(cfg).values()]
    assert torch.equal(told.long(), told_categories(cfg))


@pytest.mark.parametrize("condition", ["distractor", "unheard"])
def test_without_a_told_distractor_it_is_told_nothing(condition):
    _, told = heard("agent=belief_told", f"condition={condition}")
    assert (told == -1).all()


def test_who_cannot_be_told_is_refused():
    check_told(composed(*TOLD), "belief_told", ["arrival"])
    for row, wanted in (("belief", "arrival"), ("plan_noexp", "source_estimate")):
        cfg = composed(f"agent={row}", "condition=distractor_told")
        assert not can_be_told(cfg)
        with pytest.raises(UserError, match=f"told: agent {row} cannot be told a category"):
            check_told(cfg, row, [wanted])
        untold = composed(f"agent={row}", "condition=distractor")
        assert can_be_told(untold)
        check_told(untold, row, [wanted])
    with pytest.raises(UserError, match="cannot be told"):  # exact arrivals hear no clip
        check_told(composed(*TOLD), "belief_told", [])


def test_a_category_that_the_network_does_not_know_is_refused():
    cfg = composed(*TOLD, "sound=[dog,telephone]")
    with pytest.raises(UserError, match="knows no category 'dog'"):
        check_told(cfg, "belief_told", ["arrival"])
