"""docs/acoustics.md: its tables hold the materials of the code."""

from __future__ import annotations

from pathlib import Path

import pytest

from avn.acoustics.materials import BANDS, NAMES, TABLE, Material

PAGE = (Path(__file__).parents[2] / "docs" / "acoustics.md").read_text().splitlines()


def cells(kind: str, material: Material) -> list[str]:
    """The columns of a material in the table of a kind, without its name."""
    source = getattr(material, f"{kind}_source")
    if kind == "absorption" and material.estimated:
        source += ": an estimate"
    return [*(f"{value:.2f}" for value in getattr(material, kind)), source]


@pytest.mark.parametrize("kind", ["absorption", "scattering"])
def test_the_page_has_the_coefficients_and_sources_of_all_materials(kind: str) -> None:
    bands = [f"{band} Hz" if band < 1000 else f"{band // 1000} kHz" for band in BANDS]
    start = PAGE.index("| " + " | ".join([kind, *bands, "source"]) + " |") + 2
    wanted = ["| " + " | ".join([f"`{name}`", *cells(kind, TABLE[name])]) + " |" for name in NAMES]
    assert PAGE[start : start + len(NAMES)] == wanted
    assert PAGE[start + len(NAMES)] == ""


def test_the_page_names_the_estimates_and_every_reference() -> None:
    page = "\n".join(PAGE)
    estimates = [f"`{name}`" for name in NAMES if TABLE[name].estimated]
    assert f"{', '.join(estimates[:-1])} and {estimates[-1]}, are **estimates**" in page
    for material in TABLE.values():
        for source in (material.absorption_source, material.scattering_source):
            assert f"- {source[:3]} " in page
