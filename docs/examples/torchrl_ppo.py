"""TorchRL PPO: `python torchrl_ppo.py STEPS split=mini`, then `policy=torchrl_ppo:Policy`."""

import sys

import torch
from tensordict import TensorDict
from tensordict.nn import TensorDictModule, TensorDictSequential
from torch import nn
from torch.distributions import Categorical
from torchrl.collectors import Collector
from torchrl.envs.utils import ExplorationType, set_exploration_type
from torchrl.modules import ProbabilisticActor, ValueOperator
from torchrl.objectives import ClipPPOLoss
from torchrl.objectives.value import GAE

import avn

NAMES = ("visual_embedding", "audio_embedding")


class Trunk(nn.Module):
    """Concatenates the embeddings."""

    def __init__(self, outputs: int):
        super().__init__()
        self.net = nn.Sequential(nn.LazyLinear(128), nn.Tanh(), nn.Linear(128, outputs))

    def forward(self, *embeddings):
        return self.net(torch.cat(embeddings, -1))


def make_actor():
    logits = TensorDictModule(Trunk(4), in_keys=[*NAMES], out_keys=["logits"])
    return ProbabilisticActor(
        logits, in_keys=["logits"], distribution_class=Categorical, return_log_prob=True
    )


class Policy:
    def __init__(self, weights: str = "torchrl_ppo.pt"):
        self.actor, self.weights = make_actor(), torch.load(weights, weights_only=True)
        self.is_loaded = False

    def __call__(self, observations):
        shown = {name: torch.from_numpy(observations[name]) for name in NAMES}
        seen = TensorDict(shown, batch_size=[len(shown[NAMES[0]])])
        if not self.is_loaded:  # the first call creates the lazy layer
            self.actor(seen.clone())
            self.actor.load_state_dict(self.weights)
            self.is_loaded = True
        with torch.no_grad(), set_exploration_type(ExplorationType.RANDOM):
            return self.actor(seen)["action"]


def train(steps: int, overrides: list[str]):
    torch.manual_seed(0)
    env = avn.make_env(overrides, num_envs=32, observations=NAMES)
    env.set_seed(0)
    actor, critic = make_actor(), ValueOperator(Trunk(1), in_keys=[*NAMES])
    TensorDictSequential(actor, critic)(env.reset())  # creates the lazy layers
    loss = ClipPPOLoss(actor, critic, entropy_coeff=0.01)
    gae = GAE(gamma=0.99, lmbda=0.95, value_network=critic)
    optimizer = torch.optim.Adam(loss.parameters(), lr=1e-3)
    for batch in Collector(env, actor, frames_per_batch=32 * 32, total_frames=steps):
        for _ in range(4):
            gae(batch)
            flat = batch.reshape(-1)
            for rows in torch.randperm(len(flat)).split(256):
                terms = loss(flat[rows])
                total = sum(value for key, value in terms.items() if key.startswith("loss_"))
                optimizer.zero_grad()
                total.backward()
                nn.utils.clip_grad_norm_(loss.parameters(), 0.5)
                optimizer.step()
    torch.save(actor.state_dict(), "torchrl_ppo.pt")


if __name__ == "__main__":
    train(int(sys.argv[1]), sys.argv[2:])
