"""Data set of audio clips of some apartments, rendered batch by batch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import torch
from torch import Tensor
from torch.utils.data import Dataset

from avn.acoustics.clips import ClipRenderer, DrySounds, brir_spectra
from avn.acoustics.microphone import Microphone
from avn.core.clip_id import ClipId
from avn.datamodules.second_sources import SecondSources
from avn.dataset.scene import AudibleScene, Brirs
from avn.dataset.source_locations import locate_sources
from avn.modules.audio_network import ClipBatch


@dataclass
class SceneClips:
    """Impulse responses and source locations of one apartment with K sources and S states.

    Attributes
    ----------
    brirs : Brirs
        Impulse responses.
    locations : (K, S, 2) float32 tensor
        Metres to the right and to the front of the agent.
    in_sight : (K, S) bool tensor
        True where the source is in the line of sight.
    """

    brirs: Brirs
    locations: Tensor
    in_sight: Tensor

    @classmethod
    def from_scene(cls, scene: AudibleScene) -> SceneClips:
        """Take them from an apartment's scene."""
        return cls(scene.brirs, *locate_sources(scene))


class ClipSet(Dataset[ClipBatch]):
    """Data set of the clips of some apartments, each a (realisation, pair, sound).

    A pair is a source and a state of an apartment. An item is the integer
    `(realisation x pairs + pair) x sounds + sound`; the number of realisations is unlimited.
    `__getitems__` renders a whole batch; a clip is a pure function of its item, `purpose` and
    `seed`.

    Parameters
    ----------
    scenes : sequence of AudibleScene
        Apartments with impulse responses.
    sounds : DrySounds
        Bank of dry sounds.
    microphone : Microphone
        Microphones at the ears.
    purpose : {"train", "eval"}
        The two have independent realisations.
    seed : int
        Seed of all random draws.
    targets : sequence of (K, S, ...) tensors, optional
        Targets of each apartment; by default the locations of the sources.
    second : SecondSources, optional
        Second sources, and what is told of the first ones; by default none, and nothing.
    """

    def __init__(
        self,
        scenes: Sequence[AudibleScene],
        sounds: DrySounds,
        microphone: Microphone,
        purpose: str,
        seed: int,
        targets: Sequence[Tensor] | None = None,
        second: SecondSources | None = None,
    ) -> None:
        self.scenes = [SceneClips.from_scene(scene) for scene in scenes]
        self.sounds, self.second = sounds, second
        self.renderer = ClipRenderer(sounds, microphone, seed, purpose)
        shapes = [clips.in_sight.shape for clips in self.scenes]
        grids = [torch.cartesian_prod(torch.arange(k), torch.arange(s)) for k, s in shapes]
        self.source, self.state = torch.cat(grids).unbind(1)
        self._sources, self._states = torch.tensor(shapes).unbind(1)
        sizes = torch.tensor([len(grid) for grid in grids])
        self.apartment = torch.arange(len(grids)).repeat_interleave(sizes)
        targets = targets or [clips.locations for clips in self.scenes]
        self.target = torch.cat([target.flatten(0, 1) for target in targets])
        self.in_sight = torch.cat([clips.in_sight.flatten() for clips in self.scenes])

    @property
    def pairs(self) -> int:
        """Number of pairs of source and state."""
        return len(self.source)

    def __len__(self) -> int:
        """Return the number of clips of one realisation."""
        return self.pairs * len(self.sounds.names)

    def item(self, pair: Tensor, sound: Tensor, realisation: int) -> Tensor:
        """Compute the items of clips.

        Parameters
        ----------
        pair, sound : (N,) int64 tensor
            Indices of the pairs and of the sounds.
        realisation : int
            Index of the realisation.
        """
        return (realisation * self.pairs + pair) * len(self.sounds.names) + sound

    def __getitem__(self, item: int) -> ClipBatch:
        """Render a batch of one item."""
        return self.__getitems__([item])

    def __getitems__(self, items: Sequence[int]) -> ClipBatch:
        """Render a batch of several items."""
        number = torch.as_tensor(items, dtype=torch.int64)
        sound = number % len(self.sounds.names)
        pair = number // len(self.sounds.names)
        realisation, pair = pair // self.pairs, pair % self.pairs
        clip = ClipId(self.source[pair], self.state[pair], sound, realisation)
        heard = self._at_ears(pair, clip)
        told, mask = torch.zeros_like(number), torch.empty(len(number), 0, 0)
        if self.second:
            told, mask = self._add_second(heard, number, pair, clip)
        return ClipBatch(
            clips=self.renderer.record(heard, clip),
            target=self.target[pair],
            in_sight=self.in_sight[pair],
            sound=sound,
            told=told,
            mask=mask,
        )

    def _add_second(
        self, heard: Tensor, item: Tensor, pair: Tensor, clip: ClipId
    ) -> tuple[Tensor, Tensor]:
        """Add second sources to the sound at the ears, in place; return told and mask."""
        assert self.second is not None
        apartment = self.apartment[pair]
        told, source, sound = self.second.draw(
            item, clip.source, clip.sound, self._sources[apartment]
        )
        # pairs of an apartment are ordered by source
        pair = pair + (source - clip.source) * self._states[apartment]
        rows = (source >= 0).nonzero()[:, 0]
        other = torch.zeros_like(heard)
        if len(rows):
            second = clip._replace(source=source, sound=sound)
            other[rows] = self._at_ears(pair[rows], ClipId(*(part[rows] for part in second)))
        mask = self.second.mask(heard, other)
        heard += other
        return told, mask

    def _at_ears(self, pair: Tensor, clip: ClipId) -> Tensor:
        """Render the sound of N clips at the ears; the responses of a pair are transformed once."""
        pair, index = pair.unique(return_inverse=True)
        return self.renderer.at_ears(brir_spectra(self._brirs(pair), self.sounds.rate), clip, index)

    def _brirs(self, pair: Tensor) -> Tensor:
        """Gather the impulse responses (N, 2, T) of pairs (N,), each from its apartment."""
        apartment = self.apartment[pair]
        longest = max(clips.brirs.samples for clips in self.scenes)
        brirs = torch.zeros(len(pair), 2, longest)
        for index, clips in enumerate(self.scenes):
            rows = (apartment == index).nonzero()[:, 0]
            if len(rows):
                selected = pair[rows]
                gathered = clips.brirs.gather(self.source[selected], self.state[selected])
                brirs[rows, :, : clips.brirs.samples] = gathered
        return brirs
