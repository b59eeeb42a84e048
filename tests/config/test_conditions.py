"""Conditions: each composes with every kind of row, and changes the test world alone."""

from functools import lru_cache

import pytest
import yaml

from avn.acoustics.sound_table import packaged_sounds
from avn.config.folder import conf_folder
from avn.config.python import compose_command
from avn.core.classes import build_object
from avn.core.settings import plain
from avn.pipeline.dynamics import GROUPS, build_dynamics

FILES = sorted((conf_folder() / "condition").glob("*.yaml"))
NAMES = [path.stem for path in FILES]
TABLE = yaml.safe_load((conf_folder() / "table" / "conditions.yaml").read_text())


@lru_cache
def composed(*overrides):
    return compose_command("eval", overrides)[0]


@pytest.mark.parametrize("row", ["random_walk", "plan_exp", "belief"])
@pytest.mark.parametrize("condition", NAMES)
def test_it_composes_with_a_row_and_leaves_training_alone(condition, row):
    cfg, usual = composed(f"agent={row}", f"condition={condition}"), composed(f"agent={row}")
    assert plain(cfg, "training") == plain(usual, "training")
    assert plain(cfg, "agent") == plain(usual, "agent")
    changed = {key for key in usual if plain(cfg, str(key)) != plain(usual, str(key))}
    assert bool(changed) == (condition != "none")
    assert changed <= {"sound", "episodes", "microphone", "acoustics", *GROUPS}
    build_object("microphone", cfg.microphone)
    build_dynamics(cfg)


@pytest.mark.parametrize("condition", [name for name in NAMES if name != "heard"])
def test_no_sound_or_noise_of_a_condition_is_one_of_training(condition):
    cfg = composed("agent=belief", f"condition={condition}")
    table = packaged_sounds()
    trained = set(plain(cfg, "training.sounds"))
    heard = set(plain(cfg, "sound")) if condition != "none" else set()
    noises = {name for name in cfg.microphone.get("noises", []) if name != "white"}
    assert not (heard | noises) & trained
    assert all(table[name].split == "test" for name in noises)
    assert not noises & set(cfg.training.microphone.get("noises", []))
    if condition == "unheard_category":
        assert not {table[name].category for name in heard} & {
            table[name].category for name in trained
        }


def test_training_has_white_noise_and_all_noises_of_a_household_of_its_split():
    noises = list(composed("agent=belief").training.microphone.noises)
    of_training = {
        name
        for name, sound in packaged_sounds().items()
        if sound.split == "train" and sound.category in ("appliance", "fire", "water")
    }
    assert len(noises) == len(set(noises))
    assert set(noises) == {"white"} | of_training


def test_every_condition_has_a_column_and_the_command_line_wins():
    assert set(TABLE["conditions"]) == {*NAMES} - {"none"}
    cfg, _ = compose_command("eval", ["condition=unheard", "sound=alarm"])
    assert list(cfg.sound) == ["alarm"]
