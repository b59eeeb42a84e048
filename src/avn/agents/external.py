"""Agent that acts with a policy of the user: any callable from observations to actions."""

from __future__ import annotations

import functools
import importlib
import inspect
import random
import sys
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from avn.agents.base import Agent
from avn.core.actions import action_error
from avn.core.errors import UserError
from avn.mapping.ego_map import WIDTH, EgoMap
from avn.navigation.protocols import Protocol

if TYPE_CHECKING:
    from tensordict import TensorDict

Observations = dict[str, NDArray[Any]]


class External(Agent):
    """Agent that asks a policy of the user for the actions of all episodes.

    The policy is called with a dict of numpy arrays, one row for each of N episodes, and returns N
    integers. Names, shapes, types and ranges are those of the vector environment of Gymnasium; see
    `avn.integrations.gymnasium`. Rows of finished episodes are passed too; their actions have no
    effect.

    Parameters
    ----------
    policy : str or None
        Policy as `module:name`: a function of the observations, or a class, an object of which is
        called. If the object has a method `reset(n)`, it is called before the first action of each
        apartment's N episodes.
    observations : list of str
        Names of the observations, as those of `avn.make_env`.
    settings : dict
        Arguments by name, for the constructor of a class, or for each call of a function. If the
        value or default of an argument is the path of a file, its content is part of the run.
    map_width : int
        Squares along each side of the observation `map`, odd.
    map_size : int
        Squares along each side of the map, odd.

    Raises
    ------
    UserError
        If there is no such policy, or it does not take the settings.
    """

    def __init__(
        self,
        policy: str | None = None,
        observations: Sequence[str] = ("visual_embedding", "audio_embedding"),
        settings: dict[str, Any] | None = None,
        map_width: int = WIDTH,
        map_size: int = 101,
    ) -> None:
        self.policy, self.observations = policy or "", tuple(observations)
        self.settings = dict(settings or {})
        self.map_width, self.map_size = map_width, map_size
        self._choose: Callable[[Observations], Any] | None = None
        self._map: EgoMap | None = None

    def wants(self, protocol: Protocol) -> tuple[str, ...]:
        """Return the names of the observations; those of a map for `map`. See `Agent.wants`."""
        mapped = ("local_patch", "odometry", "collided") if "map" in self.observations else ()
        named = [name for name in self.observations if name != "map"]
        return tuple(dict.fromkeys((*named, *mapped)))

    def unused_settings(self, protocol: Protocol) -> tuple[str, ...]:
        """Return `map_width` without a map. See `Agent.unused_settings`."""
        return () if "map" in self.observations else ("map_width",)

    def reset(self, n: int, generator: torch.Generator, protocol: Protocol) -> None:
        """Begin N new episodes, and seed the global generators. See `Agent.reset`."""
        super().reset(n, generator, protocol)
        if self._choose is None:
            self._choose = build_policy(self.policy, self.settings)
        self._map = EgoMap(n, self.map_size, self.map_width) if "map" in self.observations else None
        self._actions: Tensor | None = None
        seed = int(torch.randint(2**31, (), generator=generator))
        # policies of other libraries draw from these
        torch.manual_seed(seed)
        np.random.seed(seed)  # noqa: NPY002
        random.seed(seed)
        if callable(begin := getattr(self._choose, "reset", None)):
            begin(n)

    def act(self, observation: TensorDict) -> Tensor:
        """Ask the policy for the actions. See `Agent.act`."""
        from avn.rl.observation_specs import to_spec

        assert self._choose is not None
        seen = {name: observation[name] for name in self.observations if name != "map"}
        if self._map is not None:
            seen["map"] = self._map.observe(observation, self._actions)[:, None]
        arrays = {name: to_spec(name, seen[name]).numpy() for name in self.observations}
        self._actions = self._checked(self._choose(arrays))
        return self._actions

    def _checked(self, actions: Any) -> Tensor:
        """Return the actions of the policy as an (N,) int64 tensor."""
        found = actions.detach().cpu() if isinstance(actions, Tensor) else actions
        try:
            array = np.asarray(found)
        except ValueError:
            array = np.asarray(None)
        if array.dtype.kind not in "iu" or array.shape != (self.n,):
            raise UserError(
                f"policy {self.policy}: returned {_described(actions, array)}; wanted {self.n} "
                f"integers, one for each row, from 0 to {self.protocol.actions - 1}"
            )
        checked = torch.from_numpy(array.astype(np.int64))
        protocol = self.protocol
        if error := action_error(checked, self.n, protocol.actions, protocol.name):
            raise UserError(f"policy {self.policy}: {error}")
        return checked


def _described(actions: Any, array: NDArray[Any]) -> str:
    if array.dtype.kind == "O" or isinstance(actions, tuple | dict):
        return f"a {type(actions).__name__}"
    return f"{array.dtype} values of shape {array.shape}"


def find_policy(policy: str) -> Any:
    """Import the policy of a name `module:name`; modules of the working directory are found too.

    Raises
    ------
    UserError
        If there is none.
    """
    module, _, name = policy.partition(":")
    if not module or not name:
        raise UserError(f"policy: '{policy}'; give module:name, such as policy=my_module:act")
    here = str(Path.cwd())
    if here not in sys.path:
        sys.path.append(here)
    try:
        found: Any = importlib.import_module(module)
        for part in name.split("."):
            found = getattr(found, part)
    except (ImportError, AttributeError) as error:
        raise UserError(
            f"policy: '{policy}' cannot be imported ({error}); is its folder on PYTHONPATH?"
        ) from error
    if not callable(found):
        raise UserError(f"policy: '{policy}' is a {type(found).__name__}, which cannot be called")
    return found


def build_policy(policy: str, settings: Mapping[str, Any]) -> Callable[[Observations], Any]:
    """Build the function from observations to actions of a policy and its settings.

    Parameters
    ----------
    policy : str
        See `External`.
    settings : mapping
        Arguments of the class or the function.

    Raises
    ------
    UserError
        If there is no such policy, or it does not take the settings.
    """
    found = find_policy(policy)
    check_settings(policy, found, settings)
    if not isinstance(found, type):
        return functools.partial(found, **settings) if settings else found
    made: Any = found(**settings)
    if not callable(made):
        raise UserError(f"policy: objects of class {policy} cannot be called; define __call__")
    return made  # type: ignore[no-any-return]


def check_settings(policy: str, found: Any, settings: Mapping[str, Any]) -> None:
    """Check that a policy takes its settings.

    Parameters
    ----------
    policy : str
        See `External`.
    found : callable
        The class or the function.
    settings : mapping
        Arguments of the class or the function.

    Raises
    ------
    UserError
        If it does not.
    """
    try:
        signature = inspect.signature(found)
    except (TypeError, ValueError):  # of callables in C
        return
    observations: tuple[Any, ...] = () if isinstance(found, type) else ({},)
    try:
        signature.bind(*observations, **settings)
    except TypeError as error:
        raise UserError(
            f"baseline.settings: {error}; the policy {policy} takes {signature}"
        ) from error


def policy_files(policy: str, settings: Mapping[str, Any]) -> dict[str, Path]:
    """Return the files that the arguments of a policy name, given or by default.

    Parameters
    ----------
    policy : str
        See `External`.
    settings : mapping
        Arguments of the class or the function.

    Returns
    -------
    dict of str to Path
        Files by the name of the argument.
    """
    found = find_policy(policy)
    values = dict(settings)
    try:
        for name, each in inspect.signature(found).parameters.items():
            if each.default is not each.empty:
                values.setdefault(name, each.default)
    except (TypeError, ValueError):
        pass
    paths = {name: Path(own) for name, own in values.items() if isinstance(own, str | Path)}
    return {name: path for name, path in paths.items() if str(path) and path.is_file()}
