"""AVN: audio-visual embodied navigation on a bare CPU machine."""

__version__ = "0.1.0"
