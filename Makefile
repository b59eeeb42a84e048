# A newcomer's commands: `make demo`, `make table` and `make test`; `make reproduce` trains all networks.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin

.PHONY: demo table reproduce test check lowest benchmarks docs clean

demo: $(VENV)/installed
	$(BIN)/python -m avn.demo

table: $(VENV)/installed
	$(BIN)/python -m avn.reproduce networks=published seeds=0

reproduce: $(VENV)/installed
	$(BIN)/python -m avn.reproduce

test: check
	$(BIN)/python -m pytest

check: $(VENV)/installed
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports

lowest: $(VENV)/installed
	$(BIN)/python scripts/lowest_versions.py $(VENV)-lowest

benchmarks: $(VENV)/installed
	for benchmark in benchmarks/*.py; do $(BIN)/python $$benchmark || exit 1; done

docs: $(VENV)/docs-installed
	$(BIN)/mkdocs build --strict

$(VENV)/docs-installed: $(VENV)/installed
	$(BIN)/python -m pip install --quiet --editable ".[docs]"
	touch $@

$(VENV)/installed: pyproject.toml
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --editable ".[dev]"
	touch $@

clean:
	rm -rf $(VENV) $(VENV)-lowest site
