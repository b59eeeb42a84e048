"""Simulators of a single episode, and parts of batches of episodes."""

import dataclasses

from avn.navigation.episodes import Episodes, exhaustive_episodes
from avn.navigation.navigation_scene import DrawnScene
from avn.navigation.protocols import Protocol
from avn.navigation.simulator import Simulator


def pick(episodes: Episodes, which: object) -> Episodes:
    arrays = {name: getattr(episodes, name)[which] for name in ("number", "sound", "source")}
    return dataclasses.replace(episodes, start=episodes.start[which], **arrays)


def one(scene: DrawnScene, protocol: Protocol, cell: int, heading: int) -> Simulator:
    """A simulator of one episode that begins at a cell and heading."""
    every = exhaustive_episodes(scene, ["ring"], protocol, seed=0)
    return Simulator(
        scene, pick(every, (every.start == 4 * cell + heading).nonzero()[0][:1]), protocol
    )
