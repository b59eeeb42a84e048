"""Small worlds for tests: settings with which a command on the mini split takes seconds."""

from hydra import compose, initialize_config_dir
from hydra.core.global_hydra import GlobalHydra

from avn.config import schema
from avn.config.folder import conf_folder
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
    "takes=2",
    "protocol.starts=4",
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
    "occupancy_model.looks=1",
    "occupancy_model.times=1",
    "occupancy_model.validation_views=40",
)
# An actor-critic row that has learnt nothing.
A3C = (
    "protocol.exploration=30",
    "a3c.workers=1",
    "a3c.episodes=8",
    "a3c.steps=5",
    "a3c.total=400",
    "a3c.validate_every=400",
    "a3c.validation_starts=1",
    "a3c.takes=1",
    "a3c.walks=2",
    "a3c.refresh=5",
)


def composed(*overrides, command="eval"):
    """The config of a command."""
    GlobalHydra.instance().clear()
    schema.register()
    with initialize_config_dir(str(conf_folder().resolve()), version_base="1.3"):
        return compose(command, overrides=[*overrides])


def fitting(chosen, *settings):
    """Those settings that a run reads, for a command refuses the others.

    `chosen` is what it is of: `agent=greedy`, `model=sound_cnn`, or `generate`; or a tuple that
    begins with it.
    """
    chosen, *more = [chosen] if isinstance(chosen, str) else chosen
    if chosen == "generate":
        read = settings_of(composed(*settings, command="generate"))
    elif chosen.startswith("model="):
        read = model_of(composed(chosen, *settings, *more, command="train")).read()
    else:
        read = Evaluation(composed(chosen, *settings, *more)).read()
    keys = {leaf.rsplit(".", n)[0] for leaf in read for n in range(leaf.count(".") + 1)}
    return tuple(own for own in settings if own.split("=")[0] in keys)


def opened(plan, acoustics, folder):
    """The scene of a floor plan, its geometry written below a folder."""
    path = folder / plan.name / "geometry.h5"
    build_geometry(plan, acoustics, path, "a fingerprint")
    return load_scene(path, "a fingerprint")
