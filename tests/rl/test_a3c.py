import pytest
import torch
from small_worlds import make_spec, make_worker, random_tables
from torch.nn import functional as F

from avn.rl.a3c import ActorCriticLoss
from avn.rl.rollouts import advantages_and_targets, trunk_outputs


def batch_of(spec):
    worker = make_worker(spec)
    for _ in range(3):
        batch = worker.collector.collect()
    return worker, batch


def returns_by_hand(worker, batch, gamma):
    """n-step returns, one episode and step at a time."""
    network = worker.network
    after = batch["next"]
    features = worker.env.features(after["index", "state"], after["index", "clip"])
    found = torch.zeros(batch.batch_size)
    with torch.no_grad():
        for row in range(batch.batch_size[0]):
            for step in reversed(range(batch.batch_size[1])):
                reward = float(after["reward"][row, step])
                shown = {name: value[row, step][None] for name, value in features.items()}
                embedding = network.embed(shown)
                if network.lstm is not None:
                    memory = (batch[key][row, step][None] for key in ("h_next", "c_next"))
                    embedding, *_ = network.remember(embedding, *memory)
                last = step == batch.batch_size[1] - 1
                if after["terminated"][row, step]:
                    ahead = 0.0
                elif after["truncated"][row, step] or last:
                    ahead = float(network.critic(embedding))
                else:
                    ahead = float(found[row, step + 1])
                found[row, step] = reward + gamma * ahead
    return found


@pytest.mark.parametrize("memory", [0, 5])
def test_returns_end_at_the_goal_and_go_on_where_an_episode_was_cut_off(flat, rules, memory):
    spec = make_spec(random_tables([flat], rules), rules, memory=memory, max_steps=4, gamma=0.9)
    worker, batch = batch_of(spec)
    ended = batch["next"]
    assert ended["truncated"].any()
    network, features = worker.network, worker.env.features
    value = network.critic(trunk_outputs(network, features, batch)).detach()
    advantage, target = advantages_and_targets(network, features, batch, value, 0.9, 1.0)
    expected = returns_by_hand(worker, batch, 0.9)
    assert torch.allclose(target[..., 0], expected, atol=1e-4)
    assert torch.allclose(advantage, target - value, atol=1e-4)


def test_the_loss_is_that_of_a3c(flat, rules):
    spec = make_spec(random_tables([flat], rules), rules, entropy_coef=0.02, value_coef=0.5)
    worker, batch = batch_of(spec)
    total, metrics = worker.loss(batch)
    network, features = worker.network, worker.env.features
    joint = trunk_outputs(network, features, batch)
    logits, value = network.actor(joint), network.critic(joint)
    advantage, target = advantages_and_targets(
        network, features, batch, value.detach(), spec.recipe.gamma, spec.recipe.gae_lambda
    )
    log_p = F.log_softmax(logits, dim=-1)
    chosen = log_p.gather(-1, batch["action"][..., None])
    entropy = -(log_p.exp() * log_p).sum(dim=-1).mean()
    expected = -(chosen * advantage).mean() - 0.02 * entropy + 0.5 * F.mse_loss(value, target)
    assert float(total) == pytest.approx(float(expected), rel=1e-5)
    assert metrics["entropy"] == pytest.approx(float(entropy), rel=1e-5)


@pytest.mark.parametrize("memory", [0, 3])
def test_gradients_agree_with_finite_differences(flat, rules, memory, monkeypatch):
    spec = make_spec(random_tables([flat], rules), rules, memory=memory, width=4, maps=1)
    worker, batch = batch_of(spec)
    network = worker.network.double()
    torch.manual_seed(1)
    for bias in (network.bias, network.second.bias):  # off the corners of the ReLUs
        bias.data += torch.randn_like(bias)
    batch = batch.apply(lambda t: t.double() if t.is_floating_point() else t)
    features = worker.env.features.double()
    loss = ActorCriticLoss(network, features, spec.recipe)
    joint = trunk_outputs(network, features, batch)
    with torch.no_grad():
        fixed = advantages_and_targets(network, features, batch, network.critic(joint), 0.99, 1.0)
    # targets and advantages are no part of the gradient
    monkeypatch.setattr("avn.rl.a3c.advantages_and_targets", lambda *_: fixed)

    def value() -> float:
        return float(loss(batch)[0].detach())

    for parameter in network.parameters():
        parameter.grad = None
    loss(batch)[0].backward()
    generator = torch.Generator().manual_seed(0)
    for name, parameter in network.named_parameters():
        gradient = torch.zeros_like(parameter) if parameter.grad is None else parameter.grad
        way = torch.randn(parameter.shape, generator=generator, dtype=torch.float64)
        with torch.no_grad():
            parameter += 1e-6 * way
            above = value()
            parameter -= 2e-6 * way
            below = value()
            parameter += 1e-6 * way
        slope = float((gradient * way).sum())
        assert (above - below) / 2e-6 == pytest.approx(slope, rel=1e-4, abs=1e-7), name
