"""The group `occupancy_model`: a mapper chooses its network, and the command line another."""

import pytest
from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra

from avn.config import registry
from avn.config.folder import conf_folder


@pytest.mark.parametrize(
    ("overrides", "network", "epochs"),
    [
        (["agent=greedy"], "none", None),
        (["agent=plan_noexp"], "small", 5),
        (["agent=plan_noexp", "mapper=occupancy_released"], "released", 30),
        (["agent=plan_noexp", "occupancy_model=released"], "released", 30),
        (["agent=plan_noexp", "occupancy_model.epochs=2"], "small", 2),
        (["agent=plan_exp"], "none", None),
        (["agent=plan_exp", "occupancy_model=small", "mapper.local_patches=true"], "small", 5),
        (["agent=a3c_va", "mapper=occupancy"], "small", 5),
        (["agent=plan_noexp", "mapper=none"], "none", None),
    ],
)
def test_which_network_sees_free_cells(overrides, network, epochs):
    GlobalHydra.instance().clear()
    registry.register()
    with initialize_config_dir(str(conf_folder().resolve()), version_base="1.3"):
        cfg = compose("eval", overrides=overrides)
    assert cfg.occupancy_model.name == network
    assert (cfg.occupancy_model._target_ is None) == (network == "none")
    if epochs:
        assert cfg.occupancy_model.epochs == epochs
        assert cfg.occupancy_model.train_seed == cfg.train_seed
