"""PPO in one file, as CleanRL has it: `python cleanrl_ppo.py STEPS split=mini`, then
`policy=cleanrl_ppo:Policy`."""

import sys

import gymnasium
import numpy as np
import torch
from torch import nn
from torch.distributions import Categorical

import avn  # noqa: F401 - registers the environment

NUM_ENVS, NUM_STEPS, EPOCHS, MINIBATCH = 32, 32, 4, 256
GAMMA, LAMBDA, CLIP, ENTROPY, LR = 0.99, 0.95, 0.2, 0.01, 1e-3


class Agent(nn.Module):
    def __init__(self, features: int, actions: int):
        super().__init__()
        self.trunk = nn.Sequential(nn.Linear(features, 128), nn.Tanh())
        self.actor, self.critic = nn.Linear(128, actions), nn.Linear(128, 1)

    def forward(self, x):
        hidden = self.trunk(x)
        return Categorical(logits=self.actor(hidden)), self.critic(hidden)[:, 0]


def flat(observations):
    names = ("visual_embedding", "audio_embedding")
    return torch.from_numpy(np.concatenate([observations[name] for name in names], axis=1))


class Policy:
    def __init__(self, weights: str = "cleanrl_ppo.pt"):
        kept = torch.load(weights, weights_only=True)
        self.agent = Agent(kept["trunk.0.weight"].shape[1], len(kept["actor.bias"]))
        self.agent.load_state_dict(kept)

    @torch.no_grad()
    def __call__(self, observations):
        return self.agent(flat(observations))[0].sample()


def train(steps: int, overrides: list[str]):
    torch.manual_seed(0)
    envs = gymnasium.make_vec("avn/Walk-v0", num_envs=NUM_ENVS, overrides=overrides)
    x = flat(envs.reset(seed=0)[0])
    agent = Agent(x.shape[1], int(envs.single_action_space.n))
    optimizer = torch.optim.Adam(agent.parameters(), lr=LR)
    for _ in range(max(1, steps // (NUM_ENVS * NUM_STEPS))):
        rows = []
        for _ in range(NUM_STEPS):
            with torch.no_grad():
                policy, value = agent(x)
                action = policy.sample()
                seen, reward, terminated, truncated, infos = envs.step(action.numpy())
                reward = torch.from_numpy(reward).float()
                for row in np.flatnonzero(truncated):  # bootstrap what a limit cut off
                    final = infos["final_obs"][row]
                    last = flat({name: own[None] for name, own in final.items()})
                    reward[row] += GAMMA * agent(last)[1][0]
            done = torch.from_numpy(terminated | truncated).float()
            rows.append((x, action, policy.log_prob(action), value, reward, done))
            x = flat(seen)
        with torch.no_grad():
            following, advantage, advantages = agent(x)[1], torch.zeros(NUM_ENVS), []
            for _, _, _, value, reward, done in reversed(rows):
                delta = reward + GAMMA * following * (1 - done) - value
                advantage = delta + GAMMA * LAMBDA * (1 - done) * advantage
                advantages.append(advantage)
                following = value
        seen, action, log_prob, value = (torch.cat(own) for own in list(zip(*rows))[:4])  # noqa: B905
        gain = torch.cat(advantages[::-1])
        target = gain + value
        gain = (gain - gain.mean()) / (gain.std() + 1e-8)
        for _ in range(EPOCHS):
            for part in torch.randperm(len(seen)).split(MINIBATCH):
                policy, estimate = agent(seen[part])
                ratio = (policy.log_prob(action[part]) - log_prob[part]).exp()
                clipped = ratio.clamp(1 - CLIP, 1 + CLIP)
                loss = -torch.min(ratio * gain[part], clipped * gain[part]).mean()
                loss += 0.5 * (estimate - target[part]).square().mean()
                loss -= ENTROPY * policy.entropy().mean()
                optimizer.zero_grad()
                loss.backward()
                nn.utils.clip_grad_norm_(agent.parameters(), 0.5)
                optimizer.step()
    torch.save(agent.state_dict(), "cleanrl_ppo.pt")


if __name__ == "__main__":
    train(int(sys.argv[1]), sys.argv[2:])
