"""Actor-critic networks: a shared trunk, an optional LSTM and two heads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import torch
from torch import Tensor, nn
from torchrl.modules import LSTMModule

from avn.core.errors import UserError

# Typical norm of a standardised feature. With unit variance in each of its dimensions, the norm
# would be so large that single optimiser steps destabilise the trunk.
_LENGTH = 8.0
# Probability of unknown squares, which is subtracted so that they contribute nothing.
_UNKNOWN = 0.5


@dataclass(frozen=True)
class NetworkSpec:
    """Sizes of the inputs and layers of an actor-critic.

    Attributes
    ----------
    features : dict of str to int
        Sizes of the features by name, such as `visual_embedding` and `audio_embedding`.
    actions : int
        Number of actions.
    width : int
        Units of each layer of the trunk.
    memory : int
        Units of the LSTM; 0 for none.
    map_channels, map_width : int
        Channels and squares along each side of the map; 0 channels for no map.
    """

    features: dict[str, int]
    actions: int
    width: int = 128
    memory: int = 0
    map_channels: int = 0
    map_width: int = 21

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of all inputs."""
        return (*self.features, *(("map",) if self.map_channels else ()))


class ActorCritic(nn.Module):
    """Policy and value function of features, maps and an LSTM state.

    The features are standardised, concatenated and go through two layers; a linear layer of the
    map is added to the first. The heads take the output of the trunk, concatenated with the output
    of the LSTM if there is one.

    Parameters
    ----------
    spec : NetworkSpec
        Sizes of inputs and layers.

    Raises
    ------
    UserError
        If the network has no input.
    """

    def __init__(self, spec: NetworkSpec) -> None:
        super().__init__()
        if not spec.inputs:
            raise UserError("baseline: an actor-critic needs something to see or hear")
        self.spec = spec
        # the sum of a layer for each feature is one layer of their concatenation
        self.encoders = nn.ModuleDict(
            {name: nn.Linear(size, spec.width, bias=False) for name, size in spec.features.items()}
        )
        for name, size in spec.features.items():
            self.register_buffer(f"{name}_mean", torch.zeros(size))
            self.register_buffer(f"{name}_scale", torch.ones(size))
        squares = spec.map_channels * spec.map_width**2
        self.map_encoder = nn.Linear(squares, spec.width, bias=False) if squares else None
        self.bias = nn.Parameter(torch.zeros(spec.width))
        self.second = nn.Linear(spec.width, spec.width)
        self.lstm: LSTMModule | None = None
        if spec.memory:
            self.lstm = LSTMModule(
                input_size=spec.width,
                hidden_size=spec.memory,
                in_keys=["embedding", "h", "c"],
                out_keys=["remembered", "h_next", "c_next"],
            )
        self.actor = nn.Linear(spec.width + spec.memory, spec.actions)
        self.critic = nn.Linear(spec.width + spec.memory, 1)
        self._draw_weights()

    def _draw_weights(self) -> None:
        for name, size in self.spec.features.items():
            gain = (2 * max(size, self.spec.width)) ** 0.5 / _LENGTH
            nn.init.orthogonal_(self.encoders[name].get_parameter("weight"), gain)
        nn.init.orthogonal_(self.second.weight, 2**0.5)
        if self.map_encoder is not None:
            nn.init.orthogonal_(self.map_encoder.weight)
        nn.init.orthogonal_(self.actor.weight, 0.01)
        nn.init.orthogonal_(self.critic.weight)
        for layer in (self.second, self.actor, self.critic):
            nn.init.zeros_(layer.bias)

    def standardise(self, name: str, examples: Tensor) -> None:
        """Set the mean and scale of a feature from examples, (n, ...)."""
        flat = examples.float().flatten(1)
        mean, spread = flat.mean(dim=0), flat.std(dim=0)
        getattr(self, f"{name}_mean").copy_(mean)
        scale = _LENGTH / (spread.clamp_min(1e-6) * len(mean) ** 0.5)
        getattr(self, f"{name}_scale").copy_(torch.where(spread > 1e-6, scale, 0.0))

    def embed(self, inputs: Mapping[str, Tensor]) -> Tensor:
        """Compute the output of the trunk for N observations.

        Parameters
        ----------
        inputs : mapping of str to (N, ...) tensor
            Features by name, which are flattened, and `map` (N, channels, width, width). Missing
            features, such as audio during exploration, contribute nothing.

        Returns
        -------
        (N, width) tensor
        """
        total = self.bias
        for name, encoder in self.encoders.items():
            if name in inputs:
                mean, scale = getattr(self, f"{name}_mean"), getattr(self, f"{name}_scale")
                flat = inputs[name].to(mean.dtype).flatten(1)
                total = total + encoder((flat - mean) * scale)
        if self.map_encoder is not None:
            around = inputs["map"].to(self.bias.dtype).flatten(1) - _UNKNOWN
            total = total + self.map_encoder(around)
        return torch.relu(self.second(torch.relu(total)))

    def no_memory(self, n: int) -> tuple[Tensor, Tensor]:
        """Return the initial LSTM state of N agents, zeros, h and c (N, 1, units)."""
        zeros = self.bias.new_zeros(n, 1, self.spec.memory)
        return zeros, zeros

    def remember(self, embedding: Tensor, h: Tensor, c: Tensor) -> tuple[Tensor, Tensor, Tensor]:
        """Run one step of the LSTM.

        Parameters
        ----------
        embedding : (N, width) tensor
            Output of the trunk.
        h, c : (N, 1, units) tensors
            LSTM state before the step.

        Returns
        -------
        joint : (N, width + units) tensor
            Input of the heads.
        h, c : (N, 1, units) tensors
            LSTM state after the step.
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
        """Run T steps of the LSTM with gradients through time.

        Parameters
        ----------
        embedding : (N, T, width) tensor
            Outputs of the trunk.
        h, c : (N, T, 1, units) tensors
            LSTM states before each step; those of the first step and of the first steps of
            episodes are used.
        first : (N, T) bool tensor
            True at the first step of an episode.

        Returns
        -------
        (N, T, width + units) tensor
            Inputs of the heads.
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
    """Sample actions, (N,) int64, from the softmax of logits (N, A)."""
    return first_of(logits, torch.empty_like(logits).exponential_(generator=generator))


def first_of(logits: Tensor, race: Tensor) -> Tensor:
    """Sample actions from given exponential draws.

    Of independent exponential times with rates p, the smallest is number i with probability p_i.

    Parameters
    ----------
    logits, race : (N, A) tensors
        Logits of the softmax, and exponential draws with rate 1.

    Returns
    -------
    (N,) int64 tensor
    """
    return (torch.softmax(logits, dim=-1) / race).argmax(dim=-1)
