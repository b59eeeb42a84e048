"""Take the MIT KEMAR measurements out of the Debian package libmysofa1 and store them.

    apt-get download libmysofa1
    python scripts/extract_kemar.py libmysofa1_1.3.1~dfsg0-1_amd64.deb

The SOFA file is stored as it is, with the paragraph of the package's file of copyright that is
about it. `dpkg-deb` of Debian unpacks the package.
"""

import subprocess
import sys
import tempfile
from pathlib import Path

TARGET = Path(__file__).parents[1] / "src" / "avn" / "assets" / "hrirs"
SOURCE = "usr/share/libmysofa/MIT_KEMAR_normal_pinna.sofa"
COPYRIGHT = "usr/share/doc/libmysofa1/copyright"


def paragraph(text: str, name: str) -> str:
    """Return the paragraph of a Debian file of copyright that names a file."""
    for found in text.split("\n\n"):
        if name in found and found.lstrip().startswith("Files:"):
            return found.strip() + "\n"
    raise SystemExit(f"the file of copyright says nothing of {name}")


def main() -> None:
    """Write the SOFA file and its licence beside it."""
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run(["dpkg-deb", "-x", sys.argv[1], folder], check=True)
        measurements = (Path(folder) / SOURCE).read_bytes()
        licence = paragraph((Path(folder) / COPYRIGHT).read_text(), Path(SOURCE).name)
    TARGET.mkdir(parents=True, exist_ok=True)
    (TARGET / "mit_kemar_normal_pinna.sofa").write_bytes(measurements)
    (TARGET / "LICENSE.mit_kemar.txt").write_text(licence)
    print(f"wrote {TARGET / 'mit_kemar_normal_pinna.sofa'}")


if __name__ == "__main__":
    main()
