import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.stats import spearmanr

from avn.acoustics.ambisonics import sh
from avn.acoustics.brir import combine, render_direct_paths, render_source
from avn.acoustics.corners import diffracted_paths, sees
from avn.acoustics.direct_path import DirectPaths, band_energies, find_paths, screen_loss
from avn.acoustics.hrtf import load_sh_hrirs
from avn.acoustics.materials import SPEED_OF_SOUND
from avn.acoustics.settings import AcousticsConfig
from avn.apartments.floor_plan import Doorway, FloorPlan, Room
from avn.apartments.grid import build_grid
from avn.apartments.surfaces import build_surfaces
from avn.apartments.walls import walls
from avn.core.errors import UserError

RESONANCE = AcousticsConfig()
DIFFRACTION = AcousticsConfig(name="diffraction", direct_path="diffraction")
NO_AIR = AcousticsConfig(air=False)
NO_WALLS = np.zeros((0, 4))
EAR = np.array([[0.0, 0.0, 1.5]])
FINE = 1_536_000  # Hz: cross-correlations are interpolated to this


def around(degrees: float, distance: float = 2.0) -> NDArray[np.float64]:
    """A place at ear height, `degrees` to the right of north."""
    angle = np.deg2rad(degrees)
    return np.array([distance * np.sin(angle), distance * np.cos(angle), 1.5])


def responses(first: DirectPaths) -> NDArray[np.float64]:
    return first.samples * first.scale[:, None, None, None].astype(np.float64)


def cues(ears: NDArray[np.float64], rate: int) -> tuple[float, float]:
    """ITD in microseconds (positive: the right ear first) and ILD in dB (right louder).

    The ITD stems from below 1.5 kHz, where ears use it and third order holds; it is the peak of the
    cross-correlation, interpolated by zeros in its spectrum. The ILD is that up to 8 kHz.
    """
    size = rate // 10
    frequencies = np.fft.rfftfreq(size, 1 / rate)
    spectra = np.fft.rfft(ears, size) * (frequencies < 8000)
    cross = np.zeros(FINE // 20 + 1, dtype=complex)
    cross[: len(frequencies)] = spectra[0] * np.conj(spectra[1]) * (frequencies < 1500)
    correlation = np.fft.irfft(cross)
    lags = np.concatenate([np.arange(2000), np.arange(-2000, 0)])
    lag = lags[correlation[lags].argmax()]
    power = (np.abs(spectra) ** 2).sum(axis=1)
    return float(lag / FINE * 1e6), float(10 * np.log10(power[1] / power[0]))


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("degrees", [0, 30, 60, 90])
@pytest.mark.parametrize("heading", [0, 1, 2, 3])
def test_time_and_level_differences_are_those_of_the_hrirs(
    side: int, degrees: int, heading: int
) -> None:
    source = around(90 * heading + side * degrees)
    first = render_direct_paths(NO_WALLS, source, EAR, RESONANCE)
    time, level = cues(responses(first)[0, heading], RESONANCE.rate)
    # The set itself, at its own rate: the left ear, and as the right ear its mirror image.
    hrirs = load_sh_hrirs()
    mirrored = np.stack([around(side * degrees, 1.0), around(-side * degrees, 1.0)])
    weights = sh(mirrored * [1, 1, 0])
    wanted_time, wanted_level = cues(weights @ hrirs.ears[0], hrirs.rate)
    assert time == pytest.approx(wanted_time, rel=0.1, abs=5)
    assert level == pytest.approx(wanted_level, rel=0.1, abs=0.1)
    if degrees == 0:
        assert abs(time) < 5
        assert abs(level) < 0.1
    else:
        assert side * time > 200
        assert side * level > 5


def test_the_level_falls_as_one_over_distance() -> None:
    for distance in (0.5, 2.0, 7.0):
        first = render_direct_paths(NO_WALLS, around(0, distance), EAR, NO_AIR)
        energy = (responses(first)[0, 0] ** 2).sum(axis=-1).mean()
        assert energy == pytest.approx(1 / (4 * np.pi * distance**2), rel=1e-3)
        assert first.onset[0] == round(distance / SPEED_OF_SOUND * 16000)


def test_the_spectrum_does_not_betray_the_time_of_flight() -> None:
    """Arrivals start on whole samples: but for level and air, the taps do not depend on it."""
    near, far = (
        render_direct_paths(NO_WALLS, around(40, distance), EAR, NO_AIR)
        for distance in (1.0, 6.1234)
    )
    assert near.onset[0] != far.onset[0]
    assert np.abs(near.samples.astype(int) - far.samples).max() <= 1


def three_rooms() -> FloorPlan:
    rooms = tuple(
        Room("bedroom", x, 0.0, x + 3, 5.0, "parquet", "plaster", "ceiling_plaster")
        for x in (0.0, 3.0, 6.0)
    )
    return FloorPlan("three", rooms, (Doorway(3, 1, "y"), Doorway(6, 4, "y")))


def bearing(vector: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.rad2deg(np.arctan2(vector[..., 0], vector[..., 1]))


def test_round_corners_the_first_arrival_comes_from_the_doorway() -> None:
    source = np.array([1.0, 4.0, 1.0])
    receivers = np.array([[4.5, 3.0, 1.5], [5.5, 4.0, 1.5], [3.5, 2.5, 1.5]])
    paths = find_paths("diffraction", walls(three_rooms()), source, receivers)
    assert paths.bent.all()
    doorway = np.array([3.0, 1.0])
    off = bearing(paths.arrival[:, :2]) - bearing(doorway - receivers[:, :2])
    reach = np.linalg.norm(receivers[:, :2] - doorway, axis=1)
    # Within the half width of the doorway, as it is seen from there.
    assert (np.abs(off) < np.rad2deg(np.arctan2(0.46, reach))).all()
    # The straight line would come from elsewhere.
    straight = find_paths("transmission", walls(three_rooms()), source, receivers)
    away = np.abs(bearing(straight.arrival[:, :2]) - bearing(doorway - receivers[:, :2]))
    assert (away > 20).all()


def test_ears_hear_the_doorway_and_not_the_wall() -> None:
    """Facing west in the middle room, the doorway is on the left and the source on the right."""
    source, receiver = np.array([1.0, 4.5, 1.0]), np.array([[4.0, 3.0, 1.5]])
    for config, louder in ((DIFFRACTION, 0), (RESONANCE, 1)):
        first = render_direct_paths(walls(three_rooms()), source, receiver, config)
        energy = (responses(first)[0, 3] ** 2).sum(axis=-1)
        assert energy.argmax() == louder
        assert abs(10 * np.log10(energy[0] / energy[1])) > 3


def test_the_way_round_one_screen_is_the_length_of_its_legs() -> None:
    screen = np.array([[-10.0, -0.05, 1.0, 0.05]])
    source, receiver = np.array([-1.0, -2.0, 1.0]), np.array([[-1.0, 2.0, 1.5]])
    paths = diffracted_paths(screen, source, receiver)
    plan = 2 * np.hypot(2.0, 1.95) + 0.1
    assert paths.length[0] == pytest.approx(np.hypot(plan, 0.5), abs=0.01)
    assert paths.detour[0] == pytest.approx(paths.length[0] - np.sqrt(16.25), abs=1e-9)
    corner = np.array([1.0, 0.05]) - receiver[0, :2]
    assert paths.arrival[0, :2] / np.hypot(*paths.arrival[0, :2]) == pytest.approx(
        corner / np.hypot(*corner), abs=2e-3
    )
    assert np.linalg.norm(paths.arrival[0]) == pytest.approx(1.0)
    assert paths.arrival[0, 2] == pytest.approx(-0.5 / paths.length[0], abs=1e-3)


def test_the_screen_weakens_high_bands_more() -> None:
    assert screen_loss(np.zeros(1))[0] == pytest.approx([10 * np.log10(3)] * 6)
    loss = screen_loss(np.array([0.5]))[0]
    assert (np.diff(loss) > 2).all()
    # N = 2 x 0.5 m / 0.343 m at 1 kHz
    assert loss[3] == pytest.approx(10 * np.log10(3 + 20 / 0.343))


def test_rendered_bands_have_the_energy_of_the_formula() -> None:
    source, receiver = np.array([1.0, 4.0, 1.0]), np.array([[5.5, 4.0, 1.5]])
    plan_walls = walls(three_rooms())
    first = render_direct_paths(plan_walls, source, receiver, DIFFRACTION)
    paths = find_paths("diffraction", plan_walls, source, receiver)
    wanted = band_energies(paths)[0]
    free = render_direct_paths(NO_WALLS, receiver[0] + 2 * paths.arrival[0], receiver, NO_AIR)
    # Against the same direction in the open only the loss is left.
    spectra = [np.abs(np.fft.rfft(responses(f)[0, 3, 0], 16000)) for f in (first, free)]
    loss = (spectra[0] / spectra[1])[[250, 500, 1000, 2000, 4000]] ** 2 / (4 * np.pi * 4)
    assert 10 * np.log10(loss / wanted[1:]) == pytest.approx(np.zeros(5), abs=1.0)


def test_walls_in_sight_change_nothing() -> None:
    plan_walls = walls(three_rooms())
    source, receivers = np.array([1.0, 1.0, 1.0]), np.array([[2.0, 4.0, 1.5], [5.0, 1.0, 1.5]])
    one = find_paths("diffraction", plan_walls, source, receivers)
    other = find_paths("transmission", plan_walls, source, receivers)
    assert not one.bent.any()
    assert np.array_equal(one.length, other.length)
    assert np.array_equal(one.arrival, other.arrival)


def test_lines_that_graze_a_wall_see_and_lines_through_it_do_not() -> None:
    wall = np.array([[1.0, 0.0, 2.0, 4.0]])
    start = np.array([[0.0, 2.0], [0.0, 4.001], [1.5, 5.0], [1.5, 5.0], [0.0, 3.0]])
    end = np.array([[3.0, 2.0], [3.0, 4.001], [1.5, 4.001], [1.5, 3.0], [0.5, 3.0]])
    assert sees(wall, start, end).tolist() == [False, True, True, False, True]


def test_a_closed_room_lets_no_first_arrival_in() -> None:
    box = np.array([[2, 2, 4, 2.1], [2, 3.9, 4, 4], [2, 2, 2.1, 4], [3.9, 2, 4, 4]], dtype=float)
    receivers = np.array([[3.0, 3.0, 1.5], [1.0, 5.0, 1.5]])
    first = render_direct_paths(box, np.array([0.0, 0.0, 1.0]), receivers, DIFFRACTION)
    assert first.scale[0] == 0
    assert not first.samples[0].any()
    assert first.scale[1] > 0


def test_level_falls_with_the_way_to_walk() -> None:
    """In `diffraction`, over three rooms: first arrival and reverberation together."""
    plan = three_rooms()
    grid = build_grid(plan)
    source_cell = int(np.flatnonzero((grid.lattice == [2, 8]).all(axis=1))[0])
    receivers = np.column_stack([grid.centres, np.full(len(grid.centres), 1.5)])
    source = np.array([1.0, 4.0, 1.0])
    config = AcousticsConfig(name="diffraction", direct_path="diffraction", rays=3000, seconds=0.3)
    reverberation = render_source(build_surfaces(plan), source, receivers, config)
    whole = combine(reverberation, render_direct_paths(walls(plan), source, receivers, config))
    level = 10 * np.log10((whole**2).sum(axis=(1, 2, 3)))
    way = grid.distances[source_cell]
    assert spearmanr(level, way).statistic < -0.9
    rooms = [
        level[(grid.centres[:, 0] > x) & (grid.centres[:, 0] < x + 3)].mean() for x in (0, 3, 6)
    ]
    assert rooms[0] > rooms[1] + 3 > rooms[2] + 6


def test_direct_to_reverberant_ratio_out_of_sight_depends_on_the_regime() -> None:
    """At equal distances, out of sight against in sight, as `docs/acoustics.md` says.

    Through walls the direct sound keeps its strength, and reverberation does not.
    """
    plan = three_rooms()
    grid = build_grid(plan)
    receivers = np.column_stack([grid.centres, np.full(len(grid.centres), 1.5)])
    source = np.array([1.0, 4.0, 1.0])
    away = np.linalg.norm(receivers - source, axis=1)
    receivers = receivers[(away > 2.2) & (away < 3.8)]
    bent = find_paths("diffraction", walls(plan), source, receivers).bent
    assert min(bent.sum(), (~bent).sum()) >= 10
    config = AcousticsConfig(rays=1000, seconds=0.4)
    reverberation = render_source(build_surfaces(plan), source, receivers, config)
    tail = (reverberation.samples * reverberation.scale[:, None, None, None]) ** 2
    differences = []
    for own in (RESONANCE, DIFFRACTION):
        direct = responses(render_direct_paths(walls(plan), source, receivers, own)) ** 2
        ratio = 10 * np.log10(direct.sum(axis=(1, 2, 3)) / tail.sum(axis=(1, 2, 3)))
        differences.append(np.median(ratio[bent]) - np.median(ratio[~bent]))
    assert differences[0] > 1.0
    assert differences[1] < -5.0


def test_an_unknown_regime_is_named() -> None:
    with pytest.raises(UserError, match=r"acoustics.direct_path: 'teleport'.*diffraction"):
        find_paths("teleport", NO_WALLS, EAR[0], EAR)
