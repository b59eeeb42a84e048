"""Basic types and tools that all packages use."""
