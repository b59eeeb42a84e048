"""Cache folders of an installation that cannot be written to, for a user without a home."""

import os
import stat

import pytest

from avn.core import caches

NAMES = ("NUMBA_CACHE_DIR", "MPLCONFIGDIR", "TORCHINDUCTOR_CACHE_DIR", "TRITON_CACHE_DIR")


@pytest.fixture
def bare(monkeypatch, tmp_path):
    """No variables, an installation that is read-only, no home, and a temporary folder."""
    for name in (*NAMES, "XDG_CACHE_HOME", "XDG_CONFIG_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", "/proc/nothing")
    monkeypatch.setattr(caches.tempfile, "gettempdir", lambda: str(tmp_path))
    monkeypatch.setattr(caches, "_pycaches", lambda: [caches.Path("/proc/nothing")])
    writable = caches._writable
    monkeypatch.setattr(
        caches, "_writable", lambda path: "/proc" not in str(path) and writable(path)
    )
    yield tmp_path
    for name in NAMES:
        os.environ.pop(name, None)


def test_without_a_home_the_temporary_folder_holds_the_caches(bare):
    caches.choose_cache_folders()
    folders = [os.environ[name] for name in NAMES]
    assert all(folder.startswith(f"{bare}/avn-{os.getuid()}/") for folder in folders)
    assert stat.S_IMODE(os.stat(bare / f"avn-{os.getuid()}").st_mode) == 0o700


def test_a_folder_that_others_can_write_to_is_not_taken(bare, monkeypatch):
    (bare / f"avn-{os.getuid()}").mkdir()
    (bare / f"avn-{os.getuid()}").chmod(0o777)
    disabled = []
    monkeypatch.setattr(caches, "_compile_without_cache", lambda: disabled.append(True))
    caches.choose_cache_folders()
    assert disabled
    assert "NUMBA_CACHE_DIR" not in os.environ


def test_variables_of_the_user_and_places_that_can_be_written_to_stay(bare, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", "/elsewhere")
    monkeypatch.setenv("HOME", str(bare))
    caches.choose_cache_folders()
    assert os.environ["NUMBA_CACHE_DIR"] == "/elsewhere"
    assert "MPLCONFIGDIR" not in os.environ


def test_the_cache_folder_of_the_user_comes_first(bare, monkeypatch):
    monkeypatch.setenv("HOME", str(bare))
    caches.choose_cache_folders()
    assert os.environ["NUMBA_CACHE_DIR"] == str(bare / ".cache" / "avn" / "numba")
