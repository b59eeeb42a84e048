"""Options that had another name in 0.1.0: the error for an old name gives the new one."""

from __future__ import annotations

from collections.abc import Iterator

from omegaconf import DictConfig, OmegaConf

from avn.core.errors import UserError

# Old key: new key. A node covers all keys below it.
OPTIONS = {
    "mapper.network": "occupancy_model",
    "mapper.windows": "mapper.local_patches",
    "takes": "realisations",
    "part": "subset",
    "agent.truth": "agent.oracle_inputs",
    "acoustics.first_arrival": "acoustics.direct_path",
    "acoustics.ear_height": "acoustics.receiver_height",
    "protocol.says_stop": "protocol.requires_stop",
    "protocol.path": "protocol.path_length",
    "protocol.moves_factor": "protocol.max_moves_ratio",
    "protocol.starts": "protocol.num_starts",
    "protocol.exploration": "protocol.exploration_steps",
    "planner.source": "planner.source_filter",
    "planner.blocked_below": "planner.obstacle_threshold",
    "planner.detour": "planner.collision_cost",
    "planner.patience": "planner.max_rotations",
    "planner.error.near": "planner.error.sigma",
    "planner.error.share": "planner.error.sigma_per_metre",
    "planner.error.behind": "planner.error.front_back_prob",
    "planner.error.outlier": "planner.error.outlier_prob",
    "baseline.patience": "baseline.max_rotations",
    "sound_model.mirror": "sound_model.flip_augmentation",
    "sound_model.symmetric": "sound_model.flip_tta",
    "sound_model.net.reach": "sound_model.net.output_scale",
    "sound_model.spectrogram.rate": "training.acoustics.rate",
    "sound_model.spectrogram.window": "sound_model.spectrogram.stft_window",
    "stop_model.mirror": "stop_model.flip_augmentation",
    "stop_model.symmetric": "stop_model.flip_tta",
    "stop_model.net.reach": "stop_model.net.output_scale",
    "stop_model.spectrogram.rate": "training.acoustics.rate",
    "stop_model.spectrogram.window": "stop_model.spectrogram.stft_window",
    "occupancy_model.mirror": "occupancy_model.flip_augmentation",
    "occupancy_model.symmetric": "occupancy_model.flip_tta",
    "occupancy_model.looks": "occupancy_model.appearances",
    "a3c.episodes": "algorithm.num_envs",
    "a3c.steps": "algorithm.rollout_length",
    "a3c.total": "algorithm.total_steps",
    "a3c.order": "algorithm.update_order",
    "a3c.entropy": "algorithm.entropy_coef",
    "a3c.value": "algorithm.value_coef",
    "a3c.clip": "algorithm.max_grad_norm",
    "a3c.takes": "algorithm.realisations",
    "a3c.walks": "algorithm.exploration_walks",
    "a3c.refresh": "algorithm.memory_refresh_interval",
    "a3c": "algorithm",
}
# New key: its renamed values, old to new.
VALUES = {
    "acoustics.direct_path": {"through_walls": "transmission", "round_corners": "diffraction"},
    "protocol.path_length": {"attempted": "moves", "walked": "metres"},
    "planner.source_filter": {"newest": "latest", "belief": "bayes"},
    "algorithm.collector": {"lean": "tensor"},
    "agent.oracle_inputs": {"location": "source_estimate", "window": "local_patch"},
}


def check_name(key: str, where: str = "") -> None:
    """Refuse an old name of an option.

    Parameters
    ----------
    key : str
        Dotted key, as given.
    where : str
        Prefix of the message, such as the name of the file.

    Raises
    ------
    UserError
        For an old name; the message gives the new one.
    """
    for old, new in OPTIONS.items():
        if key == old or key.startswith(f"{old}."):
            now = new + key[len(old) :]
            values = ", ".join(f"{then} is {value}" for then, value in VALUES.get(now, {}).items())
            raise UserError(
                f"{where}{key}: is now {now}{f' ({values})' if values else ''}; give that"
            )


def check_file(name: str, node: DictConfig, is_global: bool) -> None:
    """Refuse old names in a config file.

    Parameters
    ----------
    name : str
        Group and option, such as `planner/mine`.
    node : DictConfig
        Content of the file.
    is_global : bool
        Whether its keys are relative to the top of the config instead of the group.
    """
    start = "" if is_global or "/" not in name else f"{name.split('/')[0]}."
    for key in _keys(OmegaConf.to_container(node, resolve=False)):
        check_name(start + key, f"{name}: ")


def _keys(node: object) -> Iterator[str]:
    if isinstance(node, dict):
        for key, value in node.items():
            yield str(key)
            yield from (f"{key}.{below}" for below in _keys(value))
