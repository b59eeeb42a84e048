"""The world as Gymnasium sees it, on the real mini split."""

import subprocess
import sys
import warnings

import gymnasium
import numpy as np
import pytest
import torch
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode, SyncVectorEnv

import avn  # noqa: F401 - registers the environment
from avn.core.errors import UserError

# The options of tests/test_planner_commands.py, so that stages are shared.
PLACES = ("split=mini", "processes=1")
HEARD = ("acoustics.rays=300", "acoustics.seconds=0.2", "algorithm.realisations=1")
SEEN = (
    "renderer.camera.size=32",
    "renderer.samples=1",
    "renderer.light.gather_rays=4",
    "renderer.light.shadow_rays=2",
    "renderer.light.spacing=0.3",
)
OWN = ("odometry", "collided")


@pytest.fixture
def options(outputs):
    """An environment that needs the geometry alone."""
    return {"overrides": [*PLACES, f"outputs={outputs}"], "observations": OWN, "max_steps": 20}


@pytest.fixture
def rich(outputs):
    """An environment with pixels and sound."""
    names = ("view", "depth", "waveform", "spectrogram", "odometry", "collided")
    overrides = [*PLACES, *HEARD, *SEEN, f"outputs={outputs}"]
    return {"overrides": overrides, "observations": names, "max_steps": 20}


@pytest.fixture
def maker():
    """Gymnasium, whose every warning is an error."""
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)
        yield gymnasium


def make_vector(n, options, **more):
    return gymnasium.make_vec("avn/Walk-v0", num_envs=n, **options, **more)


def walk(env, steps, seed=0):
    """Single episodes as sound, source, start and the distances on the way."""
    rng, found = np.random.default_rng(seed), []
    for _ in range(steps):
        _, _, terminated, truncated, info = env.step(int(rng.integers(4)))
        found.append((info["sound"], info["distance_to_goal"]))
        if terminated or truncated:
            env.reset()
    return found


def test_it_passes_gymnasiums_own_checker(maker, rich):
    check_env(maker.make("avn/Walk-v0", render_mode="rgb_array", **rich).unwrapped)


def test_it_passes_the_checker_of_stable_baselines3(options):
    checker = pytest.importorskip("stable_baselines3.common.env_checker")
    checker.check_env(gymnasium.make("avn/Walk-v0", **options).unwrapped)


def test_pixels_and_sound_have_the_layout_of_the_space(maker, rich):
    env = maker.make("avn/Walk-v0", **rich)
    seen, _ = env.reset(seed=0)
    assert seen["view"].shape == (32, 32, 3)
    assert seen["view"].dtype == np.uint8
    assert seen["view"].std() > 1
    assert seen["waveform"].shape == (2, 16000)
    assert seen["waveform"].std() > 0
    assert seen in env.observation_space


def test_bounds_are_constants_of_the_name(rich):
    train, validation = (
        gymnasium.make("avn/Walk-v0", part=part, **rich) for part in ("train", "validation")
    )
    assert train.observation_space == validation.observation_space


def test_an_episode_is_cut_off_or_ends_at_the_goal(maker, options):
    env = maker.make("avn/Walk-v0", **options)
    env.reset(seed=0)
    env.action_space.seed(0)
    ends = set()
    for _ in range(300):
        _, reward, terminated, truncated, info = env.step(env.action_space.sample())
        assert (reward > 0) == terminated == info["success"]
        assert (info["spl"] > 0) == info["success"]
        if terminated or truncated:
            ends.add("terminated" if terminated else "truncated")
            env.reset()
    assert ends == {"terminated", "truncated"}


@pytest.mark.parametrize(
    ("given", "line"),
    [
        ({"max_step": 5}, "'max_step'.*max_steps"),
        ({"foo": 1}, "'foo'"),
        ({"sound": "alarm"}, "overrides=.'sound=alarm'"),
        ({"observes": OWN}, "'observes'.*observations"),
        ({"overrides": ["split=mini", "mapper.size=51"]}, "mapper.size: not read"),
        ({"overrides": ["split=mini", "baseline.map_width=5"]}, "baseline.map_width: not read"),
        ({"overrides": ["split=mini", "sound=alarm"]}, "sound: not read"),
        ({"overrides": ["split=mini", "protocol.cap=goal"]}, "protocol.cap: not read"),
        (
            {"overrides": ["split=mini", "protocol=stop", "protocol.cap=goal"], "max_steps": None},
            "protocol.cap: not read",
        ),
        ({"overrides": ["split=mini", "seed=3"]}, "seed: not read"),
        ({"overrides": ["split=mini", "split.sizes=3"]}, "split.sizes|sizes"),
        ({"overrides": ["split=mini", "planner.detour=3"]}, "detour"),
        ({"overrides": "split=mini"}, "one string"),
        ({"observations": ["rgb"]}, "'rgb' is none of source_estimate.*view"),
        ({"observations": []}, "observations: there are none"),
        ({"observations": "view"}, "one string"),
        ({"part": "exam"}, "part: 'exam' is none of"),
        ({"max_steps": 0}, "max_steps: 0"),
        ({"max_steps": 20, "part": "test"}, "max_steps: 20"),
        ({"render_mode": "human"}, "render_mode: 'human' is none of rgb_array"),
    ],
)
@pytest.mark.parametrize("vector", [False, True])
def test_an_option_that_does_nothing_is_one_line(options, given, line, vector):
    make = gymnasium.make_vec if vector else gymnasium.make
    settings = {name: own for name, own in options.items() if name != "max_steps"} | given
    with pytest.raises((UserError, TypeError), match=line) as error:
        make("avn/Walk-v0", **settings)
    assert "\n" not in str(error.value)


def test_settings_of_the_map_are_read_where_there_is_one(outputs):
    overrides = [*PLACES, *SEEN, f"outputs={outputs}", "occupancy_model.epochs=1"]
    overrides += ["occupancy_model.appearances=1", "occupancy_model.times=1"]
    overrides += ["occupancy_model.validation_views=40", "mapper.size=41", "baseline.map_width=7"]
    env = gymnasium.make("avn/Walk-v0", overrides=overrides, observations=["map"])
    assert env.observation_space["map"].shape == (1, 7, 7)


@pytest.mark.parametrize("action", [4, 7, -1, 1.0, 1.7, float("nan"), None, "0", [1], True])
def test_an_action_that_is_none_is_refused(options, action):
    env = gymnasium.make("avn/Walk-v0", disable_env_checker=True, **options).unwrapped
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"action: .*0 to 3"):
        env.step(action)


@pytest.mark.parametrize("actions", [[0, 7], [0.0, 1.0], [0], [[0], [1]], [0, np.nan]])
def test_actions_that_are_none_are_refused_in_the_vector_form(options, actions):
    env = make_vector(2, options)
    env.reset(seed=0)
    with pytest.raises(ValueError, match=r"action: .*0 to 3"):
        env.step(np.asarray(actions))


def test_copies_without_a_seed_differ_and_seeded_ones_repeat(options):
    def episodes(seed):
        env = gymnasium.make("avn/Walk-v0", **options)
        env.reset(seed=seed)
        return walk(env, 60)

    assert episodes(None) != episodes(None)
    assert episodes(5) == episodes(5)
    assert episodes(5) != episodes(6)


def test_seeding_leaves_the_generator_of_torch_alone(options):
    env = gymnasium.make("avn/Walk-v0", **options)
    torch.manual_seed(1)
    expected = torch.rand(1)
    torch.manual_seed(1)
    env.reset(seed=3)
    assert torch.equal(torch.rand(1), expected)


def test_options_place_the_episode(options):
    env = gymnasium.make("avn/Walk-v0", **options).unwrapped
    scene = env._running.world.scenes[0]
    source, far = 1, int(scene.grid.distances[scene.sources[1]].argmax())
    placed = {"source": source, "start": (far, 2), "sound": "clock"}
    _, info = env.reset(options=placed)
    episodes = env._running.env.episodes
    assert (int(episodes.source), int(episodes.state)) == (source, 4 * far + 2)
    assert info["sound"] == "clock"
    expected = 0.5 * int(scene.grid.distances[scene.sources[1]][far])
    assert info["distance_to_goal"] == pytest.approx(expected)
    env.reset(options={"source": source, "start": 4 * far + 1, "scene": scene.name})
    assert int(episodes.state) == 4 * far + 1
    for source in range(3):  # the start is drawn away from it
        env.reset(options={"source": source})
        tables = env._running.world.tables
        assert int(episodes.source) == source
        assert not tables.goal[tables.goal_row[source] + episodes.state]


@pytest.mark.parametrize(
    ("given", "line"),
    [
        ({"foo": 1}, "'foo' is none of scene, source"),
        ({"source": 9}, "source 9; give an integer from 0 to 2"),
        ({"source": 1.5}, "source 1.5"),
        ({"start": 10**6}, "start 1000000"),
        ({"start": (0, 4)}, "heading of start 4"),
        ({"sound": "bell"}, "'bell' is none of ring, alarm, clock"),
        ({"scene": "cellar"}, "'cellar' is none of"),
    ],
)
def test_an_option_that_does_not_exist_is_one_line(options, given, line):
    env = gymnasium.make("avn/Walk-v0", **options)
    with pytest.raises(UserError, match=line):
        env.reset(options=given)


def test_a_start_at_the_goal_is_refused(options):
    env = gymnasium.make("avn/Walk-v0", **options).unwrapped
    cell = int(env._running.world.scenes[0].sources[0])
    with pytest.raises(UserError, match="at the goal"):
        env.reset(options={"source": 0, "start": (cell, 0)})


def test_the_vector_form_gives_what_single_ones_give(maker, options):
    """One agent in the vector form walks as one alone, with the same draws."""
    single, vector = maker.make("avn/Walk-v0", **options), make_vector(1, options)
    one, info = single.reset(seed=3)
    many, infos = vector.reset(seed=3)
    generator = np.random.default_rng(0)
    for _ in range(60):
        assert all(np.array_equal(value, many[name][0]) for name, value in one.items())
        assert all(infos[name][0] == info[name] for name in infos if name in info)
        action = int(generator.integers(4))
        one, reward, terminated, truncated, info = single.step(action)
        many, rewards, terminateds, truncateds, infos = vector.step(np.array([action]))
        assert (reward, terminated, truncated) == (rewards[0], terminateds[0], truncateds[0])
        if terminated or truncated:
            final, last = infos["final_info"], infos["final_obs"][0]
            assert all(np.array_equal(last[name], one[name]) for name in one)
            assert all(final[name][0] == info[name] for name in info)
            one, info = single.reset()


def layout(infos):
    """Keys of infos with types and shapes, those of `final_info` too."""
    found = {}
    for name, own in infos.items():
        if isinstance(own, dict):
            found[name] = layout(own)
        else:
            found[name] = (own.dtype, own.shape)
    return found


@pytest.mark.parametrize("mode", ["SAME_STEP", "NEXT_STEP", "DISABLED"])
def test_infos_and_resets_have_the_layout_of_gymnasiums_own(options, mode):
    mode = AutoresetMode[mode]
    ours = make_vector(3, options, autoreset_mode=mode)
    theirs = SyncVectorEnv(
        [lambda: gymnasium.make("avn/Walk-v0", **options)] * 3, autoreset_mode=mode
    )
    assert ours.metadata["autoreset_mode"] == theirs.metadata["autoreset_mode"] == mode
    names = {"scene", "_scene", "sound", "_sound"} if mode == AutoresetMode.SAME_STEP else set()
    turn = np.full(3, 2)  # nobody arrives, so that all are cut off at once
    found = []
    for env in (ours, theirs):
        steps = [(env.reset(seed=0)[1], None, None)]
        for _ in range(22):
            _, reward, _, truncated, infos = env.step(turn)
            steps.append((infos, reward.tolist(), truncated.tolist()))
            if mode == AutoresetMode.DISABLED and truncated.any():
                env.reset(options={"reset_mask": truncated})
        found.append(steps)
    for (infos, *own), (expected, *other) in zip(*found, strict=True):
        wanted = {name: own for name, own in layout(expected).items() if name not in names}
        assert layout(infos) == wanted
        assert own == other


def test_rows_that_are_over_must_be_reset_where_nothing_does(options):
    env = make_vector(2, options | {"max_steps": 1}, autoreset_mode="DISABLED")
    with pytest.raises(UserError, match="call reset first"):
        env.step(np.zeros(2, dtype=np.int64))
    env.reset(seed=0)
    env.step(np.full(2, 2))
    with pytest.raises(UserError, match="reset_mask"):
        env.step(np.full(2, 2))


def test_pictures_show_view_and_map(rich):
    env = gymnasium.make("avn/Walk-v0", render_mode="rgb_array", **rich)
    env.reset(seed=0)
    frame = env.render()
    assert frame.shape == (400, 800, 3)
    assert frame.dtype == np.uint8
    before = frame.copy()
    env.step(2)
    after = env.render()
    assert (after[:, :400] != before[:, :400]).any()
    assert (after[:, 400:] != before[:, 400:]).any()
    vector = make_vector(2, rich, render_mode="rgb_array")
    vector.reset(seed=0)
    assert [own.shape for own in vector.render()] == [(400, 800, 3)] * 2


def test_a_film_is_recorded(rich, tmp_path):
    pytest.importorskip("moviepy")
    env = gymnasium.make("avn/Walk-v0", render_mode="rgb_array", **(rich | {"max_steps": 3}))
    env = gymnasium.wrappers.RecordVideo(env, str(tmp_path))
    env.reset(seed=0)
    for _ in range(3):
        env.step(2)
    env.close()
    assert list(tmp_path.glob("*.mp4"))


def test_one_who_imports_gymnasium_alone_names_the_module(options):
    """In an interpreter of its own; `import avn` alone imports no torch."""
    code = (
        "import sys, gymnasium; import avn; assert 'torch' not in sys.modules"
        "; del sys.modules['avn']; gymnasium.registry.pop('avn/Walk-v0')"
        f"; env = gymnasium.make('avn:avn/Walk-v0', **{options!r}); env.reset(seed=0)"
        "; print(env.spec.id)"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert run.stdout.split()[-1] == "avn/Walk-v0"
