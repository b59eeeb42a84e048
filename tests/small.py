"""Small worlds for tests: settings with which a command on the mini split takes seconds."""

from copy import deepcopy
from functools import cache

from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra
from omegaconf import OmegaConf

from avn.config import registry
from avn.config.folder import conf_folder
from avn.config.spare import compose_fitting
from avn.dataset.build import build_geometry
from avn.dataset.scene import load_scene
from avn.pipeline.export import settings_of
from avn.pipeline.models import model_of
from avn.pipeline.run import Evaluation

SMALL = (
    "split=mini",
    "processes=1",
    "acoustics.rays=300",
    "acoustics.seconds=0.2",
    "sound_model.epochs=1",
    "sound_model.validation_clips=100",
    "realisations=2",
    "protocol.num_starts=4",
    "sound=[alarm,clock]",
    "renderer.camera.size=32",
    "renderer.samples=1",
    "renderer.light.gather_rays=4",
    "renderer.light.shadow_rays=2",
    "renderer.light.spacing=0.3",
    "backbone.size=32",
)
# The occupancy network of a row that sees.
EYES = (
    "occupancy_model.epochs=1",
    "occupancy_model.appearances=1",
    "occupancy_model.times=1",
    "occupancy_model.validation_views=40",
)
# Trainings whose curves no test looks at. A test that does needs networks of its own, for a network
# that another file has trained has none.
QUIET = ("logger=none",)
# An actor-critic row that has learnt nothing.
A3C = (
    "protocol.exploration_steps=30",
    "algorithm.workers=1",
    "algorithm.num_envs=8",
    "algorithm.rollout_length=5",
    "algorithm.total_steps=400",
    "algorithm.validate_every=400",
    "algorithm.validation_starts=1",
    "algorithm.realisations=1",
    "algorithm.exploration_walks=2",
    "algorithm.memory_refresh_interval=5",
)


def composed(*overrides, command="eval", compose=compose):
    """The config of a command."""
    # what a path leads to may change
    make = _composed.__wrapped__ if any("/" in own for own in overrides) else _composed
    return deepcopy(make(overrides, command, compose))


@cache  # of equal overrides once a process, for the tests of a file have most of them in common
def _composed(overrides, command, compose):
    GlobalHydra.instance().clear()
    registry.register()
    with initialize_config_dir(str(conf_folder().resolve()), version_base="1.3"):
        return compose(command, overrides=[*overrides])


@cache
def _option(group, option):
    return composed(f"{group}={option}")[group]


def option(group, name, **changes):
    """The node of an option such as `sound_model=cnn5`, with changes such as `net__pool="max"`."""
    found = deepcopy(_option(group, name))
    for key, value in changes.items():
        OmegaConf.update(found, key.replace("__", "."), value)
    return found


@cache  # the tests of a file ask for the same ones again and again
def fitting(chosen, *settings):
    """Those settings that a run reads, for a command refuses the others.

    `chosen` is what it is of: `agent=greedy`, `model=sound_cnn`, or `generate`; or a tuple that
    begins with it.
    """
    chosen, *more = [chosen] if isinstance(chosen, str) else chosen
    given = (chosen, *settings, *more)
    if chosen == "generate":
        read = settings_of(composed(*settings, command="generate", compose=compose_fitting))
    elif chosen.startswith("model="):
        read = model_of(composed(*given, command="train", compose=compose_fitting)).read()
    else:
        read = Evaluation(composed(*given, compose=compose_fitting)).read()
    keys = {leaf.rsplit(".", n)[0] for leaf in read for n in range(leaf.count(".") + 1)}
    return tuple(own for own in settings if own.split("=")[0] in keys)


def opened(plan, acoustics, folder):
    """The scene of a floor plan, its geometry written below a folder."""
    path = folder / plan.name / "geometry.h5"
    build_geometry(plan, acoustics, path, "a fingerprint")
    return load_scene(path, "a fingerprint")
