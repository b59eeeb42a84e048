"""Freeze the apartments of `split=homes`: write the hashes of their floor plans.

All apartments are taken as they are generated, by their numbers. The script also prints how many
draws of the generator were not valid. Run once for each version of the split:

    python scripts/freeze_homes.py [--dry-run]
"""

from __future__ import annotations

import argparse
from collections import Counter
from pathlib import Path

import yaml

from avn.apartments.frozen_hashes import FrozenApartment, floor_plan_hash, write_table
from avn.apartments.settings import SplitConfig
from avn.apartments.splits import PARTS, draw_apartment

CONFIG = Path(__file__).parents[1] / "conf" / "split" / "homes.yaml"


def main() -> None:
    """Generate all apartments, print what came of the draws, and write the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--dry-run", action="store_true", help="write nothing")
    arguments = parser.parse_args()
    cfg = SplitConfig(**yaml.safe_load(CONFIG.read_text(encoding="utf-8")))
    table: dict[str, list[FrozenApartment]] = {part: [] for part in PARTS}
    for part in PARTS:
        tally: Counter[str] = Counter()
        for number in range(getattr(cfg, part)):
            before = tally.total()
            plan = draw_apartment(cfg, part, number, tally=tally)
            skip = tally.total() - before - 1
            table[part].append(FrozenApartment(skip, floor_plan_hash(plan)))
        print(part, dict(sorted(tally.items())))
    if not arguments.dry_run:
        write_table("homes", cfg, table)


if __name__ == "__main__":
    main()
