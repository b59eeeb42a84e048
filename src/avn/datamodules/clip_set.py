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
    """

    def __init__(
        self,
        scenes: Sequence[AudibleScene],
        sounds: DrySounds,
        microphone: Microphone,
        purpose: str,
        seed: int,
        targets: Sequence[Tensor] | None = None,
    ) -> None:
        self.scenes = [SceneClips.from_scene(scene) for scene in scenes]
        self.sounds = sounds
        self.renderer = ClipRenderer(sounds, microphone, seed, purpose)
        shapes = [clips.in_sight.shape for clips in self.scenes]
        grids = [torch.cartesian_prod(torch.arange(k), torch.arange(s)) for k, s in shapes]
        self.source, self.state = torch.cat(grids).unbind(1)
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
        # The responses of a pair are transformed once for all of its sounds.
        pair, index = pair.unique(return_inverse=True)
        spectra = brir_spectra(self._brirs(pair), self.sounds.rate)
        source, state = self.source[pair][index], self.state[pair][index]
        return ClipBatch(
            clips=self.renderer.render(spectra, ClipId(source, state, sound, realisation), index),
            target=self.target[pair][index],
            in_sight=self.in_sight[pair][index],
            sound=sound,
        )

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
