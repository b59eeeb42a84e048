"""Audio clips with the arrival of their sound as targets."""

from __future__ import annotations

from typing import Any

from torch import Tensor

from avn.acoustics.settings import AcousticsConfig
from avn.datamodules.sound import SoundData
from avn.dataset.arrivals import arrivals
from avn.dataset.scene import Scene


class ArrivalData(SoundData):
    """Training and validation data of a sound network with heads.

    Parameters
    ----------
    acoustics : AcousticsConfig
        Acoustics of the apartments.
    **data
        Those of `SoundData`.
    """

    def __init__(self, acoustics: AcousticsConfig, **data: Any) -> None:
        self.acoustics = acoustics
        super().__init__(**data)

    def target_of(self, scene: Scene) -> Tensor:
        """Return the targets of an apartment, (K, S, 5). See `avn.dataset.arrivals.arrivals`."""
        return arrivals(scene, self.acoustics)
