import numpy as np
import pytest
from matplotlib.figure import Figure
from synthetic_scene import synthetic_scene

from avn.apartments.grid import goal_cells
from avn.reporting.stop_figures import curves_figure, reliability, roc, stop_map


def test_roc_of_hand_made_scores() -> None:
    axes = Figure().add_subplot()
    roc(axes, np.array([0.9, 0.7, 0.3, 0.1]), np.array([1, 0, 1, 0]))
    alarms, hits = axes.lines[0].get_data()
    assert alarms.tolist() == [0, 0.5, 0.5, 1]
    assert hits.tolist() == [0.5, 0.5, 1, 1]


def test_calibration_is_drawn_where_something_was_said() -> None:
    axes = Figure().add_subplot()
    reliability(axes, np.array([0.9, 0.9, 0.9, 0.1]), np.array([1, 0, 0, 0]))
    prediction, found = axes.lines[1].get_data()
    assert prediction.tolist() == pytest.approx([0.1, 0.9])
    assert found.tolist() == pytest.approx([0, 1 / 3])


def test_the_map_shows_the_mean_over_headings_and_the_goal() -> None:
    scene = synthetic_scene()
    goal = goal_cells(scene.grid)[scene.sources[0]]
    probability = np.linspace(0, 1, 4 * scene.grid.cells)
    figure = stop_map(scene.plan, scene.grid.lattice, probability, goal, "scene")
    drawn, circled = figure.axes[0].collections
    np.testing.assert_allclose(drawn.get_array(), probability.reshape(-1, 4).mean(1))
    assert len(circled.get_offsets()) == goal.sum()


def test_curves_have_two_parts() -> None:
    figure = curves_figure(np.array([0.9, 0.2]), np.array([1.0, 0.0]), "both")
    assert [axes.get_title() for axes in figure.axes] == ["ROC", "calibration"]
