import pandas as pd
import pytest
import torch
from small_actor_critics import measure, training
from small_training import loggers
from small_worlds import make_spec, make_trajectories, make_worker, random_tables
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator
from torch.nn import functional as F

from avn.core.errors import UserError
from avn.navigation.reward import RewardConfig
from avn.rl.checkpoints import BEST, LAST, load_network, read_checkpoint
from avn.rl.curve import best_of
from avn.rl.networks import ActorCritic, sample
from avn.rl.shared import SharedState
from avn.rl.training import Training


def test_shared_rmsprop_is_that_of_torch():
    generator = torch.Generator().manual_seed(0)
    weights = torch.randn(50, generator=generator)
    reference = torch.nn.Parameter(weights.clone())
    optimiser = torch.optim.RMSprop([reference], lr=0.01, alpha=0.9, eps=0.1)
    shared = SharedState.of(weights)
    for _ in range(20):
        gradient = torch.randn(50, generator=generator)
        reference.grad = gradient.clone()
        optimiser.step()
        shared.apply(gradient, lambda done: 0.01, 0.9, 0.1)
    assert torch.allclose(shared.weights, reference.detach(), atol=1e-6)


@pytest.mark.parametrize("memory", [0, 5])
def test_one_worker_is_synchronous_a2c_step_for_step(flat, rules, memory):
    """Against a plain loop: its own returns, losses, clipping and torch's RMSProp."""
    tables = random_tables([flat], rules)
    spec = make_spec(
        tables, rules, memory=memory, max_grad_norm=0.5, lr=0.01, eps=1e-3, schedule="constant"
    )
    worker, twin = make_worker(spec), make_worker(spec)
    network, env, draws = twin.network, twin.env, twin.policy.generator
    parameters = [torch.nn.Parameter(p.detach().clone()) for p in network.parameters()]
    optimiser = torch.optim.RMSprop(parameters, lr=0.01, alpha=0.99, eps=1e-3)
    for _ in range(8):
        worker.update()
        seen, logs, values, entropies, rewards, ends = env.observation(), [], [], [], [], []
        h, c = env.observation().get("h"), env.observation().get("c")
        if not memory:
            h, c = network.no_memory(6)
        for _ in range(5):
            features = env.features(seen["state"], seen["clip"])
            joint, h_next, c_next = network.remember(network.embed(features), h, c)
            logits = network.actor(joint)
            action = sample(logits.detach(), draws)
            log_p = F.log_softmax(logits, dim=1)
            logs.append(log_p.gather(1, action[:, None])[:, 0])
            entropies.append(-(log_p.exp() * log_p).sum(dim=1))
            values.append(network.critic(joint)[:, 0])
            kept = (h_next.detach(), c_next.detach()) if memory else ()
            reward, terminated, truncated = env.move(action, *kept)
            rewards.append(reward)
            with torch.no_grad():
                after = env.observation()
                embedding = network.embed(env.features(after["state"], after["clip"]))
                last, *_ = network.remember(embedding, h_next, c_next)
                ends.append((terminated, truncated, network.critic(last)[:, 0]))
            done = terminated | truncated
            fresh = done[:, None, None]
            if done.any():
                env.begin(done)
            seen = env.observation()
            h, c = torch.where(fresh, 0.0, h_next), torch.where(fresh, 0.0, c_next)
        ahead, targets = ends[-1][2], []
        for reward, (terminated, truncated, value) in zip(rewards[::-1], ends[::-1], strict=True):
            ahead = torch.where(truncated, value, ahead) * ~terminated
            ahead = reward + 0.99 * ahead
            targets.insert(0, ahead)
        target, value = torch.stack(targets), torch.stack(values)
        loss = -(torch.stack(logs) * (target - value).detach()).mean()
        loss = loss - 0.01 * torch.stack(entropies).mean() + 0.5 * ((value - target) ** 2).mean()
        twin.gradients.zero_()
        loss.backward()
        torch.nn.utils.clip_grad_norm_(network.parameters(), 0.5)
        for parameter, own in zip(parameters, network.parameters(), strict=True):
            parameter.grad = own.grad.clone()
        optimiser.step()
        with torch.no_grad():
            for parameter, own in zip(parameters, network.parameters(), strict=True):
                own.copy_(parameter)
    assert torch.allclose(worker.shared.weights, twin.weights, atol=1e-5)
    assert not torch.allclose(worker.shared.weights, make_worker(spec).shared.weights, atol=1e-3)


@pytest.mark.parametrize("memory", [0, 5])
def test_a_training_that_was_killed_goes_on_as_if_it_had_not_been(flat, rules, tmp_path, memory):
    tables = random_tables([flat], rules)
    trajectories = make_trajectories(tables) if memory else None
    maps = 2 if memory else 1
    spec = make_spec(
        tables,
        rules,
        trajectories=trajectories,
        memory=memory,
        maps=maps,
        total_steps=1200,
        validate_every=300,
    )
    whole = training(spec, tmp_path / "whole")
    whole.run()
    assert len(whole.curve) == 5  # untrained, and four rounds
    training(spec, tmp_path / "killed").run(rounds=2)
    again = training(spec, tmp_path / "killed")
    assert again.steps == 600
    again.run()
    assert torch.equal(again.shared.weights, whole.shared.weights)
    assert torch.equal(again.shared.moments, whole.shared.moments)
    times = ("steps_per_second",)
    for one, other in zip(again.curve, whole.curve, strict=True):
        assert {k: v for k, v in one.items() if k not in times} == {
            k: v for k, v in other.items() if k not in times
        }


def test_checkpoints_of_another_row_and_damaged_ones_are_refused(flat, rules, tmp_path):
    spec = make_spec(random_tables([flat], rules), rules, total_steps=60, validate_every=60)
    training(spec, tmp_path).run()
    with pytest.raises(UserError, match="of another row or recipe"):
        training(spec, tmp_path, fingerprint="b" * 64)
    network = ActorCritic(spec.network_spec)
    load_network(network, tmp_path / BEST, "a" * 64)
    other = make_spec(spec.tables, rules, inputs=("visual_embedding",))
    with pytest.raises(UserError, match="features or sizes"):
        load_network(ActorCritic(other.network_spec), tmp_path / BEST, "a" * 64)
    (tmp_path / BEST).write_bytes(b"no checkpoint")
    with pytest.raises(UserError, match="damaged"):
        load_network(network, tmp_path / BEST, "a" * 64)


def test_the_best_on_validation_is_kept(flat, rules, tmp_path):
    spec = make_spec(random_tables([flat], rules), rules, total_steps=600, validate_every=60)
    kept = training(spec, tmp_path)
    kept.run()
    network = ActorCritic(spec.network_spec)
    load_network(network, tmp_path / BEST, "a" * 64)
    best = max(own["validation/spl"] for own in kept.curve[1:])
    assert measure(network)["validation/spl"] == pytest.approx(best)


def test_several_gradients_of_a_batch_count_its_actions_once(flat, rules, tmp_path):
    options = {"total_steps": 600, "validate_every": 300}
    tables = random_tables([flat], rules)
    once, twice = (
        training(make_spec(tables, rules, updates_per_batch=n, **options), tmp_path / str(n))
        for n in (1, 2)
    )
    for run in (once, twice):
        run.run()
        assert run.steps == 600
    assert int(twice.shared.updates) == 2 * int(once.shared.updates)
    assert not torch.equal(once.shared.weights, twice.shared.weights)
    again = training(twice.spec, tmp_path / "2")  # which is finished
    again.run()
    assert torch.equal(again.shared.weights, twice.shared.weights)


@pytest.mark.parametrize(
    ("spl", "kept"),
    [
        ([0.5], 0),
        ([0.5, 0.1, 0.3, 0.2], 2),  # never the untrained one
        ([0.0, 0.4, 0.4, 0.1], 2),  # the later of equal ones
        ([0.0, 0.0, 0.0], 2),
    ],
)
def test_the_kept_network_is_a_trained_one_and_the_latest_of_equal_ones(spl, kept):
    curve = [{"validation/spl": value} for value in spl]
    assert best_of(curve) is curve[kept]


def test_a_training_goes_on_from_another_one(flat, rules, tmp_path):
    tables = random_tables([flat], rules)
    first = training(make_spec(tables, rules, total_steps=600, validate_every=300), tmp_path / "a")
    first.run()
    spec = make_spec(tables, rules, total_steps=1500, validate_every=300)
    torch.manual_seed(3)
    network, start = ActorCritic(spec.network_spec), tmp_path / "a" / LAST

    def going_on():
        return Training(spec, network, tmp_path / "b", measure, "b" * 64, start=start)

    second = going_on()
    assert torch.equal(second.shared.weights, first.shared.weights)
    assert torch.equal(second.shared.moments, first.shared.moments)
    assert second.steps == 600
    interrupted = second.run(rounds=1)
    assert [own["steps"] for own in interrupted] == [600, 900]
    start.unlink()  # from here on it has a checkpoint of its own
    curve = going_on().run()
    assert [own["steps"] for own in curve] == [600, 900, 1200, 1500]
    # the first network of the curve is the one from which it goes on
    assert curve[0]["validation/spl"] == first.curve[-1]["validation/spl"]


def test_a_start_that_cannot_be_is_refused(flat, rules, tmp_path):
    tables = random_tables([flat], rules)
    training(make_spec(tables, rules, total_steps=600), tmp_path / "a").run()
    for path, options, line in (
        (tmp_path / "a" / BEST, {"total_steps": 900}, "is no last checkpoint of an actor-critic"),
        (tmp_path / "a" / LAST, {"total_steps": 600}, "has 600 actions, and the training ends af"),
        (tmp_path / "a" / LAST, {"total_steps": 620}, "give more algorithm.total_steps"),
        (tmp_path / "a" / LAST, {"total_steps": 900, "memory": 5}, "is of another network, with"),
    ):
        spec = make_spec(tables, rules, **options)
        with pytest.raises(UserError, match=line):
            Training(spec, ActorCritic(spec.network_spec), tmp_path / "b", measure, "b", start=path)


def test_every_logger_gets_the_curve(flat, rules, tmp_path):
    spec = make_spec(random_tables([flat], rules), rules, total_steps=600, validate_every=300)
    steps = []

    def opened(step):
        steps.append(step)
        return loggers(tmp_path, "csv", "tensorboard")

    torch.manual_seed(1)
    network = ActorCritic(spec.network_spec)
    run = Training(spec, network, tmp_path, measure, "a" * 64, opened)
    run.run(rounds=1)
    Training(spec, network, tmp_path, measure, "a" * 64, opened).run()
    assert steps == [1, 301]
    events = EventAccumulator(str(tmp_path / "a-run")).Reload().Scalars("validation/spl")
    assert [event.step for event in events] == [0, 300, 600]
    tables = [pd.read_csv(tmp_path / "csv" / f"version_{n}" / "metrics.csv") for n in (0, 1)]
    found = pd.concat(tables).dropna(subset="validation/spl")
    assert found["step"].tolist() == [0, 300, 600]
    assert found["validation/spl"].tolist() == pytest.approx([own.value for own in events])


def test_the_file_is_that_of_the_kept_network(flat, rules, tmp_path):
    spec = make_spec(random_tables([flat], rules), rules, total_steps=180, validate_every=60)
    values, networks = iter([0.9, 0.2, 0.2, 0.1]), []

    def measure(network):
        networks.append({name: own.clone() for name, own in network.state_dict().items()})
        return {"validation/spl": next(values)}

    torch.manual_seed(0)
    Training(spec, ActorCritic(spec.network_spec), tmp_path, measure, "a" * 64).run()
    network = ActorCritic(spec.network_spec)
    load_network(network, tmp_path / BEST, "a" * 64)
    assert all(torch.equal(own, networks[2][name]) for name, own in network.state_dict().items())


def test_the_success_of_training_episodes_is_that_of_the_environment(flat, rules):
    reward = RewardConfig(success=-1.0, step=3.0, collision=3.0)
    spec = make_spec(random_tables([flat], rules), rules, reward=reward, max_steps=4, num_envs=64)
    worker = make_worker(spec)
    batch = worker.collector.collect()
    worker.episode_stats.update(batch)
    ended = batch["next", "done"]
    expected = batch["next", "terminated"][ended].float().mean()  # it ends where it succeeds
    assert 0 < float(expected) < 1
    assert worker.episode_stats.metrics()["success"] == pytest.approx(float(expected))


def test_a_training_that_diverges_is_one_line_and_keeps_what_was_before(flat, rules, tmp_path):
    spec = make_spec(random_tables([flat], rules), rules, total_steps=600, validate_every=300)
    run = training(spec, tmp_path)
    run.run(rounds=1)
    kept = read_checkpoint(tmp_path / LAST, "a" * 64)
    run.shared.weights[0] = float("nan")
    with pytest.raises(UserError, match=r"not finite after 600 steps.*algorithm\.lr"):
        run.run()
    assert torch.equal(read_checkpoint(tmp_path / LAST, "a" * 64)["weights"], kept["weights"])
