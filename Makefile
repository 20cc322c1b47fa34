# make run | test | lint | requirements | bench, each with ARGS="..."; the first one makes .venv and installs everything into it.
PYTHON ?= python3
BIN := .venv/bin

.PHONY: run test lint requirements bench clean

run: .venv/ready
	@$(BIN)/iiwa-sim $(ARGS)

test: .venv/ready
	$(BIN)/pytest --numprocesses auto --dist worksteal $(ARGS)

lint: .venv/ready
	$(BIN)/ruff check
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python -m tests.requirements --check

requirements: .venv/ready
	$(BIN)/python -m tests.requirements $(ARGS)

bench: .venv/ready
	@$(BIN)/python -m benchmarks.bench $(ARGS)

clean:
	rm -rf .venv build dist *.egg-info

.venv/ready: pyproject.toml setup.py
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo 'iiwa-sim needs Python 3.11 or newer as $(PYTHON); name another one: make PYTHON=python3.12 ...' >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
	  echo '$(PYTHON) cannot make virtual environments; on Debian and Ubuntu: sudo apt install python3-venv' >&2; exit 1; }
	@echo 'making .venv: this takes a minute, once'
	@$(PYTHON) -m venv .venv
	@$(BIN)/pip install --quiet --disable-pip-version-check --editable '.[dev]'
	@touch $@
