import pytest
import torch
from small_worlds import make_spec, make_trajectories, make_worker, random_tables
from tensordict import TensorDict
from tensordict.nn import TensorDictModuleBase
from torchrl.envs.utils import check_env_specs

from avn.core.errors import UserError
from avn.navigation.batched_episodes import BatchedEpisodes
from avn.navigation.start_sampler import StartSampler, build_start_sampler
from avn.rl.collectors import TensorCollector, TorchrlCollector
from avn.rl.environment import NavigationEnv
from avn.rl.policy import FeatureLookup, Policy

ALL = ("visual_embedding", "audio_embedding", "collided", "odometry", "map")


def make_env(tables, rules, n=6, seed=0, **options) -> NavigationEnv:
    observations = options.pop("observations", ALL)
    options = {"map_size": 41, "map_width": 11} | options
    return NavigationEnv(
        BatchedEpisodes(tables, build_start_sampler(tables), n, rules, 9, seed=seed),
        observations,
        **options,
    )


@pytest.mark.parametrize("resolved", [True, False])
@pytest.mark.parametrize("memory", [0, 4])
def test_the_environment_keeps_to_its_specs(flat, rules, resolved, memory):
    tables = random_tables([flat], rules)
    check_env_specs(make_env(tables, rules, memory=memory, resolved=resolved))


def test_specs_say_shapes_and_ranges(flat, rules):
    tables = random_tables([flat], rules)
    env = make_env(tables, rules, resolved=False)
    assert env.action_spec.space.n == 4
    state = env.observation_spec["index", "state"]
    assert (int(state.space.low.min()), int(state.space.high.max())) == (0, tables.states - 1)
    assert env.observation_spec["map"].shape == (6, 1, 11, 11)
    assert float(env.observation_spec["map"].space.high.max()) == 1.0
    assert env.observation_spec["odometry"].dtype == torch.int64


def test_an_observation_that_is_not_there_is_refused_by_name(flat, rules):
    tables = random_tables([flat], rules)
    with pytest.raises(UserError, match="observations: 'smell'"):
        make_env(tables, rules, observations=("smell",))


def test_only_rows_whose_episode_ended_begin_anew(flat, rules):
    env = make_env(random_tables([flat], rules), rules)
    first = env.reset()
    env.episodes.actions = torch.arange(6)  # so that they are cut off one after another
    ends = 0
    for _ in range(8):
        first["action"] = torch.full((6,), 2)
        both, after = env.step_and_maybe_reset(first)
        ended = both["next", "done"][:, 0]
        ends += int(ended.sum())
        assert torch.equal(after["odometry"][~ended], both["next", "odometry"][~ended])
        assert torch.equal(
            after["visual_embedding"][~ended], both["next", "visual_embedding"][~ended]
        )
        assert not after["odometry"][ended].any()
        assert torch.equal(after["is_init"], both["next", "done"])
        first = after
    assert ends == 5  # those that had made 1 action or more


class Spy(TensorDictModuleBase):
    """Says what it was shown."""

    def __init__(self, in_keys):
        super().__init__()
        self.in_keys, self.out_keys, self.shown = list(in_keys), ["action"], []

    def forward(self, tensordict):
        self.shown.append(tensordict.clone())
        return tensordict.set("action", torch.zeros(tensordict.batch_size, dtype=torch.int64))


def test_a_policy_is_shown_features_and_never_a_number(flat, rules):
    tables = random_tables([flat], rules)
    env = make_env(
        tables, rules, observations=("visual_embedding", "audio_embedding", "map"), resolved=False
    )
    spy = Spy(["visual_embedding", "audio_embedding", "map"])
    env.rollout(5, FeatureLookup(env.features, spy), break_when_any_done=False)
    for shown in spy.shown:
        assert set(shown.keys(include_nested=True, leaves_only=True)) == set(spy.in_keys)
        assert all(value.is_floating_point() for value in shown.values())
    numbers = env.rollout(1)["index"][:, 0]
    expected = tables.visual["visual_embedding"][numbers["state"]]
    features = env.features(numbers["state"], numbers["clip"])
    assert torch.equal(features["visual_embedding"], expected)


def test_resolved_observations_are_those_that_the_numbers_stand_for(flat, rules):
    tables = random_tables([flat], rules)
    near, far = (make_env(tables, rules, resolved=r, seed=4) for r in (True, False))
    shown, numbers = near.reset(), far.reset()
    found = far.features(numbers["index", "state"], numbers["index", "clip"])
    for name in ("visual_embedding", "audio_embedding"):
        assert torch.equal(shown[name], found[name])


@pytest.mark.parametrize("memory", [0, 4])
@pytest.mark.parametrize("maps", [0, 2])
def test_both_collectors_give_the_same_batches(flat, rules, memory, maps):
    tables = random_tables([flat], rules)
    trajectories = make_trajectories(tables) if memory else None
    maps = min(maps, 2 if memory else 1)
    batches = []
    for collector in (TensorCollector, TorchrlCollector):
        spec = make_spec(tables, rules, trajectories=trajectories, memory=memory, maps=maps)
        worker = make_worker(spec)
        policy = Policy(worker.network, torch.Generator().manual_seed(7))
        gathering = collector(worker.env, policy, rollout_length=5)
        batches.append([gathering.collect().clone() for _ in range(6)])
    tensor, torchrl = batches
    for one, other in zip(tensor, torchrl, strict=True):
        assert one.batch_size == other.batch_size == (6, 5)
        for key in one.keys(include_nested=True, leaves_only=True):
            assert torch.equal(one[key], other[key]), key
    assert any(bool(batch["next", "terminated"].any()) for batch in tensor)
    assert any(bool(batch["next", "truncated"].any()) for batch in tensor)


def test_the_map_is_that_of_where_the_agent_has_been_and_begins_unknown(flat, rules):
    tables = random_tables([flat], rules)
    tables.visual["local_patch"][:] = (
        torch.nan
    )  # nothing is seen: only what it stands on and runs into
    env = make_env(tables, rules, n=1, observations=("map",))
    east, sources = 1, len(tables.source_scene)
    begins = torch.zeros(sources, dtype=torch.int64)
    env.episodes.starts = StartSampler(1, torch.tensor([4 * 2 + east]), begins, begins + 1)
    env.begin(torch.tensor([True]))
    assert env.observation()["map"].unique().tolist() == [0.5, 1.0]  # it stands somewhere
    env.move(torch.tensor([0]))
    around = env.observation()["map"][0, 0]
    assert around[5, 5] == 1.0
    assert around[4, 5] == 1.0
    assert int((around != 0.5).sum()) == 2
    env.move(torch.tensor([3]))  # to the right: what was behind is now to its right
    around = env.observation()["map"][0, 0]
    assert around[5, 5] == 1.0
    assert around[5, 6] == 1.0
    env.begin(torch.tensor([True]))
    assert int((env.observation()["map"] != 0.5).sum()) == 1


def test_the_batch_axes_are_episodes_and_steps(flat, rules):
    tables = random_tables([flat], rules)
    batch = make_worker(make_spec(tables, rules)).collector.collect()
    assert isinstance(batch, TensorDict)
    done = batch["next", "done"][:, :-1, 0]
    assert torch.equal(batch["is_init"][:, 1:, 0], done)
    going = ~done
    following = batch["index", "state"][:, 1:]
    assert torch.equal(following[going], batch["next", "index", "state"][:, :-1][going])
