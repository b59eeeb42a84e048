"""Hydra plugin that accepts recordings as options of the config group `sound`.

A recording is the path of an audio file or the name of a recording of the package.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from hydra.core.config_search_path import ConfigSearchPath
from hydra.core.object_type import ObjectType
from hydra.plugins.config_source import ConfigLoadError, ConfigResult, ConfigSource
from hydra.plugins.search_path_plugin import SearchPathPlugin
from omegaconf import DictConfig, OmegaConf

from avn.acoustics.sound_names import name_sounds
from avn.acoustics.sound_table import packaged_sounds

AUDIO_SUFFIXES = (
    *(".wav", ".wave", ".rf64", ".bw64", ".w64", ".aif", ".aiff", ".aifc", ".au", ".snd", ".caf"),
    *(".flac", ".ogg", ".oga", ".opus", ".mp3", ".mp2", ".m4a", ".mp4", ".aac"),
)
_GROUP = "sound/"


def is_audio(option: str) -> bool:
    """Return whether an option of the group `sound` is the path of an audio file."""
    return option.lower().endswith(AUDIO_SUFFIXES)


def quoted(value: str) -> str:
    """Quote the audio paths of an override, so that they may contain blanks, commas and dots."""
    if Path(value).expanduser().is_file() and is_audio(value):
        parts = [value]
    elif value.startswith(("[", "'", '"')):
        return value
    else:
        parts = value.split(",")
    return ",".join(_quote(part) if is_audio(part) else part for part in parts)


def _quote(path: str) -> str:
    escaped = path.replace("'", "\\'")
    return f"'{escaped}'"


def name_files(cfg: DictConfig) -> None:
    """Name the audio files of a composed config; see `avn.acoustics.sound_names`."""
    for holder, key in ((cfg, "sound"), (cfg.get("training"), "sounds")):
        if holder is not None and isinstance(holder.get(key), DictConfig):
            given: Any = OmegaConf.to_container(holder[key], resolve=True)
            holder[key] = name_sounds(given)


def choices(option: str) -> str:
    """Return the options of the group `sound` that have no file, for a message.

    Parameters
    ----------
    option : str
        An unknown option; of the names of recordings, those that begin as it does are listed.
    """
    prefix = f"{option.partition('_')[0]}_"
    names = [name for name in packaged_sounds() if name.startswith(prefix)]
    listed = f" ({', '.join(names)})" if names else ""
    return f"or the name of a recording{listed}, see docs/sounds.md, or the path of an audio file"


class AudioFiles(ConfigSource):
    """Config source of recordings.

    `sound/PATH.wav` holds the mapping {PATH.wav: PATH.wav}, and `sound/NAME` of a recording of the
    package {NAME: NAME}. Paths are distinct, so that no file of a list takes the place of another
    or of a packaged sound; `name_files` replaces them by names.
    """

    @staticmethod
    def scheme() -> str:
        """Return the scheme of the source in search paths."""
        return "audio"

    def load_config(self, config_path: str) -> ConfigResult:
        """Return the mapping from the recording's path or name to itself."""
        if not self.is_config(config_path):
            raise ConfigLoadError(f"Config not found: {config_path}")
        path = config_path.removeprefix(_GROUP)
        return ConfigResult(
            provider=self.provider,
            path=self.full_path(),
            config=OmegaConf.create({path: path}),
            # without it, the folders of the path would become keys
            header={"package": "sound"},
        )

    def is_group(self, config_path: str) -> bool:
        """Return False: the source has no groups."""
        return False

    def is_config(self, config_path: str) -> bool:
        """Return whether the path is that of a recording in the group `sound`."""
        option = config_path.removeprefix(_GROUP)
        return option != config_path and (is_audio(option) or option in packaged_sounds())

    def available(self) -> bool:
        """Return True: the source needs no folder."""
        return True

    def list(self, config_path: str, results_filter: ObjectType | None) -> list[str]:
        """Return no names: recordings are not listed."""
        return []


class AudioFilesPath(SearchPathPlugin):
    """Plugin that adds `AudioFiles` to Hydra's search path."""

    def manipulate_search_path(self, search_path: ConfigSearchPath) -> None:
        """Append the source to the search path."""
        search_path.append("avn", "audio://")


PLUGINS = (AudioFiles, AudioFilesPath)
