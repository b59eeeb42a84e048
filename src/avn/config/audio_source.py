"""Hydra plugin that accepts paths of audio files as options of the config group `sound`."""

from __future__ import annotations

from pathlib import Path

from hydra.core.config_search_path import ConfigSearchPath
from hydra.core.object_type import ObjectType
from hydra.plugins.config_source import ConfigLoadError, ConfigResult, ConfigSource
from hydra.plugins.search_path_plugin import SearchPathPlugin
from omegaconf import OmegaConf

AUDIO_SUFFIXES = (".wav", ".flac", ".ogg", ".oga", ".opus", ".mp3", ".aif", ".aiff", ".au", ".caf")
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


class AudioFiles(ConfigSource):
    """Config source in which `sound/PATH.wav` holds the mapping {stem: PATH.wav}."""

    @staticmethod
    def scheme() -> str:
        """Return the scheme of the source in search paths."""
        return "audio"

    def load_config(self, config_path: str) -> ConfigResult:
        """Return the mapping from the file's stem to its path."""
        if not self.is_config(config_path):
            raise ConfigLoadError(f"Config not found: {config_path}")
        path = config_path.removeprefix(_GROUP)
        return ConfigResult(
            provider=self.provider,
            path=self.full_path(),
            config=OmegaConf.create({Path(path).stem: path}),
            # without it, the folders of the path would become keys
            header={"package": "sound"},
        )

    def is_group(self, config_path: str) -> bool:
        """Return False: the source has no groups."""
        return False

    def is_config(self, config_path: str) -> bool:
        """Return whether the path is an audio file's in the group `sound`."""
        return config_path.startswith(_GROUP) and is_audio(config_path)

    def available(self) -> bool:
        """Return True: the source needs no folder."""
        return True

    def list(self, config_path: str, results_filter: ObjectType | None) -> list[str]:
        """Return no names: audio files are not listed."""
        return []


class AudioFilesPath(SearchPathPlugin):
    """Plugin that adds `AudioFiles` to Hydra's search path."""

    def manipulate_search_path(self, search_path: ConfigSearchPath) -> None:
        """Append the source to the search path."""
        search_path.append("avn", "audio://")


PLUGINS = (AudioFiles, AudioFilesPath)
