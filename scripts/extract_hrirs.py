"""Take the third-order SH-HRIRs out of the npm package omnitone and store them as one WAV file.

    npm pack omnitone@1.3.0
    python scripts/extract_hrirs.py omnitone-1.3.0.tgz

The package holds them as eight stereo WAV files in base64, two ambisonic channels in each. They
are joined to one WAV file of 16 channels (ACN order, SN3D), sample for sample, at 48 kHz.
"""

import base64
import io
import re
import sys
import tarfile
from pathlib import Path

import numpy as np
import soundfile

TARGET = Path(__file__).parents[1] / "src" / "avn" / "assets" / "hrirs"
SOURCE = "package/build/omnitone.esm.js"
LICENCE = "package/LICENSE"
CHANNELS, TAPS, RATE = 16, 256, 48000


def read_member(archive: tarfile.TarFile, name: str) -> bytes:
    """Read the bytes of one file of the package."""
    member = archive.extractfile(name)
    if member is None:
        raise SystemExit(f"{name} is not in the archive")
    return member.read()


def decode(script: str) -> np.ndarray:
    """Decode the (256, 16) PCM16 samples of the list `OmnitoneTOAHrirBase64`."""
    found = re.search(r"const OmnitoneTOAHrirBase64 = \[(.*?)\];", script, re.S)
    if found is None:
        raise SystemExit("OmnitoneTOAHrirBase64 is not in the script")
    pairs = []
    for text in re.findall(r'"([A-Za-z0-9+/=]+)"', found.group(1)):
        samples, rate = soundfile.read(io.BytesIO(base64.b64decode(text)), dtype="int16")
        if samples.shape != (TAPS, 2) or rate != RATE:
            raise SystemExit(f"unexpected layout: {samples.shape} at {rate} Hz")
        pairs.append(samples)
    joined = np.concatenate(pairs, axis=1)
    if joined.shape[1] != CHANNELS:
        raise SystemExit(f"expected {CHANNELS} channels, found {joined.shape[1]}")
    return joined


def main() -> None:
    """Write the WAV file and the licence beside it."""
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    with tarfile.open(sys.argv[1]) as archive:
        samples = decode(read_member(archive, SOURCE).decode())
        licence = read_member(archive, LICENCE)
    TARGET.mkdir(parents=True, exist_ok=True)
    soundfile.write(TARGET / "omnitone_third_order.wav", samples, RATE, subtype="PCM_16")
    (TARGET / "LICENSE.omnitone.txt").write_bytes(licence)
    print(f"wrote {TARGET / 'omnitone_third_order.wav'}")


if __name__ == "__main__":
    main()
