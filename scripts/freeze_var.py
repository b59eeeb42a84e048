"""Choose and freeze the apartments of the benchmark split `var`.

The search is deterministic: it looks through the seeds of the generator in order, keeps
apartments that are as hard as the paper's, and chooses those whose free cells add up to the
paper's numbers (330 in training, 602 in the test). Run once; later changes of the generator
must not change the files.

    python scripts/freeze_var.py [--dry-run]
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from itertools import combinations
from pathlib import Path

import numpy as np
from hardness import Hardness, hardness

from avn.apartments.floor_plan import FloorPlan
from avn.apartments.generator import generate
from avn.apartments.grid import build_grid
from avn.apartments.splits import FROZEN
from avn.apartments.symmetry import layout_key, layout_similarity
from avn.reporting.floor_plan_figure import save_floor_plan

TRAIN_CELLS, TEST_CELLS = 330, 602
SUCCESS, SPL = 0.071, 0.043
# Success of the uniform walk that an apartment of the test may have.
BAND = (0.060, 0.086)
TRAIN_SEEDS, TEST_SEEDS = 80, 400
# No two apartments may look more alike than this.
ALIKE = 0.65
# Apartments that passed every check and that nobody would rent, found by looking.
DISLIKED: dict[str, tuple[int, ...]] = {"airy": (), "roomy": ()}


@dataclass(frozen=True)
class Candidate:
    """A candidate apartment."""

    plan: FloorPlan
    seed: int
    cells: int
    squares: int
    hardness: Hardness


def candidates(size: str, seeds: int, sources: int, band: tuple[float, float]) -> list[Candidate]:
    """Generate dissimilar apartments of a size whose difficulty is within the band."""
    found, seen = [], set()
    for seed in range(seeds):
        if seed in DISLIKED[size]:
            continue
        plan = generate(seed, "candidate", sources, size)
        grid = build_grid(plan)
        measured = hardness(plan, grid)
        key = layout_key(plan)
        if (
            band[0] <= measured.success <= band[1]
            and 150 <= grid.squares <= 200
            and key not in seen
        ):
            seen.add(key)
            found.append(Candidate(plan, seed, grid.cells, grid.squares, measured))
    return found


def choose_training(pool: list[Candidate]) -> list[Candidate]:
    """Choose the least similar pair of those with 330 cells in all."""
    pairs = [(a, b) for a, b in combinations(pool, 2) if a.cells + b.cells == TRAIN_CELLS]
    if not pairs:
        raise SystemExit(f"no pair of {len(pool)} apartments has {TRAIN_CELLS} cells")
    first, second = min(
        pairs, key=lambda p: (layout_similarity(p[0].plan, p[1].plan), p[0].seed, p[1].seed)
    )
    return [first, second]


def unlike(pool: list[Candidate], others: list[Candidate]) -> list[Candidate]:
    """Filter the pool for apartments dissimilar to the others and to earlier ones of the pool."""
    kept: list[Candidate] = []
    for candidate in pool:
        if all(layout_similarity(candidate.plan, c.plan) <= ALIKE for c in others + kept):
            kept.append(candidate)
    return kept


def choose_test(pool: list[Candidate]) -> list[Candidate]:
    """Choose five with 602 cells in all, of four and five rooms, nearest to the paper's walk."""
    best: tuple[float, tuple[Candidate, ...]] | None = None
    for five in combinations(pool, 5):
        rooms = [len(c.plan.rooms) for c in five]
        if sum(c.cells for c in five) != TEST_CELLS or not 2 <= rooms.count(5) <= 3:
            continue
        success = np.mean([c.hardness.success for c in five])
        spl = np.mean([c.hardness.spl for c in five])
        miss = abs(success - SUCCESS) + abs(spl - SPL)
        if best is None or miss < best[0] - 1e-12:
            best = (float(miss), five)
    if best is None:
        raise SystemExit(f"no five of {len(pool)} apartments have {TEST_CELLS} cells")
    return list(best[1])


def main() -> None:
    """Search, print what was chosen, and write the floor plans and their pictures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--dry-run", action="store_true", help="write nothing")
    parser.add_argument("--pictures", type=Path, default=Path("docs/floor_plans"))
    arguments = parser.parse_args()
    training = choose_training(candidates("airy", TRAIN_SEEDS, 10, (0.0, 1.0)))
    pool = candidates("roomy", TEST_SEEDS, 5, BAND)
    # Nearest to the mean size first, as many as can be searched through.
    pool.sort(key=lambda c: (abs(c.cells - TEST_CELLS / 5), c.seed))
    print(f"{len(pool)} apartments may be in the test")
    pool = unlike(pool[:120], training)
    test = choose_test(pool[:32])
    spare = [c for c in pool if c not in test and 110 <= c.cells <= 130]
    spare.sort(key=lambda c: (abs(c.hardness.success - SUCCESS), c.seed))
    chosen = {f"train_{i + 1}": c for i, c in enumerate(training)}
    chosen |= {f"room_{i + 1}": c for i, c in enumerate(sorted(test, key=lambda c: c.seed))}
    chosen |= {f"val_{i + 1}": c for i, c in enumerate(spare[:3])}
    for name, c in chosen.items():
        plan = replace(c.plan, name=name)
        figures = " ".join(f"{k} {v:.3f}" for k, v in vars(c.hardness).items())
        print(f"{name}: seed {c.seed}, {c.cells} cells, {c.squares} squares, {figures}")
        if not arguments.dry_run:
            (FROZEN / "var").mkdir(parents=True, exist_ok=True)
            (FROZEN / "var" / f"{name}.json").write_text(plan.to_json(), encoding="utf-8")
            save_floor_plan(plan, arguments.pictures / f"{name}.png")
    rows = np.array([list(vars(c.hardness).values()) for c in test])
    print("test mean:", dict(zip(vars(test[0].hardness), rows.mean(axis=0).round(4), strict=True)))


if __name__ == "__main__":
    main()
