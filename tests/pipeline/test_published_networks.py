"""Networks of the package: the recipe finds its network, and no other takes its place."""

import json

import publish_networks
import pytest
import torch
from small import SMALL, composed

from avn.config.unread import refuse_unread
from avn.core.errors import UserError
from avn.modules.settings import BEST
from avn.pipeline import published_networks
from avn.pipeline.benchmark import describe_world, paper_sounds
from avn.pipeline.building import missing
from avn.pipeline.run import Evaluation
from avn.pipeline.scenes import DirectSound
from avn.pipeline.sound_network import SoundNetwork
from avn.pipeline.stage import with_needs
from avn.pipeline.trained import Trained

ROW = (
    "agent=plan_noexp",
    "occupancy_model=none",
    "agent.oracle_inputs=[local_patch]",
    "agent.privileged=true",
    *SMALL,
)


def network(*overrides):
    return SoundNetwork(composed(*ROW, "logger=none", *overrides))


@pytest.fixture
def shipped(tmp_path, monkeypatch):
    """A package with one network, as if it was trained in `tmp_path/outputs`."""
    for module in (published_networks, publish_networks):
        monkeypatch.setattr(module, "FOLDER", tmp_path / "networks")
    published_networks.FOLDER.mkdir()
    stage = network(f"outputs={tmp_path / 'outputs'}")
    stage.folder.mkdir(parents=True)
    model = stage.untrained()
    torch.save({"state_dict": model.state_dict()}, stage.folder / BEST)
    stage.finish({"epochs": 1}, dict(model.hparams))
    index = published_networks.FOLDER / published_networks.INDEX
    index.write_text(json.dumps([publish_networks.publish(stage)]))
    return model


def test_a_published_network_is_the_trained_one_in_16_bits(shipped):
    found = network("networks=published").load()
    clips = torch.randn(3, 2, 16000)
    with torch.inference_mode():
        torch.testing.assert_close(found(clips), shipped.eval()(clips), atol=0.02, rtol=0)
    for name, own in found.state_dict().items():
        wanted = shipped.state_dict()[name]
        assert own.dtype == wanted.dtype
        assert torch.equal(own, wanted.half().float() if own.dim() > 1 else wanted)


def test_nothing_of_the_training_world_is_made(shipped, tmp_path):
    given = (*ROW, "networks=published", f"outputs={tmp_path}")
    heard = [f"training.acoustics.{own.split('.', 1)[1]}" for own in SMALL if "acoustics." in own]
    trained = ("+acoustics@training.acoustics=resonance", *heard)
    run = Evaluation(composed(*given, "acoustics=diffraction", *trained))
    made = [stage for stage in missing([run]) if isinstance(stage, DirectSound)]
    assert [stage.apartments.subset for stage in made] == ["test"]
    assert not [stage for stage in missing([run]) if isinstance(stage, Trained)]


@pytest.mark.parametrize(
    "other", ["train_seed=1", "training.microphone.gain=0.5", "+split@training.scenes=var"]
)
def test_another_recipe_or_training_world_is_refused(shipped, other):
    with pytest.raises(UserError, match=r"^networks=published: the package has no sound network"):
        missing([Evaluation(composed(*ROW, "networks=published", other))])


def test_the_seeds_of_training_that_the_package_has_are_named(shipped):
    with pytest.raises(UserError, match=r"of this name it has train_seed 0; give"):
        missing([Evaluation(composed(*ROW, "networks=published", "train_seed=1"))])
    with pytest.raises(UserError, match=r"of these settings; give"):
        missing([Evaluation(composed(*ROW, "networks=published", "training.microphone.gain=0.5"))])


def test_in_other_apartments_the_split_of_the_package_is_named(shipped):
    own = composed(*ROW, "networks=published", "train_seed=1")
    with pytest.raises(
        UserError, match=r"give training\.scenes=var, the split of all of them, or "
    ):
        missing([Evaluation(own)])
    own.training.scenes.name = "var"
    with pytest.raises(UserError, match="give networks=trained, or"):
        missing([Evaluation(own)])


def test_all_networks_of_the_package_are_trained_in_the_split_that_messages_name():
    for run in publish_networks.RUNS:
        assert composed(*run).training.scenes.name == published_networks.SCENES


def test_what_changes_the_evaluation_alone_keeps_the_network(shipped):
    one, other = (network("networks=published", own) for own in ("seed=0", "microphone.gain=0.5"))
    assert one.fingerprint == other.fingerprint != network().fingerprint


def test_publishing_keeps_what_is_not_trained_in_the_folder(shipped, tmp_path, monkeypatch):
    monkeypatch.setattr(publish_networks, "RUNS", [[*ROW, "logger=none"]])
    index = published_networks.FOLDER / published_networks.INDEX
    before = index.read_text()
    weights = network("networks=published").published.path.read_bytes()
    (published_networks.FOLDER / "old.safetensors").touch()
    publish_networks.main(str(tmp_path / "empty"))
    assert json.loads(index.read_text()) == json.loads(before)
    assert network("networks=published").published.path.read_bytes() == weights
    assert not (published_networks.FOLDER / "old.safetensors").exists()


def test_a_changed_file_is_refused(shipped):
    path = network("networks=published").published.path
    path.write_bytes(path.read_bytes()[:-1] + b"x")
    with pytest.raises(UserError, match="damaged; install the package again"):
        network("networks=published").load()


def test_an_unknown_value_and_a_row_without_networks_are_refused(shipped):
    with pytest.raises(UserError, match="networks: 'publishd' is none of trained, published"):
        _ = network("networks=publishd").fingerprint
    cfg = composed("agent=greedy", "networks=published")
    with pytest.raises(UserError, match="networks"):
        refuse_unread("eval", cfg, Evaluation(cfg).read(), ["networks=published"])


def test_a_run_says_which_networks_it_used(shipped):
    cfg = composed(*ROW, "networks=published")
    assert describe_world(cfg, cfg).endswith("; networks published with the package")
    assert "networks" not in describe_world(composed(*ROW), cfg)


def test_the_package_has_the_networks_of_the_table():
    known = published_networks.published_networks()
    for run in publish_networks.RUNS:
        cfg = composed(*run, "networks=published")
        found = [own for own in with_needs([Evaluation(cfg)]) if isinstance(own, Trained)]
        assert found
        assert all(own.published in known.values() for own in found)
        default = composed(run[0])
        papers = (cfg.acoustics.name, cfg.protocol.name) == ("resonance", "var")
        assert bool(paper_sounds(cfg, default)) == papers
    for own in known.values():
        assert own.weights()
        assert own.sha256 in own.path.with_suffix(".md").read_text()


def test_the_networks_are_small():
    files = list(published_networks.FOLDER.iterdir())
    assert sum(path.stat().st_size for path in files) < 16e6
