"""Networks as stages: what is there is reused, and what is damaged is named."""

import pytest
import torch
from small import composed

from avn.core.errors import UserError
from avn.pipeline.apartments import Apartments
from avn.pipeline.building import build, missing
from avn.pipeline.per_scene import ApartmentTensors
from avn.pipeline.sound_network import SoundNetwork
from avn.pipeline.trained import METRICS


class Counts(ApartmentTensors):
    """A tensor with the number of the apartment."""

    kind = "see/counts"
    made: list[int] = []  # noqa: RUF012

    @property
    def title(self):
        return "counts"

    def settings(self):
        return ("realisations",)

    def content_of(self, plan):
        return plan.to_dict()

    def opened(self):
        def count(index):
            self.made.append(index)
            return torch.full((3, 2), float(index))

        return count


@pytest.fixture
def counts(tmp_path):
    Counts.made.clear()

    def stage(*overrides):
        cfg = composed(f"outputs={tmp_path}", *overrides)
        return Counts(cfg, Apartments(cfg, "test"))

    return stage


def test_each_apartment_is_made_once(counts):
    build(counts())
    assert counts().made == [0, 1, 2, 3, 4]
    assert [float(own[0, 0]) for own in counts().load()] == [0.0, 1.0, 2.0, 3.0, 4.0]
    counts().paths[2].unlink()
    assert missing([counts()]) != []
    build(counts())
    assert Counts.made[5:] == [2]
    build(counts("realisations=2"))
    assert Counts.made[6:] == [0, 1, 2, 3, 4]


def test_what_is_kept_along_the_way_is_not_made_again(counts):
    counts().keep(1, torch.ones(3, 2))
    build(counts())
    assert Counts.made == [0, 2, 3, 4]
    assert torch.equal(counts().load()[1], torch.ones(3, 2))


def test_what_is_missing_is_refused_with_auto_false(counts):
    with pytest.raises(UserError, match=r"counts is missing and auto=false"):
        build(counts("auto=false"))


def test_a_damaged_file_is_one_line(counts):
    build(counts())
    path = counts().paths[0]
    path.write_bytes(path.read_bytes()[:-8])
    with pytest.raises(UserError, match="cut short") as caught:
        counts().load()
    assert str(path) in str(caught.value)


def test_damaged_metrics_are_one_line(tmp_path):
    network = SoundNetwork(composed("agent=greedy", "split=mini", f"outputs={tmp_path}"))
    network.folder.mkdir(parents=True)
    (network.folder / METRICS).write_text("{")
    with pytest.raises(UserError, match=r"metrics\.json: damaged; delete"):
        network.metrics()
