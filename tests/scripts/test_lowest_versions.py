"""Bounds of the dependencies."""

import pytest
from lowest_versions import lowest, pins, requirements
from packaging.specifiers import SpecifierSet
from packaging.version import Version

BY_NAME = {own.name: own.specifier for own in requirements()}
# Stubs of types, which follow the versions of what they describe.
STUBS = ("pandas-stubs", "scipy-stubs", "types-PyYAML")


@pytest.mark.parametrize("requirement", requirements(), ids=str)
def test_each_dependency_has_a_lowest_version_that_it_admits(requirement):
    if requirement.name in STUBS:
        return
    version = lowest(requirement)
    assert version is not None
    assert requirement.specifier.contains(version)


def test_one_dependency_has_the_same_bounds_everywhere():
    for own in requirements():
        assert BY_NAME[own.name] == own.specifier


def test_the_versions_to_install_are_one_for_each_dependency():
    names = [pin.split("==")[0] for pin in pins()]
    assert len(set(names)) == len(names)
    assert {"torch", "numpy", "pytest"} <= set(names)
    assert "torch==2.7" in pins()


@pytest.mark.parametrize(
    ("name", "refused", "admitted"),
    [
        ("lightning", ["2.6.2", "2.6.3"], ["2.6.1", "2.6.6"]),
        # two generations of Embree would give two kinds of views
        ("embreex", ["2.17.7", "5.0"], ["4.4.0"]),
        # `Collector(track_traj_ids=...)`; both are released together
        ("torchrl", ["0.12.0", "0.15.0"], ["0.13.1", "0.14.1"]),
        ("tensordict", ["0.12.0", "0.15.0"], ["0.13.0", "0.14.3"]),
        ("gymnasium", ["1.0.0"], ["1.1.0"]),
        # earlier ones write the time into a file
        ("h5py", ["3.14.0"], ["3.16.0"]),
        # 2.16 needs TensorFlow
        ("tensorboard", ["2.16.1"], ["2.17.0"]),
    ],
)
def test_versions_that_cannot_work_are_refused(name, refused, admitted):
    bounds: SpecifierSet = BY_NAME[name]
    assert not [version for version in refused if bounds.contains(Version(version))]
    assert all(bounds.contains(Version(version)) for version in admitted)
