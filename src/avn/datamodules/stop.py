"""Audio clips for the stop classifier, with the distance to the goal as target."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor
from torch.utils.data import Sampler

from avn.acoustics.clips import DrySounds
from avn.acoustics.microphone import Microphone
from avn.core.errors import UserError
from avn.datamodules.clip_set import ClipSet
from avn.datamodules.sound import SoundData
from avn.dataset.scene import AudibleScene, Scene

# Function from a scene to the cells at which each source counts as reached, (K, C) bool.
GoalCells = Callable[[Scene], NDArray[np.bool_]]


def moves_to_goal(scene: Scene, goal: NDArray[np.bool_]) -> Tensor:
    """Compute the length of the shortest path to the goal in moves, by source and state.

    Parameters
    ----------
    scene : Scene
        Apartment with K sources and C cells.
    goal : (K, C) bool
        Cells at which each source counts as reached.

    Returns
    -------
    (K, 4 C) float32 tensor
        0 at the goal.
    """
    away = np.where(goal[:, None], scene.grid.distances[None], np.iinfo(np.int16).max)
    moves = torch.from_numpy(away.min(axis=2).astype(np.float32))
    return moves.repeat_interleave(4, dim=1)


class StopData(SoundData):
    """Training and validation data of the stop classifier; the target is `moves_to_goal`.

    Parameters
    ----------
    train, validation, sounds, microphone
        As in `SoundData`.
    recipe : Any
        As in `SoundData`; `positives` is the share of training clips at the goal.
    goal : callable
        Function from a scene to its goal cells, (K, C) bool.

    Raises
    ------
    UserError
        As `SoundData`, or if all training pairs are at the goal, or none.
    """

    node = "stop_model"
    what = "stop classifier"

    def __init__(
        self,
        train: Sequence[AudibleScene],
        validation: Sequence[AudibleScene],
        sounds: DrySounds,
        microphone: Microphone,
        recipe: Any,
        goal: GoalCells,
    ) -> None:
        self.goal = goal
        super().__init__(train, validation, sounds, microphone, recipe)
        self.positives = recipe.positives
        if not 0 < float(self.train_clips.target.eq(0).float().mean()) < 1:
            raise UserError(
                "protocol.radius: every cell of the training apartments is at the goal, or none "
                "is; give a radius between"
            )

    @property
    def prior(self) -> float:
        """Share of the training pairs of source and state that are at the goal."""
        return float(self.train_clips.target.eq(0).double().mean())

    def target_of(self, scene: Scene) -> Tensor:
        """Return the moves to the goal of each source from each state, (K, S)."""
        return moves_to_goal(scene, self.goal(scene))

    def train_sampler(self) -> Sampler[int]:
        """Build the sampler of epochs with the share `positives` of clips at the goal."""
        return GoalBalancedSampler(
            self.train_clips, self.recipe.train_seed, self.recipe.sounds_per_pair, self.positives
        )


class GoalBalancedSampler(Sampler[int]):
    """Sampler of a training epoch with a given share of clips at the goal, in a random order.

    An epoch has as many clips as there are pairs, times `sounds_per_pair`. Pairs at the goal are
    repeated, each time with a new realisation and a random sound; some of the other pairs may be
    left out. All draws depend on the seed and the epoch alone.

    Parameters
    ----------
    clips : ClipSet
        Training clips, with target 0 at the goal.
    seed : int
        Seed of the draws.
    sounds_per_pair : int
        Ratio of clips in an epoch to pairs.
    positives : float
        Share of clips at the goal.
    """

    def __init__(self, clips: ClipSet, seed: int, sounds_per_pair: int, positives: float) -> None:
        self.clips, self.seed, self.epoch = clips, seed, 0
        at_goal = clips.target == 0
        self.at_goal, self.elsewhere = at_goal.nonzero()[:, 0], (~at_goal).nonzero()[:, 0]
        self.count = clips.pairs * sounds_per_pair
        self.positives = round(positives * self.count)
        groups = (self.positives, self.at_goal), (self.count - self.positives, self.elsewhere)
        # Largest number of realisations of a pair in one epoch.
        self.realisations = max(-(-count // len(pairs)) for count, pairs in groups)

    def set_epoch(self, epoch: int) -> None:
        """Set the epoch; the trainer calls this before each epoch."""
        self.epoch = epoch

    def __len__(self) -> int:
        """Return the number of items of an epoch."""
        return self.count

    def __iter__(self) -> Iterator[int]:
        """Yield the items of the epoch."""
        generator = torch.Generator().manual_seed(self.seed * 1_000_003 + self.epoch)
        items = torch.cat(
            [
                self._drawn(self.at_goal, self.positives, generator),
                self._drawn(self.elsewhere, self.count - self.positives, generator),
            ]
        )
        yield from items[torch.randperm(len(items), generator=generator)].tolist()

    def _drawn(self, pairs: Tensor, count: int, generator: torch.Generator) -> Tensor:
        """Draw `count` items of some pairs: each pair once before any is repeated."""
        rounds = torch.arange(count) // len(pairs)
        order = torch.randperm(len(pairs), generator=generator)
        pair = pairs[order[torch.arange(count) % len(pairs)]]
        names = len(self.clips.sounds.names)
        sound = torch.randint(names, (count,), generator=generator)
        realisation = self.epoch * self.realisations + rounds
        return (realisation * self.clips.pairs + pair) * names + sound
