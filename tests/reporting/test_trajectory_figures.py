from dataclasses import replace

import numpy as np
import pytest
from drawn_walks import FLAT, ours, walked
from small_places import STOP

from avn.agents.greedy import Greedy
from avn.agents.random_walk import RandomWalk
from avn.agents.recorder import Recorder
from avn.agents.rollout import Labels, records, rollout
from avn.navigation.distractor import Distractor
from avn.navigation.dynamics import Dynamics
from avn.navigation.episodes import exhaustive_episodes
from avn.navigation.navigation_scene import draw
from avn.navigation.simulator import Simulator
from avn.navigation.trace import Trace
from avn.reporting.trajectory_figures import (
    RUN_COLOURS,
    estimate_figure,
    outcome,
    trajectory_figure,
)


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


def beside_a_distractor() -> list[Trace]:
    """Traces of a random walk in a flat with two sources, one of which is the distractor."""
    scene = draw("flat", FLAT.replace("a", "A", 1))
    episodes = exhaustive_episodes(scene, ["bark", "ring"], STOP, 0)
    dynamics = Dynamics(distractor=Distractor({"bark": "dog", "ring": "telephone"}))
    world = Simulator(scene, episodes, STOP, None, dynamics)
    recorder = Recorder({"flat": range(len(world))}, 1, beliefs=False)
    rollout(RandomWalk(), world, recorder)
    rows = records(world, Labels("random_walk", "resonance")).to_dict("records")
    return [recorder.trace("flat", row, rows[row]) for row in range(len(world))]


def test_a_distractor_is_a_diamond_where_it_is() -> None:
    traces = beside_a_distractor()
    places = traces[0].scene.grid.centres[traces[0].scene.sources]
    assert {trace.source for trace in traces} == {0, 1}
    for trace in traces[:: len(traces) // 7]:
        assert trace.distractor == pytest.approx(places[1 - trace.source])
        figure = trajectory_figure([[trace]], ["random_walk"])
        diamonds = [line for line in figure.axes[0].lines if line.get_marker() == "D"]
        assert [line.get_xydata()[0].tolist() for line in diamonds] == [trace.distractor.tolist()]
        assert "distractor" in [text.get_text() for text in figure.legends[0].get_texts()]
        word = outcome(trace).split(",")[0]
        assert (word == "stopped at the distractor") == bool(trace.record["stopped_at_distractor"])
    there = next(trace for trace in traces if trace.record["stopped_at_distractor"])
    # where both sources are near, a success stays one
    both = replace(there, record={**there.record, "success": 1, "outcome": "success"})
    assert outcome(there).startswith("stopped at the distractor")
    assert outcome(both).startswith("success")


def test_without_a_distractor_there_is_no_diamond() -> None:
    trace = walked(ours(), [0])[0]
    assert trace.distractor is None
    figure = trajectory_figure([[trace]], ["ours"])
    assert all(line.get_marker() != "D" for line in figure.axes[0].lines)
    assert "distractor" not in [text.get_text() for text in figure.legends[0].get_texts()]


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
