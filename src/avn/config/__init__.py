"""Config schemas, command line, help and checks of settings."""
