import torch
from small_worlds import make_spec, make_trajectories, make_worker, random_tables
from tensordict import TensorDict
from torchrl.modules import set_recurrent_mode

from avn.rl.networks import ActorCritic, NetworkSpec, sample

SHAPE = NetworkSpec({"visual_embedding": 8, "audio_embedding": 6}, actions=4, width=16, memory=5)


def observations(*batch: int) -> dict[str, torch.Tensor]:
    generator = torch.Generator().manual_seed(0)
    return {
        name: torch.randn(*batch, size, generator=generator)
        for name, size in SHAPE.features.items()
    }


def test_features_are_concatenated_and_a_missing_one_tells_nothing():
    network = ActorCritic(SHAPE)
    seen = observations(4)
    weights = torch.cat([e.weight for e in network.encoders.values()], dim=1)
    first = torch.relu(torch.cat([*seen.values()], dim=1) @ weights.T + network.bias)
    assert torch.allclose(network.embed(seen), torch.relu(network.second(first)), atol=1e-6)
    silent = network.embed(seen | {"audio_embedding": torch.zeros(4, 6)})
    assert torch.allclose(
        network.embed({"visual_embedding": seen["visual_embedding"]}), silent, atol=1e-6
    )


def test_standardised_features_have_no_mean_and_equal_spread():
    network = ActorCritic(SHAPE)
    examples = torch.randn(1000, 8) * torch.arange(1, 9) + 3
    examples[:, 0] = 5.0  # a part that never changes
    network.standardise("visual_embedding", examples)
    found = (examples - network.visual_embedding_mean) * network.visual_embedding_scale
    assert torch.allclose(found.mean(dim=0), torch.zeros(8), atol=1e-4)
    assert torch.allclose(found.std(dim=0)[1:], found.std(dim=0)[1].expand(7), rtol=1e-3)
    assert not found[:, 0].any()


def test_a_step_of_the_memory_is_that_of_torchrls_lstm_module():
    network = ActorCritic(SHAPE)
    embedding, h, c = torch.randn(4, 16), torch.randn(4, 1, 5), torch.randn(4, 1, 5)
    shown = TensorDict(
        {"embedding": embedding, "h": h, "c": c, "is_init": torch.zeros(4, 1, dtype=torch.bool)},
        batch_size=[4],
    )
    expected = network.lstm(shown)
    joint, h_next, c_next = network.remember(embedding, h, c)
    assert torch.allclose(joint[:, 16:], expected["remembered"], atol=1e-6)
    assert torch.allclose(h_next, expected["h_next"], atol=1e-6)
    assert torch.allclose(c_next, expected["c_next"], atol=1e-6)


def test_unrolling_is_torchrls_recurrent_mode_with_episodes_that_begin_anew():
    network = ActorCritic(SHAPE)
    embedding = torch.randn(3, 6, 16)
    first = torch.zeros(3, 6, dtype=torch.bool)
    first[0, 2] = first[1, 0] = first[1, 5] = True
    h, c = torch.randn(3, 6, 1, 5), torch.randn(3, 6, 1, 5)
    shown = {"embedding": embedding, "h": h, "c": c, "is_init": first[..., None]}
    with set_recurrent_mode(True):
        expected = network.lstm(TensorDict(shown, batch_size=[3, 6]))["remembered"]
    found = network.unroll(embedding, h, c, first)
    assert torch.allclose(found[..., 16:], expected, atol=1e-5)


def test_memory_crosses_steps_and_is_renewed_where_an_episode_begins_and_only_there(flat, rules):
    tables = random_tables([flat], rules)
    trajectories = make_trajectories(tables)
    worker = make_worker(make_spec(tables, rules, trajectories=trajectories, memory=5, max_steps=4))
    batch = worker.collector.collect()
    after, before = batch["h_next"][:, :-1], batch["h"][:, 1:]
    begins = batch["is_init"][:, 1:, 0]
    assert begins.any()
    assert not begins.all()
    assert torch.equal(before[~begins], after[~begins])
    memories = worker.explorations.h
    assert memories.abs().sum() > 0
    known = (before[begins][:, None] == memories[None]).flatten(2).all(dim=2).any(dim=1)
    assert known.all()  # an episode begins with the memory of one of the walks


def test_memory_of_an_agent_without_walks_begins_empty(flat, rules):
    worker = make_worker(make_spec(random_tables([flat], rules), rules, memory=5, max_steps=4))
    batch = worker.collector.collect()
    begins = batch["is_init"][..., 0]
    assert not batch["h"][begins].any()
    assert batch["h"][~begins].abs().amin(dim=(1, 2)).gt(0).all()


def test_the_memory_after_a_walk_is_that_of_its_pictures_in_silence(flat, rules):
    tables = random_tables([flat], rules)
    trajectories = make_trajectories(tables, trajectories=2, steps=7)
    worker = make_worker(make_spec(tables, rules, trajectories=trajectories, memory=5))
    h, c = worker.network.no_memory(1)
    for state in trajectories[0, 1]:
        seen = {"visual_embedding": tables.visual["visual_embedding"][state][None]}
        _, h, c = worker.network.remember(worker.network.embed(seen), h, c)
    assert torch.allclose(worker.explorations.h[1], h[0], atol=1e-6)
    assert torch.allclose(worker.explorations.c[1], c[0], atol=1e-6)


def test_actions_are_drawn_with_the_softmax_of_their_logits():
    logits = torch.tensor([0.0, 1.0, -1.0, 2.0])
    drawn = sample(logits.expand(200_000, -1), torch.Generator().manual_seed(0))
    share = torch.bincount(drawn, minlength=4) / len(drawn)
    assert torch.allclose(share, torch.softmax(logits, 0), atol=4e-3)
