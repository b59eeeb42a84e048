"""Actor-critic networks: one trunk, an LSTM where the agent remembers, two heads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torchrl.modules import LSTMModule

from avn.core.errors import UserError

# Length of a standardised feature: with it as long as it has parts, one step of the optimiser would
# turn the trunk over.
_LENGTH = 8.0
# Beliefs are 0.5 where nothing is known, which shall be no input at all.
_UNKNOWN = 0.5


@dataclass(frozen=True)
class NetworkSpec:
    """What an actor-critic is built for.

    Attributes
    ----------
    features : dict of str to int
        Sizes of the features by name, such as `visual_embedding` and `audio_embedding`.
    actions : int
    width : int
        Units of each layer of the trunk.
    memory : int
        Units of the LSTM; 0 for none.
    map_channels, map_width : int
        Of the map that it is shown; 0 channels for none.
    """

    features: dict[str, int]
    actions: int
    width: int = 128
    memory: int = 0
    map_channels: int = 0
    map_width: int = 21

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of all that it is shown."""
        return (*self.features, *(("map",) if self.map_channels else ()))


class ActorCritic(nn.Module):
    """Chooses actions and judges places from features, maps and memory.

    The features are standardised, concatenated and go through two layers; the map goes through one
    of its own and joins them. The heads see the trunk's output, and that of the LSTM beside it.
    """

    def __init__(self, shape: NetworkSpec) -> None:
        super().__init__()
        if not shape.inputs:
            raise UserError("baseline: an actor-critic needs something to see or hear")
        self.shape = shape
        # a layer for each feature, added up, is one layer for all of them behind each other
        self.encoders = nn.ModuleDict(
            {
                name: nn.Linear(size, shape.width, bias=False)
                for name, size in shape.features.items()
            }
        )
        for name, size in shape.features.items():
            self.register_buffer(f"{name}_mean", torch.zeros(size))
            self.register_buffer(f"{name}_scale", torch.ones(size))
        squares = shape.map_channels * shape.map_width**2
        self.map_encoder = nn.Linear(squares, shape.width, bias=False) if squares else None
        self.bias = nn.Parameter(torch.zeros(shape.width))
        self.second = nn.Linear(shape.width, shape.width)
        self.lstm: LSTMModule | None = None
        if shape.memory:
            self.lstm = LSTMModule(
                input_size=shape.width,
                hidden_size=shape.memory,
                in_keys=["embedding", "h", "c"],
                out_keys=["remembered", "h_next", "c_next"],
            )
        self.actor = nn.Linear(shape.width + shape.memory, shape.actions)
        self.critic = nn.Linear(shape.width + shape.memory, 1)
        self._draw_weights()

    def _draw_weights(self) -> None:
        for name, size in self.shape.features.items():
            gain = (2 * max(size, self.shape.width)) ** 0.5 / _LENGTH
            nn.init.orthogonal_(self.encoders[name].get_parameter("weight"), gain)
        nn.init.orthogonal_(self.second.weight, 2**0.5)
        if self.map_encoder is not None:
            nn.init.orthogonal_(self.map_encoder.weight)
        nn.init.orthogonal_(self.actor.weight, 0.01)
        nn.init.orthogonal_(self.critic.weight)
        for layer in (self.second, self.actor, self.critic):
            nn.init.zeros_(layer.bias)

    def standardise(self, name: str, examples: Tensor) -> None:
        """Take mean and spread of a feature from examples, (n, D)."""
        mean, spread = examples.float().mean(dim=0), examples.float().std(dim=0)
        getattr(self, f"{name}_mean").copy_(mean)
        scale = _LENGTH / (spread.clamp_min(1e-6) * len(mean) ** 0.5)
        getattr(self, f"{name}_scale").copy_(torch.where(spread > 1e-6, scale, 0.0))

    def embed(self, inputs: Mapping[str, Tensor]) -> Tensor:
        """What the trunk makes of N observations.

        Parameters
        ----------
        inputs : mapping of str to (N, D) tensor
            Features by name, and `map` (N, channels, width, width). A feature that is missing,
            such as sound while exploring, tells nothing.

        Returns
        -------
        (N, width) tensor
        """
        total = self.bias
        for name, encoder in self.encoders.items():
            if name in inputs:
                mean, scale = getattr(self, f"{name}_mean"), getattr(self, f"{name}_scale")
                total = total + encoder((inputs[name].to(mean.dtype) - mean) * scale)
        if self.map_encoder is not None:
            around = inputs["map"].to(self.bias.dtype).flatten(1) - _UNKNOWN
            total = total + self.map_encoder(around)
        return torch.relu(self.second(torch.relu(total)))

    def no_memory(self, n: int) -> tuple[Tensor, Tensor]:
        """The memory of N agents that remember nothing, (N, 1, units) each."""
        zeros = self.bias.new_zeros(n, 1, self.shape.memory)
        return zeros, zeros

    def remember(self, embedding: Tensor, h: Tensor, c: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """One step of the memory.

        Parameters
        ----------
        embedding : (N, width) tensor
        h, c : (N, 1, units) tensors

        Returns
        -------
        joint : (N, width + units) tensor
            What the heads see.
        h, c : (N, 1, units) tensors
        """
        if self.lstm is None:
            return embedding, h, c
        cell = self.lstm.lstm
        h, c = torch.lstm_cell(
            embedding,
            (h[:, 0], c[:, 0]),
            cell.weight_ih_l0,
            cell.weight_hh_l0,
            cell.bias_ih_l0,
            cell.bias_hh_l0,
        )
        return torch.cat((embedding, h), dim=1), h[:, None], c[:, None]

    def unroll(self, embedding: Tensor, h: Tensor, c: Tensor, first: Tensor) -> Tensor:
        """T steps of the memory with gradients through them.

        Parameters
        ----------
        embedding : (N, T, width) tensor
        h, c : (N, T, 1, units) tensors
            The memory before each step, of which that before the first step and those before the
            first step of an episode are used.
        first : (N, T) bool tensor
            Where an episode begins.

        Returns
        -------
        (N, T, width + units) tensor
        """
        if self.lstm is None:
            return embedding
        carried, joint = (h[:, 0], c[:, 0]), []
        for step in range(embedding.shape[1]):
            if step:
                begins = first[:, step, None, None]
                fresh = (h[:, step], c[:, step])
                carried = tuple(  # type: ignore[assignment]
                    torch.where(begins, new, old) for new, old in zip(fresh, carried, strict=True)
                )
            seen, *after = self.remember(embedding[:, step], *carried)
            carried = (after[0], after[1])
            joint.append(seen)
        return torch.stack(joint, dim=1)


def sample(logits: Tensor, generator: torch.Generator | None = None) -> Tensor:
    """Actions drawn with the softmax of (N, A) logits, (N,) int64."""
    return first_of(logits, torch.empty_like(logits).exponential_(generator=generator))


def first_of(logits: Tensor, race: Tensor) -> Tensor:
    """The action that wins a race, (N,) int64.

    Of independent arrivals at rates p the first is i with a chance of p_i.

    Parameters
    ----------
    logits, race : (N, A) tensors
        Of the softmax that is drawn from, and times of arrival at a rate of 1.
    """
    return (torch.softmax(logits, dim=-1) / race).argmax(dim=-1)
