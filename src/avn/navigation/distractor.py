"""Second source, of another category of sound, that sounds elsewhere in the apartment."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from torch import Tensor

from avn.core.errors import UserError
from avn.core.second_source import draw_second_source


class Distractor:
    """Second source at another source's place, with another sound of the test world.

    It sounds all the time and as loud as the goal. Place and sound are drawn for each episode;
    the category of the sound is another one than the goal's.

    Parameters
    ----------
    categories : mapping of str to str
        Category of each sound of the test world by name.
    told : bool
        Whether the agent is told the category of the goal's sound.
    """

    def __init__(self, categories: Mapping[str, str], told: bool = False) -> None:
        self.categories, self.told = dict(categories), told

    def check(self, sources: int, sounds: Sequence[str]) -> None:
        """Refuse an apartment without a place for a distractor, and sounds without another.

        Parameters
        ----------
        sources : int
            Number of sources of the apartment.
        sounds : sequence of str
            Names of the sounds.

        Raises
        ------
        UserError
            If the apartment has one source, or all sounds have one category.
        """
        if sources < 2:
            raise UserError(
                "distractor: an apartment has one source and no place for a second; give its floor "
                "plan two sources or more, or distractor=none"
            )
        if len({self.categories[name] for name in sounds}) < 2:
            raise UserError(
                "distractor: all sounds are of one category; give sounds of several, such as "
                "sound=unheard"
            )

    def draw(
        self,
        keys: NDArray[np.uint64],
        source: NDArray[np.int64],
        sound: NDArray[np.int64],
        sources: int,
        sounds: Sequence[str],
    ) -> tuple[Tensor, Tensor]:
        """Draw source and sound of the distractors of N episodes, (N,) int64 each.

        Parameters
        ----------
        keys : (N,) uint64
            Key of each episode's random numbers.
        source, sound : (N,) int64
            Source and sound of the goals.
        sources : int
            Number of sources of the apartment.
        sounds : sequence of str
            Names of the sounds.

        Raises
        ------
        UserError
            See `check`.
        """
        self.check(sources, sounds)
        categories = [self.categories[name] for name in sounds]
        return draw_second_source(keys, source, sound, sources, categories)
