"""The recordings and the microphone of the test world and of the training world."""

from __future__ import annotations

from typing import Any

from omegaconf import DictConfig, OmegaConf

from avn.acoustics.clips import DrySounds
from avn.acoustics.dry_sounds import check_sounds, content_hash, load_sounds
from avn.acoustics.microphone import Microphone
from avn.acoustics.sound_names import name_sounds
from avn.acoustics.sound_table import packaged_sounds
from avn.core.classes import build_object
from avn.core.errors import UserError
from avn.core.files import check_name
from avn.core.settings import plain
from avn.pipeline.apartments import TEST, WorldKeys
from avn.reporting.results import ALL_SOUNDS


def sound_files(cfg: DictConfig, world: WorldKeys = TEST) -> dict[str, str]:
    """Return the sounds of a world: name to recording of the package or path.

    Raises
    ------
    UserError
        For an empty list, an invalid or reserved name, and for files that would have one name.
    """
    given = {str(name): str(path) for name, path in (plain(cfg, world.sounds) or {}).items()}
    if not given:
        raise UserError(f"{world.sounds}: empty; give a recording, such as {world.sounds}=ring")
    sounds = name_sounds(given)
    for name in sounds:
        check_name(world.sounds, name)
        if name == ALL_SOUNDS:
            raise UserError(f"{world.sounds}: '{name}' is the row of all sounds; rename it")
    return sounds


def dry_sounds(cfg: DictConfig, world: WorldKeys = TEST) -> DrySounds:
    """Load the recordings of a world; raise `UserError` where one cannot be read."""
    rate = int(OmegaConf.select(cfg, world.acoustics).rate)
    return DrySounds(load_sounds(sound_files(cfg, world), rate), rate=rate)


def check_heard(cfg: DictConfig, world: WorldKeys = TEST) -> None:
    """Raise `UserError` where a recording of a world cannot be read, or its microphone is wrong."""
    check_sounds(sound_files(cfg, world), int(OmegaConf.select(cfg, world.acoustics).rate))
    microphone_of(cfg, world)


def microphone_of(cfg: DictConfig, world: WorldKeys = TEST) -> Microphone:
    """Return the microphone of a world; raise `UserError` for an invalid setting."""
    key = world.microphone
    try:
        found: Microphone = build_object(key, OmegaConf.select(cfg, key))
    except UserError as error:
        # a class names its settings as those of `microphone`, whichever world it is in
        rest = str(error).removeprefix("microphone.")
        raise UserError(str(error) if rest == str(error) else f"{key}.{rest}") from None
    return found


def sounds_content(cfg: DictConfig, world: WorldKeys = TEST) -> list[Any]:
    """Return the names of a world's sounds in order, each with the hash of its recording."""
    return list(content_hash(sound_files(cfg, world)).items())


def sound_categories(cfg: DictConfig, world: WorldKeys = TEST) -> dict[str, str]:
    """Return the category of each sound; a file of the user is a category of its own."""
    table = packaged_sounds()
    return {
        name: table[path].category if path in table else name
        for name, path in sound_files(cfg, world).items()
    }
