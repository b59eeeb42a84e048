"""Outputs of audio networks on the clips that agents hear, computed step by step.

A table of the outputs of every clip is worth its time where each clip is heard often. Episodes with
one of many sounds each hear a small part of all clips, so the network is applied to these alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import torch
from torch import Tensor

from avn.acoustics.counter_hash import absorb
from avn.core.clip_id import ClipId
from avn.core.prefetch import prefetch, threads_for_one_operation
from avn.core.sound_mix import SoundMix
from avn.pipeline.audio_inference import AudioInference
from avn.pipeline.rendered_audio import Output, RenderedClips, Waveforms, batches
from avn.pipeline.scenes import heard_sound
from avn.pipeline.stage import Stage
from avn.pipeline.told import is_told, told_categories

# Clips computed at once, for the caches of a CPU.
_BATCH = 32


class LiveInference(Waveforms):
    """Stage of a network's outputs for the clips that agents hear. It has no file of its own.

    Parameters
    ----------
    table : AudioInference
        Stage of the table that it stands for: network, apartments, clips.
    """

    kind = "hear/live"

    def __init__(self, table: AudioInference) -> None:
        super().__init__(table.cfg, table.apartments, table.clips)
        self._table = table

    def needs(self) -> Sequence[Stage]:
        """Return the stages of the apartments' acoustics and of the network."""
        return (heard_sound(self.cfg, self.apartments), self._table.network)

    def settings(self) -> Sequence[str]:
        """Return the keys of the table."""
        return self._table.settings()

    def content(self) -> Any:
        """Return the content of the table's fingerprint, and its kind."""
        return (*self._table.content(), self._table.kind)

    @property
    def title(self) -> str:
        """Title of the product, for messages."""
        return self._table.title

    @property
    def clips_class(self) -> type[RenderedClips]:
        """Class of the renderer of an apartment."""
        return RememberedClips

    def check(self) -> None:
        """Refuse what the table refuses."""
        self._table.check()

    def output(self) -> tuple[Output, tuple[int, ...]]:
        """Return the function from clips to outputs, and the shape of one output.

        Where the agent is told the category of the goal's sound, the network is told it.
        """
        model = self._table.network.load()
        model.eval()
        forward = self._table.output_of(model)
        told = told_categories(self.cfg) if is_told(self.cfg) else None

        @torch.inference_mode()
        def outputs(clips: Tensor, sound: Tensor) -> Tensor:
            given = () if told is None else (told[sound].to(model.device),)
            return forward(clips.to(model.device), *given).cpu().float()

        example = torch.zeros(1, 2, self._rate), torch.zeros(1, dtype=torch.int64)
        return outputs, tuple(outputs(*example).shape[1:])


class RememberedClips(RenderedClips):
    """Renderer that computes each clip once, as agents that go in circles hear the same again."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        # keys of the clips that were heard, in order, and their outputs
        self._keys = torch.empty(0, dtype=torch.int64)
        self._outputs = torch.empty(0, *self.shape)

    def __call__(self, clip: ClipId, mix: SoundMix | None = None) -> Tensor:
        """Return the outputs of N clips, (N, ...) float32."""
        mix = mix and mix.clipped(self.memory)
        keys = _keys(clip, mix)
        known = torch.isin(keys, self._keys)
        if not known.all():
            new, first = _first_of_each(keys[~known])
            rows = (~known).nonzero()[:, 0][first]
            heard = self._computed(ClipId(*(part[rows] for part in clip)), mix and mix.rows(rows))
            order = torch.cat((self._keys, new)).argsort()
            self._keys = torch.cat((self._keys, new))[order]
            self._outputs = torch.cat((self._outputs, heard))[order]
        return self._outputs[torch.searchsorted(self._keys, keys)]

    def _computed(self, clip: ClipId, mix: SoundMix | None) -> Tensor:
        parts = batches(clip, mix, _BATCH)
        threads = torch.get_num_threads()
        with threads_for_one_operation(1):
            if len(parts) == 1:
                return self._rendered(*parts[0])
            return torch.cat([*prefetch(lambda part: self._rendered(*part), parts, threads)])


def _keys(clip: ClipId, mix: SoundMix | None) -> Tensor:
    """Return a key of 64 bits for each clip, (N,) int64."""
    words = [*clip]
    if mix is not None:
        words += [part.view(torch.int64) for part in mix]
    return absorb(torch.zeros((), dtype=torch.int64), torch.stack(words, dim=-1))


def _first_of_each(keys: Tensor) -> tuple[Tensor, Tensor]:
    """Return the different keys in order, and the index at which each is first."""
    found, inverse = keys.unique(return_inverse=True)
    first = torch.full_like(found, len(keys))
    return found, first.scatter_reduce(0, inverse, torch.arange(len(keys)), "amin")
