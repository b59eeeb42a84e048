"""Lookup of the features that environments and batches refer to by number."""

from __future__ import annotations

from collections.abc import Sequence

from torch import Tensor, nn

from avn.navigation.scene_batch import SceneBatch


class FeatureModule(nn.Module):
    """Lookup of visual and audio features by the numbers of states and clips.

    Environments and batches hold the numbers; the features are looked up next to the policy.

    Parameters
    ----------
    tables : SceneBatch
        Holds the features.
    names : sequence of str
        Names in `tables.visual` and `tables.audio`; other names are ignored.

    Attributes
    ----------
    visual, audio : list of str
        Names of the features of states and of clips.
    """

    def __init__(self, tables: SceneBatch, names: Sequence[str]) -> None:
        super().__init__()
        self.visual = [name for name in names if name in tables.visual]
        self.audio = [name for name in names if name in tables.audio]
        for name in (*self.visual, *self.audio):
            table = tables.visual.get(name, tables.audio.get(name))
            self.register_buffer(name, table, persistent=False)

    def forward(self, state: Tensor, clip: Tensor) -> dict[str, Tensor]:
        """Look up features by name.

        Parameters
        ----------
        state, clip : (...,) int64 tensors
            Numbers of states and clips.

        Returns
        -------
        dict of str to (..., D) tensor
        """
        found = {name: getattr(self, name)[state] for name in self.visual}
        return found | {name: getattr(self, name)[clip] for name in self.audio}
