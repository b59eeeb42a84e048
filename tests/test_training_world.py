"""Networks of one world, evaluated in another: nothing is trained anew."""

from pathlib import Path

import pytest
import soundfile
from small import EYES, SMALL, fitting

from avn.acoustics.dry_sounds import read_sound
from avn.apartments.generator import generate

ROW = "agent=plan_noexp"


@pytest.fixture(scope="module")
def settings():
    world = [own for own in fitting(ROW, *SMALL, *EYES) if not own.startswith("sound=")]
    # rays and length belong to each world on its own
    return [own for own in world if not own.startswith(("acoustics.", "split="))]


ACOUSTICS = ("acoustics.rays=300", "acoustics.seconds=0.2")
TRAINING = tuple(f"training.{own}" for own in ACOUSTICS)


def networks(outputs):
    return {path.name for path in (outputs / "train").iterdir() if path.is_dir()}


def test_another_test_world_trains_nothing(command, outputs, settings, tmp_path):
    def run(*options):
        arguments = (ROW, *settings, f"outputs={outputs}", *options)
        code, out, err = command("eval", *arguments)
        assert code == 0, err
        return Path(out[-1])

    first = run("split=mini", *ACOUSTICS, "sound=alarm")
    trained = networks(outputs)
    assert len([name for name in trained if name.startswith("sound_cnn")]) >= 1

    louder = run("split=mini", *ACOUSTICS, "sound=alarm", "microphone.gain=0.5")
    regime = ("acoustics=diffraction", "training.acoustics=resonance")
    hidden = run("split=mini", *regime, *ACOUSTICS, *TRAINING, "sound=alarm")
    soundfile.write(tmp_path / "my.wav", read_sound("clock"), 16000)
    unheard = run("split=mini", *ACOUSTICS, f"sound={tmp_path}/my.wav")
    plan = generate(77, "home", sources=2, size="small")
    (tmp_path / "home.json").write_text(plan.to_json())
    elsewhere = (f"split.folder={tmp_path}", "split.name=new", "training.scenes=mini")
    home = run(*elsewhere, *ACOUSTICS, "sound=alarm")

    assert networks(outputs) == trained
    assert len({first, louder, hidden, unheard, home}) == 5
    assert "home" in (home / "results.csv").read_text()
    assert "diffraction" in (hidden / "results.csv").read_text()
    heard = [(folder / "source_estimates.csv").read_text() for folder in (first, louder, hidden)]
    assert len(set(heard)) == 3  # what is heard is another thing in each of them
