"""Reading of recordings from unpacked Debian packages, wheels and sdists.

A package is a folder of that name, as `dpkg-deb -x`, `unzip` or `tar` unpack it. Inside it, a file
is named by its path or the end of it. Some files are themselves archives, of which a member is
named after a colon: `public.zip:audio/x.ogg`, `a.rcc:x.wav`, `FluidR3_GS.sf2:Dog Bark`.
"""

import io
import re
import struct
import subprocess
import zipfile
import zlib
from functools import cache
from math import gcd
from pathlib import Path

import imageio_ffmpeg
import numpy as np
import soundfile
from numpy.typing import NDArray
from scipy.signal import resample_poly

RATE = 16000
Samples = NDArray[np.float64]


def read(folder: Path, package: str, name: str) -> Samples:
    """Read a recording of an unpacked package, mixed to mono at 16 kHz.

    Parameters
    ----------
    folder : Path
        Folder of the unpacked packages.
    package : str
        Name of the package.
    name : str
        File of the package, with its member after a colon; for `flite`, a voice, a colon and a
        text to speak.
    """
    if package == "flite":
        return decode(spoken(folder, *name.split(":", 1)))
    file, _, member = name.partition(":")
    path = find(folder / package, file)
    if file.endswith(".sf2"):
        return sample_of_font(path, member)
    if file.endswith(".zip"):
        return decode(opened_zip(path).read(member))
    if file.endswith(".rcc"):
        return decode(member_of_rcc(bytes_of(path), member))
    if file.endswith(".g722"):
        return decode(from_g722(path))
    return decode(path.read_bytes())


@cache
def find(folder: Path, name: str) -> Path:
    """Find the file of a package whose path ends with a name."""
    found = [path for path in sorted(folder.rglob(Path(name).name)) if str(path).endswith(name)]
    if not found:
        raise SystemExit(f"{folder} has no {name}")
    return found[0]


@cache
def opened_zip(path: Path) -> zipfile.ZipFile:
    """Open an archive, once."""
    return zipfile.ZipFile(path)


@cache
def bytes_of(path: Path) -> bytes:
    """Read a file, once."""
    return path.read_bytes()


def decode(content: bytes) -> Samples:
    """Compute the mean of the channels of an audio file, at 16 kHz."""
    samples, rate = soundfile.read(io.BytesIO(content), dtype="float64", always_2d=True)
    return resampled(samples.mean(axis=1), rate)


def resampled(samples: Samples, rate: int) -> Samples:
    """Resample to 16 kHz."""
    common = gcd(RATE, rate)
    result: Samples = resample_poly(samples, RATE // common, rate // common)
    return result


def sample_of_font(path: Path, wanted: str) -> Samples:
    """Read a sample of a SoundFont by its name, at 16 kHz."""
    content = bytes_of(path)
    at = content.rfind(b"shdr")
    size = struct.unpack("<I", content[at + 4 : at + 8])[0]
    data = content.find(b"smpl", content.find(b"sdta")) + 8
    for header in range(at + 8, at + 8 + size, 46):
        raw, begin, end, _, _, rate = struct.unpack("<20s5I", content[header : header + 40])
        if raw.split(b"\0")[0].decode("latin1").strip() == wanted:
            samples = np.frombuffer(content, "<i2", end - begin, data + 2 * begin) / 2**15
            return resampled(samples, rate)
    raise SystemExit(f"{path} has no sample {wanted}")


def member_of_rcc(content: bytes, wanted: str) -> bytes:
    """Read a file of a Qt resource by its name."""
    version, tree, data, names = struct.unpack(">4I", content[4:20])
    size = 22 if version >= 2 else 14
    for node in range(tree, len(content) - size, size):
        name, flags = struct.unpack(">IH", content[node : node + 6])
        length = struct.unpack(">H", content[names + name : names + name + 2])[0]
        text = content[names + name + 6 : names + name + 6 + 2 * length].decode("utf-16-be")
        if text == wanted and not flags & 2:
            at = data + struct.unpack(">I", content[node + 10 : node + 14])[0]
            count = struct.unpack(">I", content[at : at + 4])[0]
            packed = content[at + 4 : at + 4 + count]
            return zlib.decompress(packed[4:]) if flags & 1 else packed
    raise SystemExit(f"no {wanted} in this resource")


def from_g722(path: Path) -> bytes:
    """Decode G.722 (16 kHz) to a WAV file with FFmpeg."""
    program = imageio_ffmpeg.get_ffmpeg_exe()
    command = [program, "-v", "error", "-f", "g722", "-i", str(path), "-f", "wav", "-"]
    return subprocess.run(command, check=True, capture_output=True).stdout


def spoken(folder: Path, voice: str, text: str) -> bytes:
    """Speak a text with a voice of Flite."""
    library = find(folder / "libflite1", "libflite.so.1").parent
    program = find(folder / "flite", "bin/flite")
    command = [str(program), "-voice", voice, "-t", text, "-o", "/dev/stdout"]
    done = subprocess.run(
        command, check=True, capture_output=True, env={"LD_LIBRARY_PATH": str(library)}
    )
    return done.stdout


def credits_of_sonic_pi(folder: Path, name: str) -> tuple[str, str]:
    """Read author and address of a CC0 sample from the package's copyright file or its README.

    The README says that all samples are CC0, and lists the address of each; the copyright file
    lists those of earlier versions.
    """
    package = folder / "sonic-pi-samples"
    text = find(package, "copyright").read_text()
    pattern = (
        rf"^Files: etc/samples/{re.escape(name)}\nCopyright: (.*)\nSource: (.*)\nLicense: CC0$"
    )
    if found := re.search(pattern, text, re.MULTILINE):
        return re.sub(r"^\d{4} ", "", found[1]), found[2]
    readme = find(package, "samples/README.md").read_text()
    for listed, url, author in re.findall(r"`:(\w+)` ?- (https?://\S+/people/([^/]+)/\S+)", readme):
        if listed.replace("_", "") == Path(name).stem.replace("_", ""):
            return author, url
    raise SystemExit(f"neither the copyright file nor the README states a licence for {name}")
