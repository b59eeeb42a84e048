"""Apartments of one's own: floor plans as JSON in a folder, by hand or changed from drawn ones."""

import dataclasses
from pathlib import Path

from avn.apartments.generator import generate

folder = Path("my_apartments")
folder.mkdir(exist_ok=True)
for seed, name in ((11, "train_1"), (12, "val_1"), (13, "home")):
    plan = generate(seed, name, sources=2, size="small")
    if name == "home":  # the test apartment: without furniture, and with one source
        plan = dataclasses.replace(plan, furniture=(), sources=plan.sources[:1])
    (folder / f"{name}.json").write_text(plan.to_json())
print("python -m avn.eval agent=greedy split.folder=my_apartments split.name=mine")
