"""Write the trained networks of a folder of outputs into the package, for `networks=published`.

    python scripts/publish_networks.py OUTPUTS

Each run of `RUNS` names the networks that its agent uses. A network that is not trained there stays
as it was published, or is listed and left out. Weights with two or more dimensions are stored in
16 bits.
"""

from __future__ import annotations

import hashlib
import json
import sys
from pathlib import Path
from typing import Any

import torch
from safetensors.torch import save
from torch import Tensor

from avn.config.python import compose_command
from avn.modules.settings import BEST
from avn.pipeline.published_networks import FOLDER, INDEX
from avn.pipeline.run import Evaluation
from avn.pipeline.stage import with_needs
from avn.pipeline.trained import CHECKSUM, Trained
from avn.reporting.model_card import CARD

ACTOR_CRITICS = ("a3c_v", "a3c_va", "a3c_va_mapper", "a3c_va_m", "a3c_va_m_mapper")
PLANNERS = ("ours_noexp", "plan_noexp")
WORLDS = ("acoustics=diffraction", "acoustics=resonance")
PROTOCOLS = ("protocol=var", "protocol=stop")
# Settings of `avn.eval`; rows with exploration have the same networks.
RUNS = [
    *(
        [f"agent={row}", world, protocol]
        for world in WORLDS
        for protocol in PROTOCOLS
        for row in PLANNERS
    ),
    *([f"agent={row}", "acoustics=resonance"] for row in ACTOR_CRITICS),
    # three networks, as the table of conditions has
    *(
        ["agent=belief", "acoustics=diffraction", "protocol=stop", f"train_seed={seed}"]
        for seed in range(3)
    ),
    # one network each, as three would take more than 16 MB together with the others
    ["agent=belief", "acoustics=resonance", "protocol=stop"],
    ["agent=belief_told", "acoustics=diffraction", "protocol=stop"],
]


def weights_of(path: Path) -> dict[str, Tensor]:
    """Return the weights of a checkpoint, those with two or more dimensions in 16 bits."""
    kept = torch.load(path, map_location="cpu", weights_only=False)
    state = kept["state_dict"] if "state_dict" in kept else kept["network"]
    return {
        name: (own.half() if own.dim() > 1 and own.is_floating_point() else own).contiguous()
        for name, own in state.items()
    }


def publish(stage: Trained) -> dict[str, Any]:
    """Write the files of a trained network; return its entry in the index."""
    stage.check_weights()
    name = f"{stage.name}-{stage.fingerprint[:8]}"
    content = save(weights_of(stage.folder / BEST))
    (FOLDER / f"{name}.safetensors").write_bytes(content)
    sha256 = hashlib.sha256(content).hexdigest()
    metrics = {key: value for key, value in stage.metrics().items() if key != CHECKSUM}
    card = (stage.folder / CARD).read_text(encoding="utf-8")
    stored = f"- file: `{name}.safetensors`, SHA-256 `{sha256}`\n- weights: 16 bits\n"
    head, metric_table = card.split("\n## Metrics\n", 1)
    (FOLDER / f"{name}.md").write_text(
        f"{head.rstrip()}\n{stored}\n## Metrics\n{metric_table}", encoding="utf-8"
    )
    return {
        "fingerprint": stage.fingerprint,
        "name": name,
        "title": stage.title,
        "sha256": sha256,
        "metrics": metrics,
    }


def main(outputs: str) -> None:
    """Publish the networks of all runs that are trained in a folder of outputs."""
    stages: dict[str, Trained] = {}
    for run in RUNS:
        cfg, _ = compose_command("eval", [*run, f"outputs={outputs}"])
        for stage in with_needs([Evaluation(cfg)]):
            if isinstance(stage, Trained):
                stages.setdefault(stage.fingerprint, stage)
    FOLDER.mkdir(parents=True, exist_ok=True)
    index = FOLDER / INDEX
    before = json.loads(index.read_text(encoding="utf-8")) if index.is_file() else []
    known = {own["fingerprint"]: own for own in before}
    entries = []
    for fingerprint, stage in stages.items():
        if stage.done():
            entries.append(publish(stage))
        elif fingerprint in known:
            entries.append(known[fingerprint])
        else:
            print(f"not trained: {stage.title}")
    text = json.dumps(sorted(entries, key=lambda own: str(own["name"])), indent=1, sort_keys=True)
    index.write_text(text + "\n", encoding="utf-8")
    for path in FOLDER.iterdir():
        if path != index and path.stem not in {own["name"] for own in entries}:
            path.unlink()
    size = sum(path.stat().st_size for path in FOLDER.iterdir())
    print(f"{len(entries)} networks, {size / 1e6:.1f} MB")


if __name__ == "__main__":
    main(sys.argv[1])
