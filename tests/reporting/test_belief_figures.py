import numpy as np
import pytest
from drawn_walks import hearing, ours, walked

from avn.agents.greedy import Greedy
from avn.reporting.belief_figures import PANELS, belief_figure, memory_figure


def test_the_belief_grows_from_the_first_step_to_the_last() -> None:
    trace = max(walked(ours()), key=lambda own: len(own.action))
    assert trace.beliefs is not None
    assert trace.beliefs.free is not None
    panels = [axes for axes in belief_figure(trace, "ours").axes if axes.images]
    assert len(panels) == min(PANELS, len(trace.action))
    first, last = (panels[end].images[0].get_array() for end in (0, -1))
    np.testing.assert_allclose(first, trace.beliefs.free[0] / 255)
    np.testing.assert_allclose(last, trace.beliefs.free[-1] / 255)
    known = [(np.abs(belief - 0.5) > 0.01).sum() for belief in (first, last)]
    assert known[0] < known[1]
    # the image lies in metres: its corner is half a cell from the centre of its first square
    left, _, bottom, _ = panels[0].images[0].get_extent()
    np.testing.assert_allclose([left, bottom], trace.beliefs.low * 0.5 - 0.25)


def test_the_memory_is_drawn_with_its_walk_and_what_it_returned() -> None:
    trace = walked(ours(explores=True), [0])[0]
    assert trace.exploration_trajectory is not None
    assert trace.beliefs is not None
    assert trace.beliefs.retrieved is not None
    left, right = memory_figure(trace, "ours").axes[:2]
    lines = dict(zip(*reversed(left.get_legend_handles_labels()), strict=True))
    centres = trace.scene.grid.centres
    np.testing.assert_allclose(
        lines["exploration walk"].get_xydata(), centres[trace.exploration_trajectory // 4]
    )
    np.testing.assert_allclose(
        lines["most similar entry"].get_xydata(), trace.beliefs.retrieved[:, 0, :2]
    )
    assert (right.lines[1].get_ydata() == 0).all()  # odometry does not lie here


def test_dots_are_on_their_squares_with_the_area_of_the_probability() -> None:
    trace = max(walked(hearing()), key=lambda own: len(own.action))
    beliefs = trace.beliefs
    assert beliefs is not None
    assert beliefs.posterior is not None
    figure = belief_figure(trace, "belief")
    last = [axes for axes in figure.axes if axes.images][-1]
    dots = last.collections[-1]
    shares = beliefs.posterior[-1] / 255
    np.testing.assert_allclose(dots.get_sizes(), dots.get_sizes().max() * shares.ravel())
    y, x = np.unravel_index(shares.argmax(), shares.shape)
    place = dots.get_offsets()[shares.argmax()]
    np.testing.assert_allclose(place, 0.5 * (beliefs.low + np.array([x, y])))
    assert "where the source may be" in figure.legends[0].get_texts()[-1].get_text()


@pytest.mark.parametrize("words", [3, 60])
def test_caption_legend_and_panels_do_not_overlap(words) -> None:
    trace = max(walked(hearing()), key=lambda own: len(own.action))
    figure = belief_figure(trace, "belief", " ".join(["acoustics"] * words))
    figure.canvas.draw()
    legend = figure.legends[0].get_window_extent()
    (caption,) = (text for text in figure.texts if text.get_text().endswith("acoustics"))
    lines = caption.get_text().split("\n")
    box = caption.get_window_extent()
    # the first lines are empty, and leave room for the legend
    shown = box.y0 + box.height * sum(map(bool, lines)) / len(lines)
    assert legend.y0 >= shown - 1
    assert all(axes.get_tightbbox().y0 >= legend.y1 for axes in figure.axes if axes.images)


def test_agents_without_maps_have_no_such_pictures() -> None:
    trace = walked(Greedy(), [0])[0]
    with pytest.raises(ValueError, match="no map"):
        belief_figure(trace, "greedy")
    with pytest.raises(ValueError, match="no memory"):
        memory_figure(trace, "greedy")
    with pytest.raises(ValueError, match="no memory"):
        memory_figure(walked(ours(), [0])[0], "ours")
