"""One run: an agent walks all episodes of the test apartments and leaves its records."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import pandas as pd
from hydra.utils import instantiate
from omegaconf import DictConfig, OmegaConf
from torch import Tensor
from torch.utils.tensorboard import SummaryWriter

from avn.acoustics.dry_sounds import content_hash, load_sounds
from avn.agents.rollout import Labels, Watch, walk_room
from avn.core.errors import UserError
from avn.core.files import check_name, written_whole
from avn.core.hashing import digest
from avn.dataset import build
from avn.dataset.scene import Scene
from avn.navigation.episodes import Episodes, exhaustive_episodes, frozen_episodes
from avn.navigation.exploration import EXPLORATIONS
from avn.navigation.protocols import Protocol
from avn.pipeline import (
    audio_inference,
    observations,
    perception_tables,
    policy,
    scenes,
)
from avn.pipeline.agent import acting, build_agent
from avn.pipeline.stage import make_once
from avn.reporting import results, table

# Raised when the code of simulator, agents or metrics changes a record.
VERSION = 3
RESULTS, EPISODE_RECORDS = "results.csv", "episodes.csv"
EPISODES = ("frozen", "exhaustive")


def run_hash(cfg: DictConfig) -> str:
    """Hash of what a run's records depend on."""
    acoustics = scenes.acoustics_of(cfg)
    apartments = [build.first_arrival_hash(p, acoustics) for p in scenes.plans(cfg)[cfg.part]]
    observed = observations.senses_hash(cfg, wanted_by(cfg))
    rules = (cfg.protocol, cfg.agent, cfg.seed, cfg.episodes, cfg.exploration)
    sounds = list(content_hash(audio_inference.sound_files(cfg)).items())
    return digest(apartments, observed, rules, acting(cfg), sounds, VERSION)


def wanted_by(cfg: DictConfig) -> tuple[str, ...]:
    """The observations that the agent of a config cannot do without."""
    return build_agent(cfg).wants(instantiate(cfg.protocol))


def agent_label(cfg: DictConfig) -> str:
    """The name of the config's agent in tables; it tells which parts of the truth it is given."""
    return "-true-".join((cfg.agent.name, *cfg.agent.truth))


def run_folder_name(cfg: DictConfig) -> str:
    """`<agent>/<sounds>/seed<seed>-<hash8>`: the folder of a run under `outputs/eval`."""
    sounds = "-".join(audio_inference.sound_files(cfg))
    check_name("agent.name", cfg.agent.name)
    return f"{cfg.agent.name}/{sounds}/seed{cfg.seed}-{run_hash(cfg)[:8]}"


def evaluate(cfg: DictConfig) -> Path:
    """Walk, unless the run is there, and write `episodes.csv`, `results.csv` and TensorBoard.

    Returns
    -------
    Path
        The run's folder.

    Raises
    ------
    UserError
        Where an option cannot work, or something it needs is missing and `auto` is false.
    """
    if not 0 <= cfg.seed < 2**62:
        raise UserError(f"seed: {cfg.seed} is out of range; give 0 or more")
    if cfg.episodes not in EPISODES:
        raise UserError(f"episodes: '{cfg.episodes}' is none of {', '.join(EPISODES)}")
    if cfg.part not in scenes.PARTS:
        raise UserError(f"part: '{cfg.part}' is none of {', '.join(scenes.PARTS)}")
    if cfg.exploration not in EXPLORATIONS:
        raise UserError(f"exploration: '{cfg.exploration}' is none of {', '.join(EXPLORATIONS)}")
    instantiate(cfg.protocol)  # rules that contradict themselves are refused first
    agent = build_agent(cfg)
    if agent.privileged != cfg.agent.privileged:
        raise UserError(
            f"agent.privileged: {cfg.agent.privileged}, but '{type(agent).__name__}' is "
            f"{'' if agent.privileged else 'not '}shown the truth; say so in the row"
        )
    load_sounds(audio_inference.sound_files(cfg))  # a bad file is refused before anything is made
    folder = Path(cfg.outputs) / "eval" / run_folder_name(cfg)
    make_once(
        folder,
        f"run of '{cfg.agent.name}' (seed {cfg.seed}, train_seed {cfg.train_seed})",
        done=(folder / RESULTS).is_file,
        make=lambda: _walk(cfg, folder),
        seconds=_walking_time(cfg),
    )
    return folder


def _walking_time(cfg: DictConfig) -> float:
    """Seconds that a run takes on two cores, roughly, once all that it needs is there."""
    return 15.0 if cfg.planner._target_ or policy.learns(cfg) else 3.0


def _walk(cfg: DictConfig, folder: Path) -> None:
    rooms = scenes.scenes(cfg, (cfg.part,))[cfg.part]
    wanted = wanted_by(cfg)
    hearing, sights = observations.heard(cfg, rooms, wanted), observations.seen(cfg, rooms, wanted)
    episodes = pd.concat(walk_rooms(cfg, rooms, hearing, sights), ignore_index=True)
    protocol: Protocol = instantiate(cfg.protocol)
    walks = [episodes_of(cfg, room, protocol).walks for room in rooms]
    perception_tables.write(cfg, rooms, walks, hearing, sights, folder)
    summary = results.summarise(episodes)
    _log(cfg, folder, summary)
    with written_whole(folder / "config.yaml") as part:
        OmegaConf.save(cfg, part, resolve=True)
    results.write_csv(episodes, folder / EPISODE_RECORDS)
    results.write_csv(summary, folder / RESULTS)


def walk_rooms(
    cfg: DictConfig,
    rooms: Sequence[Scene],
    hearing: Sequence[Mapping[str, Tensor]],
    sights: Sequence[Mapping[str, Tensor]],
    watch: Watch | None = None,
) -> list[pd.DataFrame]:
    """Let the agent of a config walk all episodes of some rooms.

    Parameters
    ----------
    rooms : sequence of Scene
    hearing, sights : sequences of mappings of str to tensor
        What is heard and seen in each; see `avn.pipeline.observations`.
    watch : callable, optional
        Looks on; see `avn.agents.rollout.Watch`.

    Returns
    -------
    list of DataFrame
        The records of each room.
    """
    protocol: Protocol = instantiate(cfg.protocol)
    agent = build_agent(cfg, ready=True)
    labels = Labels(
        agent=agent_label(cfg),
        acoustics=cfg.acoustics.name,
        look=cfg.look if cfg.planner._target_ else "once",
    )
    return [
        walk_room(
            agent, room, episodes_of(cfg, room, protocol), protocol, labels, heard, seen, watch
        )
        for room, heard, seen in zip(rooms, hearing, sights, strict=True)
    ]


def episodes_of(cfg: DictConfig, room: Scene, protocol: Protocol) -> Episodes:
    """The episodes of a room as the config asks for them."""
    sounds = list(audio_inference.sound_files(cfg))
    if cfg.episodes == "exhaustive":
        return exhaustive_episodes(room, sounds, protocol, cfg.seed)
    return frozen_episodes(room, sounds, protocol, cfg.seed, cfg.exploration)


def read_run(folder: Path) -> tuple[pd.DataFrame, pd.DataFrame]:
    """Results and episodes of a finished run.

    Raises
    ------
    UserError
        Where a file is missing, cannot be read, or the results are not those of the episodes.
    """
    try:
        runs = results.read_csv(folder / RESULTS)
        episodes = results.read_csv(folder / EPISODE_RECORDS)
        pd.testing.assert_frame_equal(runs, results.summarise(episodes))
    except (OSError, ValueError, KeyError, AssertionError, UserError) as error:
        raise UserError(f"{folder}: the run is damaged; delete the folder and run again") from error
    return runs, episodes


def show_run(cfg: DictConfig, folder: Path) -> None:
    """Print the table of a run's folder by room and sound, and how hard its episodes are."""
    privileged = [agent_label(cfg)] if cfg.agent.privileged else []
    runs, episodes = read_run(folder)
    table.print_tables(runs, episodes, privileged=privileged)
    perception_tables.show(folder)


def _log(cfg: DictConfig, folder: Path, summary: pd.DataFrame) -> None:
    """TensorBoard's scalars by room and sound, and hparams with SR and SPL to compare runs by."""
    settings = {key: cfg[key].name for key in ("agent", "protocol", "acoustics", "split")}
    settings |= {key: cfg[key].name for key in ("sound_model", "mapper", "planner")}
    settings |= {"seed": cfg.seed, "train_seed": cfg.train_seed, "episodes": cfg.episodes}
    settings |= {key: cfg[key] for key in ("look", "exploration", "localisation")}
    settings |= {"part": cfg.part, "source": cfg.planner.source}
    settings["sounds"] = "-".join(audio_inference.sound_files(cfg))
    figures = results.headline(summary)
    with SummaryWriter(str(folder)) as writer:
        for row in summary.itertuples():
            for name in figures:
                writer.add_scalar(f"{name}/{row.sound}/{row.room}", getattr(row, name), cfg.seed)
        writer.add_hparams(settings, figures, run_name=".")
