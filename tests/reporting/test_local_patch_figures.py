import numpy as np

from avn.reporting.local_patch_figures import local_patch_figure


def test_each_view_stands_beside_its_windows() -> None:
    rng = np.random.default_rng(0)
    views = rng.integers(0, 255, (3, 16, 16, 3)).astype(np.uint8)
    free, visible = rng.random((3, 5, 5)) < 0.5, rng.random((3, 5, 5)) < 0.7
    estimate = rng.random((3, 5, 5))
    figure = local_patch_figure(views, free, visible, estimate, "some")
    assert len(figure.axes) == 9
    assert np.array_equal(figure.axes[3].images[0].get_array(), views[1])
    assert np.array_equal(figure.axes[4].images[0].get_array(), free[1])
    assert np.array_equal(figure.axes[5].images[0].get_array(), estimate[1])
    # The nearest row lies at the bottom; hidden cells are hatched.
    assert figure.axes[4].images[0].origin == "lower"
    assert len(figure.axes[5].patches) == (~visible[1]).sum()
