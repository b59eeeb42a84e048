"""Observations of agents in the apartments of one subset."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

from torch import Tensor

from avn.core.errors import UserError
from avn.dataset.scene import Scene
from avn.navigation.episodes import ONE_SOUND
from avn.navigation.observations import RenderedAudio, SceneObservations
from avn.pipeline.apartments import TEST, Apartments
from avn.pipeline.audio_inference import Clips
from avn.pipeline.dynamics import changing
from avn.pipeline.live_audio import LiveInference
from avn.pipeline.observation_table import OBSERVATIONS, OWN
from avn.pipeline.told import check_told


class Observed:
    """Observations in the apartments of one subset of a world.

    Parameters
    ----------
    apartments : Apartments
        Apartments of the subset.
    names : sequence of str
        Keys of `OBSERVATIONS`; other names are left out, as they need no stage.
    clips : Clips, optional
        Clip realisations; those of an evaluation by default.
    truth : sequence of str
        Entries of `agent.oracle_inputs` that are replaced by ground truth.
    """

    def __init__(
        self,
        apartments: Apartments,
        names: Iterable[str],
        clips: Clips | None = None,
        truth: Sequence[str] = (),
    ) -> None:
        self.apartments, self.cfg = apartments, apartments.cfg
        self.names = [name for name in OBSERVATIONS if name in set(names)]
        self.clips, self._truth = clips or Clips(), truth
        # each clip is heard in few episodes with one sound each, or is in no table of steady sounds
        rare = self.cfg.get("episodes") == ONE_SOUND or self.mixed
        self._live = apartments.world == TEST and rare

    @property
    def mixed(self) -> bool:
        """True if sounds begin, end or move in an episode, or are heard with another one."""
        return bool({"schedule", "distractor", "motion"} & {*changing(self.cfg)})

    def is_true(self, name: str) -> bool:
        """Return whether an observation is ground truth."""
        return OBSERVATIONS[name].truth in self._truth

    def is_live(self, name: str) -> bool:
        """Return whether a network's outputs are computed when they are heard, not in a table."""
        observation = OBSERVATIONS[name]
        tabulated = observation.audio and not observation.rendered
        return self._live and tabulated and not self.is_true(name)

    def check(self, agent: str, wanted: Sequence[str]) -> None:
        """Refuse observations that do not exist or that the config has no network for.

        Parameters
        ----------
        agent : str
            Name of the agent, for messages.
        wanted : sequence of str
            Names of the observations that the agent needs.

        Raises
        ------
        UserError
            For such an observation, or an entry of `agent.oracle_inputs` without any effect.
        """
        heard = [name for name in self.names if name in wanted and not self.is_true(name)]
        check_told(self.cfg, agent, heard)
        for truth in self._truth:
            shown = [
                name for name, observation in OBSERVATIONS.items() if observation.truth == truth
            ]
            if shown and not set(shown) & set(wanted):
                raise UserError(
                    f"agent.oracle_inputs: '{truth}' is nothing that agent {agent} observes"
                )
            if self.mixed and any(OBSERVATIONS[name].audio for name in shown):
                raise UserError(
                    f"agent.oracle_inputs: '{truth}' is known of steady sounds alone; take "
                    "schedule=continuous, distractor=none and motion=still"
                )
        for name in wanted:
            start = f"agent {agent} needs the observation '{name}'"
            if name not in (*OBSERVATIONS, *OWN):
                raise UserError(f"{start}; there are {', '.join((*OBSERVATIONS, *OWN))}")
            if name in self.names and not self.is_true(name):
                observation = OBSERVATIONS[name]
                if not observation.there(self.cfg):
                    raise UserError(f"{start}: {observation.hint}")

    @property
    def stages(self) -> dict[str, Any]:
        """Stages of the observations that are not ground truth and that the config has."""
        return {
            name: self._stage(name)
            for name in self.names
            if not self.is_true(name) and OBSERVATIONS[name].there(self.cfg)
        }

    def _stage(self, name: str) -> Any:
        stage = OBSERVATIONS[name].stage(self.cfg, self.apartments, self.clips)
        return LiveInference(stage) if self.is_live(name) else stage

    @property
    def settings(self) -> tuple[str, ...]:
        """Keys of the config that change the observations in addition to those of the stages."""
        keys: list[str] = []
        for name in self.names:
            observation = OBSERVATIONS[name]
            keys += observation.true_settings if self.is_true(name) else observation.settings
        return tuple(dict.fromkeys(keys))

    def load(self, scenes: Sequence[Scene]) -> list[SceneObservations]:
        """Read all observations.

        Parameters
        ----------
        scenes : sequence of Scene
            Scenes of the apartments.

        Returns
        -------
        list of SceneObservations
            Observations in each scene.
        """
        observed: list[tuple[dict[str, Any], ...]] = [({}, {}, {}) for _ in scenes]
        stages = self.stages
        for name in self.names:
            observation = OBSERVATIONS[name]
            if self.is_true(name) and observation.true:
                tensors = observation.true(self.apartments, scenes)
            else:
                live = self.is_live(name)
                tensors = stages[name].load() if live else observation.load(stages[name])
            rendered = observation.rendered or self.is_live(name)
            kind = 2 if rendered else 0 if observation.audio else 1
            for own, tensor in zip(observed, tensors, strict=True):
                own[kind][name] = tensor
        return [
            SceneObservations(_alike(audio, rendered), visual, rendered)
            for audio, visual, rendered in observed
        ]


def _alike(audio: dict[str, Tensor], rendered: dict[str, RenderedAudio]) -> dict[str, Tensor]:
    """Return audio observations with equal numbers of realisations; ground truth has only one."""
    counts = [tensor.shape[3] for tensor in audio.values()]
    most = max([*counts, *(each.realisations for each in rendered.values())], default=1)
    return {
        name: tensor.expand(*tensor.shape[:3], most, *tensor.shape[4:])
        for name, tensor in audio.items()
    }
