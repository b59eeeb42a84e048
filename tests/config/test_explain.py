"""Messages for mistakes on the command line, as the commands print them."""

from __future__ import annotations

import numpy as np
import pytest
import soundfile


@pytest.mark.parametrize(
    ("given", "printed"),
    [
        ("agent=foo", "agent: there is no 'foo'; there are a3c_v, "),
        ("condition=hard", "condition: there is no 'hard'; there are distractor, "),
        (
            "condition=[heard,silence]",
            "condition=[heard,silence]: a list; name one condition, to which settings can "
            "be added, such as condition=silence odometry=noisy",
        ),
        (
            "condition=silence,unheard",
            "condition=silence,unheard: several values; add -m for a run with each",
        ),
        ("sound=ring,clock", "several values; put brackets round a list or quotes round a text, "),
        ("training.sounds=ring,clock", "training.sounds=ring,clock: several values; put brackets"),
        ("microphone=white microphone.snr=3,10", "microphone.snr=3,10: several values; put brack"),
        ("sound=[]", "sound: empty; give a recording, such as sound=ring"),
        ("sound=", "sound=: name an option; there are alarm, "),
        ("microphone=white microphone.snr=3", "microphone.snr=3; give a list, such as [0, 1]"),
        (
            "schedule=intermittent schedule.meen=3",
            "'schedule.meen'; Key 'meen' not in 'ScheduleSettings'; there are name, begins, mean",
        ),
    ],
)
def test_a_mistake_is_one_line_that_names_the_option_and_what_to_do(
    command, tmp_path, given, printed
):
    code, _, err = command("eval", "split=mini", *given.split(), f"outputs={tmp_path}")
    assert code == 2
    assert len(err) == 1
    assert printed in err[0]
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("given", "printed"),
    [
        ("condition=unheard", "condition: no group of this command; avn.reproduce has conditions="),
        ("agent=belief", "agent: no group of this command; avn.reproduce has rows="),
    ],
)
def test_a_group_of_eval_is_no_group_of_reproduce(command, tmp_path, given, printed):
    code, _, err = command("reproduce", given, f"outputs={tmp_path}")
    assert code == 2
    assert err == [f"avn.reproduce: {printed}"]


def test_a_recording_with_an_unknown_ending_is_not_said_to_be_missing(command, tmp_path):
    path = tmp_path / "phone.xyz"
    soundfile.write(path, np.ones(100), 16000, format="WAV")
    code, _, err = command("eval", "split=mini", f"sound={path}", f"outputs={tmp_path}")
    assert code == 2
    assert f"sound: '{path}': its ending is none of .wav, " in err[0]
