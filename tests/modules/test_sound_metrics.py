import numpy as np
import pytest
import torch

from avn.modules.sound_metrics import LocationErrors, location_errors


def test_errors_of_known_locations() -> None:
    estimate = torch.tensor([[3.0, 4.0], [0.0, -2.0], [1.0, 1.0], [0.0, 0.0]])
    target = torch.tensor([[0.0, 0.0], [0.0, 2.0], [1.0, 0.0], [2.0, 0.0]])
    metres, degrees = location_errors(estimate, target)
    torch.testing.assert_close(metres, torch.tensor([5.0, 4.0, 1.0, 2.0]))
    torch.testing.assert_close(degrees, torch.tensor([0.0, 180.0, 45.0, 0.0]))


def test_medians_by_sight_and_sound_over_batches() -> None:
    generator = torch.Generator().manual_seed(0)
    estimate, target = torch.randn(2, 300, 2, generator=generator)
    in_sight = torch.rand(300, generator=generator) < 0.4
    sound = torch.randint(2, (300,), generator=generator)
    errors = LocationErrors(("ring", "clock"))
    for part in torch.arange(300).split(77):
        errors.update(estimate[part], target[part], in_sight[part], sound[part])
    found = errors.compute()
    metres = np.hypot(*(estimate - target).numpy().T)
    chosen = in_sight.numpy() & (sound.numpy() == 1)
    assert float(found["error_m/in_sight/clock"]) == pytest.approx(np.median(metres[chosen]))
    assert float(found["error_m/all/all"]) == pytest.approx(np.median(metres))
    angles = np.degrees(
        [
            abs((np.arctan2(*e) - np.arctan2(*t) + np.pi) % (2 * np.pi) - np.pi)
            for e, t in zip(estimate.numpy(), target.numpy(), strict=True)
        ]
    )
    out = float(found["bearing_deg/out_of_sight/all"])
    assert out == pytest.approx(np.median(angles[~in_sight.numpy()]), rel=1e-4)
    assert len(found) == 18


def test_group_without_clips_is_left_out() -> None:
    errors = LocationErrors(("ring", "clock"))
    row = torch.zeros(1, 2)
    errors.update(row, row, torch.tensor([True]), torch.tensor([0]))
    assert "error_m/in_sight/ring" in errors.compute()
    assert not any("out_of_sight" in name or "clock" in name for name in errors.compute())
