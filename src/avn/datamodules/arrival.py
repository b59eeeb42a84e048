"""Audio clips with the arrival of their sound as targets."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from torch import Tensor

from avn.acoustics.settings import AcousticsConfig
from avn.datamodules.second_sources import SecondSources
from avn.datamodules.sound import SoundData
from avn.dataset.arrivals import arrivals
from avn.dataset.scene import Scene


class ArrivalData(SoundData):
    """Training and validation data of a sound network with heads.

    Parameters
    ----------
    acoustics : AcousticsConfig
        Acoustics of the apartments.
    categories : sequence of str
        Category of each sound.
    **data
        Those of `SoundData`; of the recipe of a `ToldArrivalCnn`, `mixtures` and `categories` are
        used too.
    """

    def __init__(
        self, acoustics: AcousticsConfig, categories: Sequence[str] = (), **data: Any
    ) -> None:
        self.acoustics, self.categories = acoustics, categories
        super().__init__(**data)

    def second_sources(self) -> SecondSources | None:
        """Return the second sources of the training clips, of networks that can be told."""
        recipe = self.recipe
        if not hasattr(recipe, "mixtures"):
            return None
        told = recipe.mixtures, recipe.categories, self.categories
        return SecondSources(*told, "train", recipe.train_seed, self.spectrogram)

    def target_of(self, scene: Scene) -> Tensor:
        """Return the targets of an apartment, (K, S, 5). See `avn.dataset.arrivals.arrivals`."""
        return arrivals(scene, self.acoustics)
