"""Environment and training steps a second, against Stable-Baselines3's A2C on the same world.

The world is a hand-drawn flat with features of the real sizes. The network of both is the one of
this package, with the same first weights; rewards, steps a batch, N of a process, loss, optimiser
and learning rate are the same. Both have two cores: ours trains with two workers that gather N
episodes each and apply their gradients as they finish (`update_order=free`), the peer, which has no
workers, with its best of one and two threads. So the ratio of their rates is that of two ways to
use two cores. Then the return of both after the same steps, over three seeds.

    python benchmarks/reinforcement.py [steps of a training, default 200000]
"""

from __future__ import annotations

import resource
import sys
import tempfile
import time
from pathlib import Path

import gymnasium
import numpy as np
import torch
from stable_baselines3 import A2C
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.vec_env import VecEnv

from avn.apartments.local_patch import window_cells
from avn.dataset.source_locations import relative_locations
from avn.navigation.batched_episodes import BatchedEpisodes
from avn.navigation.navigation_scene import draw
from avn.navigation.observations import SceneObservations
from avn.navigation.protocols import Protocol
from avn.navigation.scene_batch import SceneBatch, build_scene_batch
from avn.navigation.start_sampler import build_start_sampler
from avn.rl.a3c import A3C
from avn.rl.environment import NavigationEnv
from avn.rl.exploration_memory import draw_trajectories
from avn.rl.networks import ActorCritic, NetworkSpec
from avn.rl.observation_specs import SPECS
from avn.rl.training import Training
from avn.rl.worker import TrainingSpec

VAR = Protocol("var", "box", False, "moves", max_moves_ratio=2.0)
FLAT = """
aaaaaaaa#bbbbbbbb
aaAa##aa#bbbb##bb
aaaa##aa#bbbbbbbb
aaaaaaaaabbb#bbBb
aa##aaaa#bbb#bbbb
aa##aaaa#bbbbbbbb
####a#######b####
ccccccccc#ddddddd
ccCcccccc#dd##ddd
ccc###ccc#ddddDdd
cccccccccccdddddd
cc##ccccC#ddddddd
"""
WIDTH, N, STEPS = 128, 64, 20
RECIPE = {
    "entropy_coef": 0.01,
    "update_order": "free",
    "num_envs": N,
    "rollout_length": STEPS,
    "lr": 7e-4,
    "eps": 1e-5,
    "schedule": "constant",
}
ROWS = {
    "a3c_v": ("visual_embedding",),
    "a3c_va": ("visual_embedding", "audio_embedding"),
    "a3c_va_mapper": ("visual_embedding", "audio_embedding", "map"),
    "a3c_va_m": ("visual_embedding", "audio_embedding", "memory"),
    "a3c_va_m_mapper": ("visual_embedding", "audio_embedding", "map", "memory"),
}


def world_tables() -> tuple[list, SceneBatch]:
    """Build two copies of the flat, with random pictures and sound that encodes the location."""
    scenes = [draw("one", FLAT), draw("two", FLAT)]
    generator = torch.Generator().manual_seed(0)
    observed = []
    project = torch.randn(2, 258, generator=generator)
    for scene in scenes:
        lattice = torch.from_numpy(scene.grid.lattice).long()
        where = relative_locations(lattice, torch.from_numpy(np.asarray(scene.sources)).long())
        clips = where[:, :, None, None].expand(-1, -1, 3, 4, -1) @ project
        heard = clips + torch.randn(clips.shape, generator=generator)
        pictures = torch.randn(4 * len(lattice), 1280, generator=generator)
        windows = torch.from_numpy(window_cells(scene.grid) >= 0).float()
        visual = {
            "visual_embedding": torch.nn.functional.normalize(pictures),
            "local_patch": windows,
        }
        observed.append(SceneObservations({"audio_embedding": heard.half()}, visual))
    return scenes, build_scene_batch(scenes, VAR, observed)


def spec_of(row: str, scenes: list, tables: SceneBatch, **recipe) -> TrainingSpec:
    """Build the specification of the training of a row of the table."""
    names = ROWS[row]
    both = {**tables.visual, **tables.audio}
    features = {name: both[name].shape[-1] for name in names if name in both}
    memory, maps = 128 * ("memory" in names), "map" in names
    shape = NetworkSpec(features, VAR.actions, WIDTH, memory, maps * (2 if memory else 1))
    network = ActorCritic(shape)
    for name in features:
        network.standardise(name, both[name][::7])
    trajectories = draw_trajectories(scenes, tables, 32, 400, 0) if memory else None
    given = A3C(**(RECIPE | recipe))
    return TrainingSpec(
        tables, VAR, shape, given, dict(network.named_buffers()), trajectories=trajectories
    )


class Ours:
    """A training of this package: steps per second, and the return of its last rounds."""

    def __init__(self, spec: TrainingSpec, steps: int) -> None:
        torch.manual_seed(spec.recipe.train_seed)
        network = ActorCritic(spec.network_spec)
        network.load_state_dict(spec.buffers, strict=False)
        with tempfile.TemporaryDirectory() as folder:
            measure = {"validation/spl": 0.0}
            curve = Training(spec, network, Path(folder), lambda _: measure, "b" * 64).run()
        rounds = curve[1:]
        self.rate = float(np.mean([own["steps_per_second"] for own in rounds[-2:]]))
        self.earned = rounds[-1].get("return", float("nan"))  # no episode may have ended
        self.steps = steps


class PeerEnv(VecEnv):
    """The same world for Stable-Baselines3: features gathered for all episodes at once."""

    def __init__(
        self, tables: SceneBatch, names: tuple[str, ...], seed: int, max_steps: int
    ) -> None:
        world = BatchedEpisodes(tables, build_start_sampler(tables), N, VAR, max_steps, seed=seed)
        self.env = NavigationEnv(world, names)
        boxes = {
            name: gymnasium.spaces.Box(SPECS[name].low, SPECS[name].high, value.shape[1:])
            for name, value in self._seen().items()
        }
        space = gymnasium.spaces.Dict(boxes)
        super().__init__(N, space, gymnasium.spaces.Discrete(VAR.actions))

    def _seen(self) -> dict[str, np.ndarray]:
        seen = self.env.observation()
        found = self.env.features(seen["state"], seen["clip"])
        return {name: value.float().numpy() for name, value in found.items()}

    def reset(self):
        """See `VecEnv.reset`."""
        self.env.begin(torch.ones(N, dtype=torch.bool))
        return self._seen()

    def step_async(self, actions):
        """See `VecEnv.step_async`."""
        self._actions = torch.from_numpy(actions)

    def step_wait(self):
        """See `VecEnv.step_wait`."""
        reward, terminated, truncated = self.env.move(self._actions)
        done, infos = (terminated | truncated).numpy(), [{} for _ in range(N)]
        if done.any():
            last = self._seen()
            for row in np.flatnonzero(done):
                infos[row]["TimeLimit.truncated"] = bool(truncated[row])
                infos[row]["terminal_observation"] = {k: v[row] for k, v in last.items()}
            self.env.begin(torch.from_numpy(done))
        return self._seen(), reward.numpy(), done, infos

    def close(self):
        """See `VecEnv.close`."""

    def get_attr(self, name, indices=None):
        """See `VecEnv.get_attr`."""
        return [None] * N

    def set_attr(self, name, value, indices=None):
        """See `VecEnv.set_attr`."""

    def env_method(self, name, *args, indices=None, **kwargs):
        """See `VecEnv.env_method`."""
        return [None] * N

    def env_is_wrapped(self, wrapper, indices=None):
        """See `VecEnv.env_is_wrapped`."""
        return [False] * N


class Trunk(BaseFeaturesExtractor):
    """The trunk of this package's network as the features of Stable-Baselines3's policy."""

    def __init__(self, space: gymnasium.spaces.Dict, network: ActorCritic) -> None:
        super().__init__(space, WIDTH)
        self.network = network

    def forward(self, observations: dict[str, torch.Tensor]) -> torch.Tensor:
        """Return the output of the trunk, (N, WIDTH)."""
        return self.network.embed(observations)


class Returns(BaseCallback):
    """Callback that measures the mean return of late episodes and the rate of the second half."""

    def __init__(self, steps: int) -> None:
        super().__init__()
        self.running, self.ended, self.marks = np.zeros(N), [], []
        self.steps = steps

    def _on_step(self) -> bool:
        self.running += self.locals["rewards"]
        done = self.locals["dones"]
        self.ended += [(self.num_timesteps, own) for own in self.running[done]]
        self.running[done] = 0.0
        self.marks.append((self.num_timesteps, time.perf_counter()))
        return True

    def rate(self) -> float:
        """Return the steps per second of the second half."""
        (a, t), (b, u) = self.marks[len(self.marks) // 2], self.marks[-1]
        return (b - a) / (u - t)

    def earned(self, last: int) -> float:
        """Return the mean return of the episodes that ended in the last `last` steps."""
        end = self.marks[-1][0]
        return float(np.mean([own for at, own in self.ended if at > end - last]))


def peer(
    spec: TrainingSpec, names: tuple[str, ...], steps: int, seed: int, threads: int
) -> tuple[float, float]:
    """Measure steps per second and final return of Stable-Baselines3's A2C."""
    torch.set_num_threads(threads)
    torch.manual_seed(seed)
    network = ActorCritic(spec.network_spec)
    network.load_state_dict(spec.buffers, strict=False)
    recipe = spec.recipe
    model = A2C(
        "MultiInputPolicy",
        PeerEnv(spec.tables, names, seed, recipe.max_steps),
        n_steps=recipe.rollout_length,
        learning_rate=recipe.lr,
        gamma=recipe.gamma,
        gae_lambda=recipe.gae_lambda,
        rms_prop_eps=recipe.eps,
        ent_coef=recipe.entropy_coef,
        vf_coef=recipe.value_coef,
        max_grad_norm=recipe.max_grad_norm,
        policy_kwargs={
            "net_arch": [],  # the heads are linear layers of the features
            "features_extractor_class": Trunk,
            "features_extractor_kwargs": {"network": network},
            "ortho_init": False,
        },
        seed=seed,
        device="cpu",
    )
    for head, own in ((model.policy.action_net, "actor"), (model.policy.value_net, "critic")):
        head.load_state_dict(getattr(network, own).state_dict())
    watch = Returns(steps)
    model.learn(steps, callback=watch)
    torch.set_num_threads(1)
    return watch.rate(), watch.earned(steps // 10)


def environment(tables: SceneBatch) -> None:
    """Measure steps per second of the environment alone, with features gathered."""
    for n in (64, 256, 1024):
        env = NavigationEnv(
            BatchedEpisodes(tables, build_start_sampler(tables), n, VAR, 200), ROWS["a3c_va"]
        )
        actions = torch.randint(4, (200, n))
        began = time.perf_counter()
        for own in actions:
            _, terminated, truncated = env.move(own)
            seen = env.observation()
            env.features(seen["state"], seen["clip"])
            done = terminated | truncated
            if bool(done.any()):
                env.begin(done)
        rate = 200 * n / (time.perf_counter() - began)
        print(f"environment, features gathered, one thread, N={n}: {rate:,.0f} steps/s")


def main() -> None:
    """Measure and print."""
    steps = int(sys.argv[1]) if len(sys.argv) > 1 else 200_000
    torch.set_num_threads(1)
    scenes, tables = world_tables()
    environment(tables)
    each = max(1, steps // 10)
    for row in ROWS:
        spec = spec_of(row, scenes, tables, total_steps=steps, validate_every=each)
        print(f"{row}, two workers, N={N} each: {Ours(spec, steps).rate:,.0f} steps/s")
    ours, peers = [], []
    for seed in range(3):
        options = {"total_steps": steps, "validate_every": each, "train_seed": seed}
        spec = spec_of("a3c_va", scenes, tables, **options)
        ours.append(Ours(spec, steps))
        peers += [
            (threads, *peer(spec, ROWS["a3c_va"], steps, seed, threads)) for threads in (1, 2)
        ]
    fastest = max(rate for _, rate, _ in peers)
    rate = max(own.rate for own in ours)
    print(
        f"Stable-Baselines3 A2C, the same network, N={N}, best of 1 and 2 threads: "
        f"{fastest:,.0f} steps/s"
    )
    print(f"ours with two workers, N={N} each: {rate:,.0f} steps/s, {rate / fastest:.2f} times")
    earned = [own.earned for own in ours], [value for _, _, value in peers]
    for name, values in zip(("ours", "Stable-Baselines3"), earned, strict=True):
        print(
            f"return after {steps:,} steps, {name}: {np.mean(values):.2f} +- {np.std(values):.2f}"
        )
    peak = max(
        resource.getrusage(processes).ru_maxrss
        for processes in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    )
    print(f"peak memory of a process: {peak / 1024:.0f} MB")


if __name__ == "__main__":
    main()
