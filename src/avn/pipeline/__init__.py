"""Stages of the pipeline: data, trained networks, runs, tables and reports."""
