import numpy as np
import pytest
from drawn_walks import ours, walked

from avn.agents.greedy import Greedy
from avn.agents.random_walk import RandomWalk
from avn.reporting.trajectory_figures import RUN_COLOURS, estimate_figure, trajectory_figure


def test_each_run_has_its_line_in_each_episode() -> None:
    runs = [walked(ours(), [0, 1, 2]), walked(Greedy(), [0, 1, 2])]
    figure = trajectory_figure(list(zip(*runs, strict=True)), ["ours", "greedy"])
    panels = [axes for axes in figure.axes if axes.get_visible()]
    assert len(panels) == 3
    for axes, *traces in zip(panels, *runs, strict=True):
        handles, labels = axes.get_legend_handles_labels()
        for index, (line, trace) in enumerate(zip(handles, traces, strict=True)):
            assert line.get_color() == RUN_COLOURS[index]
            # moved a little, so that both are seen, and by less than a cell
            off = line.get_xydata() - trace.path
            assert np.ptp(off, axis=0) == pytest.approx(0)
            assert np.abs(off).max() < 0.1
        assert labels[0].startswith("ours: success")
        assert "scene" not in axes.get_title()
        assert "episode" in axes.get_title()


def test_estimates_are_drawn_where_they_were_heard() -> None:
    trace = walked(Greedy(), [3])[0]
    axes = estimate_figure(trace, "greedy").axes
    dots = axes[0].collections[-1].get_offsets()
    np.testing.assert_allclose(dots, np.tile(trace.goal, (len(trace.state), 1)), atol=1e-5)
    error, away = (line.get_ydata() for line in axes[1].lines)
    assert np.abs(error).max() < 1e-5
    assert away[0] == pytest.approx(np.linalg.norm(trace.path[0] - trace.goal))


def test_an_agent_that_does_not_hear_has_no_estimates() -> None:
    trace = walked(RandomWalk(), [0])[0]
    # its simulator lets it hear, and it does not listen; one without ears:
    deaf = type(trace)(**{**vars(trace), "source_estimates": None})
    with pytest.raises(ValueError, match="no source estimates"):
        estimate_figure(deaf, "random_walk")
