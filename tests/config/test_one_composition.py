"""A command composes its config once, and it is the config that Hydra composes."""

import sys
from contextlib import nullcontext

import hydra
import pytest
from hydra._internal.config_loader_impl import ConfigLoaderImpl
from hydra.core.global_hydra import GlobalHydra
from hydra.core.hydra_config import HydraConfig
from hydra.errors import HydraException
from omegaconf import OmegaConf

from avn.config import registry
from avn.config.folder import conf_folder
from avn.config.one_composition import composed_once

GIVEN = ("agent=greedy", "split=mini", "seed=3", "realisations=2")


@pytest.fixture
def composed(monkeypatch, tmp_path):
    """Run Hydra with some overrides; gives the jobs' configs, and how often it composed."""
    registry.register()
    monkeypatch.setenv("HYDRA_FULL_ERROR", "1")
    calls = []
    load = ConfigLoaderImpl.load_configuration

    def counted(*given, **options):
        calls.append(given)
        return load(*given, **options)

    monkeypatch.setattr(ConfigLoaderImpl, "load_configuration", counted)

    def run(block, *overrides):
        GlobalHydra.instance().clear()
        calls.clear()
        monkeypatch.setattr(sys, "argv", ["avn.eval", *overrides, f"outputs={tmp_path}"])
        found = []

        def job(cfg):
            both = OmegaConf.create({"hydra": HydraConfig.get()}), cfg
            found.append([OmegaConf.to_container(own) for own in both])

        job.__module__ = "avn.eval"
        main = hydra.main(version_base="1.3", config_path=str(conf_folder()), config_name="eval")
        with block:
            main(job)()
        return found, len(calls)

    return run


def test_the_config_of_one_job_is_that_of_hydra(composed):
    wanted, twice = composed(nullcontext(), *GIVEN)
    found, once = composed(composed_once(), *GIVEN)
    assert found == wanted
    assert (once, twice) == (1, 2)


@pytest.mark.parametrize("given", [("-m", *GIVEN[:2], "seed=0,1"), ("hydra.mode=MULTIRUN", *GIVEN)])
def test_a_sweep_has_the_jobs_that_it_has(composed, given):
    wanted, _ = composed(nullcontext(), *given)
    found, _ = composed(composed_once(), *given)
    assert found == wanted
    assert found


@pytest.mark.parametrize("given", ["seed=0,1", "agent=nosuch", "seed=x", "planner.nosuch=1"])
def test_a_mistake_is_the_one_that_hydra_finds(composed, given):
    said = []
    for block in (nullcontext(), composed_once()):
        with pytest.raises(HydraException) as error:
            composed(block, *GIVEN[:2], given)
        said.append((type(error.value), str(error.value)))
    assert said[0] == said[1]


def test_hydra_is_left_as_it_was():
    before = ConfigLoaderImpl.load_configuration, hydra._internal.hydra.Hydra.get_mode
    with pytest.raises(ZeroDivisionError), composed_once():
        _ = 1 // 0
    assert before == (
        ConfigLoaderImpl.load_configuration,
        hydra._internal.hydra.Hydra.get_mode,
    )
