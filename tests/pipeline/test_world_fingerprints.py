"""What of the test world and of the training world makes which product anew."""

import pytest
from ears import write_head
from omegaconf import OmegaConf
from small import composed

from avn.apartments.generator import generate
from avn.pipeline.apartments import TEST, TRAINING, Apartments
from avn.pipeline.occupancy import OccupancyNetwork
from avn.pipeline.policy import Policy
from avn.pipeline.scenes import DirectSound, Geometry, LateReverberation
from avn.pipeline.sound_network import SoundNetwork
from avn.pipeline.stop_classifier import StopNetwork
from avn.pipeline.views import RenderedViews

MINI = ("agent=plan_exp", "split=mini", "protocol=var_stop", "occupancy_model=small")


@pytest.mark.parametrize("kind", [SoundNetwork, StopNetwork, OccupancyNetwork, Policy])
@pytest.mark.parametrize(
    "override",
    [
        "sound=alarm",
        "+sound.beep=ring",
        "microphone.gain=0.5",
        "microphone.noise_rms=0.02",
        "split=elsewhere",
        "acoustics=diffraction",
        "acoustics.head=kemar",
        "seed=3",
    ],
)
def test_no_change_of_the_test_world_makes_a_network_anew(kind, override, tmp_path):
    """Where the training world is given its own apartments and acoustics."""
    own = ("+split@training.scenes=mini", "+acoustics@training.acoustics=resonance")
    row = ("agent=a3c_va_mapper", "stop_model=cnn5", "split=mini", *own)
    before, after = composed(*row), composed(*row, *_apartments(override, tmp_path))
    assert kind(before).fingerprint == kind(after).fingerprint
    assert not any(key.startswith(("sound.", "microphone.")) for key in kind(after).read())


def _apartments(override, folder):
    if override != "split=elsewhere":
        return (override,)
    plan = generate(77, "mine", sources=2, size="small")
    (folder / "mine.json").write_text(plan.to_json())
    return (f"split.folder={folder}", "split.name=new")


def test_the_default_head_is_in_no_settings_of_a_fingerprint():
    """So that users' products of before there were other heads are found."""
    cfg = composed(*MINI)
    for kind in (Geometry, LateReverberation, DirectSound):
        stage = kind(cfg, Apartments(cfg, "test"))
        assert "head" not in str(stage.inputs())
        assert ("acoustics.head" in stage.read_here()) == (kind is not Geometry)


def test_a_file_of_a_head_counts_by_its_content(tmp_path):
    paths = [tmp_path / name for name in ("a.sofa", "b.sofa", "c.sofa")]
    for path, count in zip(paths, (40, 40, 50), strict=True):
        write_head(path, count)
    for kind in (LateReverberation, DirectSound):
        one, same, other = (
            kind(cfg, Apartments(cfg, "test")).fingerprint
            for cfg in (composed(*MINI, f"acoustics.head={path}") for path in paths)
        )
        assert one == same != other


def test_each_world_has_its_own_head():
    own = ("acoustics.head=kemar", "+acoustics@training.acoustics=resonance")
    cfg, usual = composed(*MINI, *own), composed(*MINI)
    assert (cfg.acoustics.head, cfg.training.acoustics.head) == ("kemar", "ku100")
    test, training = (Apartments(cfg, "train", world) for world in (TEST, TRAINING))
    before = Apartments(usual, "train")
    for kind in (LateReverberation, DirectSound):
        assert kind(cfg, training).paths == kind(usual, before).paths
        assert not {*kind(cfg, test).paths} & {*kind(usual, before).paths}


def test_another_test_apartment_makes_no_other_apartment_anew(tmp_path):
    for seed in (1, 2):
        plan = generate(seed, f"flat_{seed}", sources=2, size="small")
        (tmp_path / f"flat_{seed}.json").write_text(plan.to_json())
    split = (f"split.folder={tmp_path}", "split.name=new")
    before = Apartments(composed(*split), "test")
    one = DirectSound(before.cfg, before).fingerprints, RenderedViews(before.cfg, before).paths
    plan = generate(3, "flat_0", sources=2, size="small")
    (tmp_path / "flat_0.json").write_text(plan.to_json())
    after = Apartments(composed(*split, "split.seed=1"), "test")  # read anew
    assert DirectSound(after.cfg, after).fingerprints[1:] == one[0]
    assert RenderedViews(after.cfg, after).paths[1:] == one[1]


def test_the_training_world_follows_the_test_world_until_it_is_chosen():
    cfg = composed("acoustics=diffraction", "acoustics.rays=300", "split=mini")
    assert OmegaConf.to_container(cfg.training.acoustics) == OmegaConf.to_container(cfg.acoustics)
    assert cfg.training.scenes.name == "mini"
    # what records and sounds in training is the training world's own
    cfg = composed("microphone.gain=0.5", "sound=alarm")
    assert cfg.training.microphone.gain == 1.0
    assert list(cfg.training.sounds) == ["ring", "alarm", "clock"]
    own = composed("acoustics=diffraction", "+acoustics@training.acoustics=resonance")
    assert own.training.acoustics.direct_path == "transmission"
    assert own.acoustics.direct_path == "diffraction"


def test_equal_worlds_share_their_sound_and_other_parts_share_no_views():
    cfg = composed("split=mini", "+acoustics@training.acoustics=resonance")
    test, training = Apartments(cfg, "validation"), Apartments(cfg, "validation", TRAINING)
    assert DirectSound(cfg, test).paths == DirectSound(cfg, training).paths
    assert RenderedViews(cfg, test).paths == RenderedViews(cfg, training).paths
    assert RenderedViews(cfg, test).paths != RenderedViews(cfg, test, appearance_seed=1).paths


@pytest.mark.parametrize("kind", [SoundNetwork, StopNetwork])
def test_the_acoustics_of_the_training_world_are_read_where_they_follow_the_test(kind):
    read = kind(composed("agent=plan_noexp", "stop_model=cnn5", "split=mini")).read()
    assert {"acoustics.name", "acoustics.direct_path", "acoustics.rays", "split.folder"} <= read
    own = "+acoustics@training.acoustics=resonance"
    read = kind(composed("agent=plan_noexp", "stop_model=cnn5", "split=mini", own)).read()
    assert not any(key.startswith("acoustics.") for key in read)
