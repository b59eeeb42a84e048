"""SOFA files: what is read of them, and what is refused."""

import numpy as np
import pytest
import sofar
from ears import (
    delays,
    gains,
    heard,
    level_differences,
    pulses,
    sphere_points,
    time_differences,
    towards,
    write_head,
)

from avn.acoustics.heads import load_head
from avn.acoustics.sofa import read_sofa
from avn.core.errors import UserError

RATE = 48000
POINTS = sphere_points(300)
LEFT = np.array([[0.0, 0.09, 0.0], [0.0, -0.09, 0.0]])


def written(path, **changes):
    return read_sofa(write_head(path / "head.sofa", **changes))


def cartesian(directions: np.ndarray) -> np.ndarray:
    """SOFA's axes: x to the front, y to the left."""
    return np.stack([directions[:, 1], -directions[:, 0], directions[:, 2]], axis=1)


def test_directions_and_responses_are_those_written(tmp_path) -> None:
    found = written(tmp_path)
    np.testing.assert_allclose(found.directions, POINTS, atol=1e-9)
    wanted = pulses(delays(POINTS), RATE) * gains(POINTS)[..., None]
    np.testing.assert_allclose(found.responses, wanted, atol=1e-12)
    assert found.rate == RATE


def test_positions_may_be_cartesian(tmp_path) -> None:
    where = {"SourcePosition": 2 * cartesian(POINTS), "SourcePosition_Type": "cartesian"}
    found = written(tmp_path, **where, SourcePosition_Units="metre")
    np.testing.assert_allclose(found.directions, POINTS, atol=1e-9)


def test_the_listener_may_look_elsewhere(tmp_path) -> None:
    """A head that faces left and stands off the origin."""
    front, left, up = cartesian(POINTS).T
    place = np.array([[0.3, 0.2, 0.1]])
    turned = np.stack([-left, front, up], axis=1) + place
    found = written(
        tmp_path,
        SourcePosition=turned,
        SourcePosition_Type="cartesian",
        SourcePosition_Units="metre",
        ListenerPosition=place,
        ListenerView=[[0.0, 1.0, 0.0]],
    )
    np.testing.assert_allclose(found.directions, POINTS, atol=1e-9)


def test_the_left_ear_is_the_receiver_on_the_left(tmp_path) -> None:
    wanted = pulses(delays(POINTS), RATE) * gains(POINTS)[..., None]
    found = written(tmp_path, ReceiverPosition=LEFT[::-1].copy(), Data_IR=wanted[:, ::-1])
    np.testing.assert_allclose(found.responses, wanted, atol=1e-12)
    unknown = written(tmp_path, ReceiverPosition=np.zeros((2, 3)))
    np.testing.assert_allclose(unknown.responses, wanted, atol=1e-12)


def test_delays_beside_the_responses_count(tmp_path) -> None:
    directions = towards([-80, -20, 40, 90])
    alone = np.zeros((300, 1)) + gains(POINTS) * 0 + 1  # unit pulses, without delay
    path = write_head(
        tmp_path / "delays.sofa",
        Data_IR=pulses(np.zeros(1), RATE) * alone[..., None],
        Data_Delay=delays(POINTS) * RATE + 30,
    )
    wanted = delays(directions)
    times = time_differences(heard(load_head(str(path)).ears, directions), RATE)
    np.testing.assert_allclose(times, (wanted[:, 0] - wanted[:, 1]) * 1e6, rtol=0.1, atol=10)
    # one delay for all directions: the right ear hears 5 samples late
    same = written(tmp_path, Data_Delay=[[0.0, 5.0]])
    responses = written(tmp_path).responses[::10]
    found = time_differences(same.responses[::10], RATE) - time_differences(responses, RATE)
    np.testing.assert_allclose(found, -5 / RATE * 1e6, atol=6)


def test_a_file_of_one_sample_per_response_is_read(tmp_path) -> None:
    levels = np.ones((300, 2, 1)) * [[[1.0], [0.5]]]
    found = written(tmp_path, Data_IR=levels)
    assert found.responses.shape == (300, 2, 1)
    assert level_differences(found.responses, RATE)[0] == pytest.approx(-6.02, abs=0.01)


def refusal(path, **changes) -> str:
    with pytest.raises(UserError) as error:
        read_sofa(write_head(path / "head.sofa", **changes), "acoustics.head")
    text = str(error.value)
    assert text.startswith(f"acoustics.head: {path / 'head.sofa'}")
    assert "\n" not in text
    return text


def test_one_or_three_receivers_are_refused(tmp_path) -> None:
    for count in (1, 3):
        places = np.array([[0.0, 0.09 - 0.05 * i, 0.0] for i in range(count)])
        text = refusal(
            tmp_path, Data_IR=np.ones((300, count, 8)), ReceiverPosition=places,
            Data_Delay=np.zeros((1, count)),
        )  # fmt: skip
        assert f"it has {count} receivers; give a file of two ears" in text


def test_values_that_cannot_be_are_refused(tmp_path) -> None:
    broken = np.ones((300, 2, 8))
    broken[3, 1, 2] = np.nan
    assert "not finite" in refusal(tmp_path, Data_IR=broken)
    assert "an ear is silent" in refusal(tmp_path, Data_IR=np.ones((300, 2, 8)) * [[[1], [0]]])
    assert "sampling rate 4000 Hz" in refusal(tmp_path, Data_SamplingRate=4000)
    middle = np.zeros((300, 3))
    where = {"SourcePosition_Type": "cartesian", "SourcePosition_Units": "metre"}
    assert "head's centre" in refusal(tmp_path, SourcePosition=middle, **where)


def test_another_convention_is_refused(tmp_path) -> None:
    sofa = sofar.Sofa("SimpleFreeFieldHRTF")
    path = tmp_path / "head.sofa"
    sofar.write_sofa(str(path), sofa)
    with pytest.raises(UserError, match=r"convention SimpleFreeFieldHRTF; give one of SimpleFreeF"):
        read_sofa(path)


def test_files_that_are_no_sofa_files_are_refused(tmp_path) -> None:
    missing = tmp_path / "none.sofa"
    with pytest.raises(UserError, match=r"^acoustics\.head: .*none\.sofa: no such file"):
        read_sofa(missing)
    text = tmp_path / "text.sofa"
    text.write_text("not a measurement")
    empty = tmp_path / "empty.sofa"
    empty.write_bytes(b"")
    whole = write_head(tmp_path / "whole.sofa").read_bytes()
    half = tmp_path / "half.sofa"
    half.write_bytes(whole[: len(whole) // 2])
    for path in (text, empty, half):
        with pytest.raises(UserError, match=rf"^acoustics\.head: .*{path.name}: not a SOFA file"):
            read_sofa(path)


def test_few_directions_name_the_file(tmp_path) -> None:
    path = write_head(tmp_path / "few.sofa", count=20)
    with pytest.raises(UserError, match=r"^acoustics\.head: .*few\.sofa: 20 directions are"):
        load_head(str(path))
