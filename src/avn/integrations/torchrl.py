"""Environment for TorchRL in the apartments of a config."""

from __future__ import annotations

from collections.abc import Sequence

import torch
from torchrl.envs import DeviceCastTransform, EnvBase, TransformedEnv

from avn.core.errors import UserError
from avn.integrations.world import OF_ALGORITHM, MaxSteps, open_world


def make_env(
    overrides: Sequence[str] = (),
    num_envs: int = 1,
    part: str = "train",
    observations: Sequence[str] | None = None,
    device: torch.device | str | None = None,
    max_steps: MaxSteps = OF_ALGORITHM,
) -> EnvBase:
    """Make an environment of TorchRL with N agents in one batch.

    Its observations have the names, shapes and ranges of those for Gymnasium; see
    `avn.integrations.gymnasium`. In addition there are `is_init` and `success`, (N, 1) bool, and
    under `info` the metrics `success`, `spl`, `distance_to_goal` and `collisions`, (N, 1). The
    episodes differ from those of any other environment unless `set_seed` is called.

    Parameters
    ----------
    overrides : sequence of str
        Settings of `avn.eval agent=external`, such as `split=mini`. A row of the table,
        `agent=a3c_va` or `model=a3c_va`, selects the observations of its agent.
    num_envs : int
        N, number of agents, the batch size of the environment.
    part : {"train", "validation", "test"}
        Part of the split. "train" and "validation" draw episodes in the apartments of the training
        world. "test" plays the episodes of `avn.eval` in their order, and then again.
    observations : sequence of str, optional
        Names of the observations.
    device : torch.device or str, optional
        Device of the tensors that the environment returns; the CPU by default, where it runs.
    max_steps : int, "algorithm" or None
        Actions after which an episode is truncated: a number, that of `algorithm.max_steps`, or the
        limits of the protocol alone.

    Returns
    -------
    EnvBase
        Of batch size (N,).

    Raises
    ------
    UserError
        If a setting is not valid, or the environment does not read it.
    """
    if isinstance(num_envs, bool) or not isinstance(num_envs, int) or num_envs < 1:
        raise UserError(f"num_envs: {num_envs!r}; give 1 or more")
    try:
        place = torch.device("cpu" if device is None else device)
        torch.empty(0, device=place)
    except (RuntimeError, AssertionError) as error:
        line = str(error).splitlines()[0]
        raise UserError(f"device: {device!r} cannot be used ({line}); give cpu or cuda") from None
    env = open_world(overrides, part, observations, max_steps).environment(num_envs, max_steps)
    return env if place.type == "cpu" else TransformedEnv(env, DeviceCastTransform(place))
