# make run | test | test-slow | requirements | docs | bench | mutants, each with ARGS="..." if need be, or make lint | image;
# all but the last make .venv when there is none, and install everything into it.
# Kernels (iiwa_sim/**/*_kernel.py) whose text was edited are compiled before; make kernels does only that.
PYTHON ?= python3
BIN := .venv/bin
# Each worker of the tests and each process they start would compile our modules anew where an environment asks for no bytecode.
unexport PYTHONDONTWRITEBYTECODE
KERNELS := $(shell find iiwa_sim -name '*_kernel.py' -o -name '*_kernel.pxd')

.PHONY: run test test-slow lint requirements docs bench kernels mutants image clean

run: .venv/kernels
	@$(BIN)/iiwa-sim $(ARGS)

test: .venv/kernels
	$(BIN)/pytest --numprocesses auto --dist worksteal -m 'not slow' $(ARGS)

test-slow: .venv/kernels
	HYPOTHESIS_PROFILE=many $(BIN)/pytest --numprocesses auto --dist worksteal -m 'slow or hypothesis' $(ARGS)

lint: .venv/kernels
	$(BIN)/ruff check
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python -m tools.requirements --check

requirements: .venv/kernels
	$(BIN)/python -m tools.requirements $(ARGS)

docs: .venv/kernels
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict $(ARGS)

bench: .venv/kernels
	@$(BIN)/python -m benchmarks.bench $(ARGS)

mutants: .venv/kernels
	@$(BIN)/python -c 'import mutmut' 2>/dev/null || $(BIN)/pip install --quiet --disable-pip-version-check --editable '.[mutants]'
	@$(BIN)/python -m tools.mutants $(ARGS)

image:
	@$(PYTHON) .ci/image

clean:
	rm -rf .venv build dist mutants *.egg-info
	find iiwa_sim '(' -name '*.so' -o -name '*.stamp' ')' -delete

.venv/kernels: $(KERNELS)
kernels .venv/kernels: .venv/ready
	@$(BIN)/python build_backend.py
	@touch .venv/kernels

.venv/ready: pyproject.toml setup.py build_backend.py
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo 'iiwa-sim needs Python 3.11 or newer as $(PYTHON); name another one: make PYTHON=python3.12 ...' >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
	  echo '$(PYTHON) cannot make virtual environments; on Debian and Ubuntu: sudo apt install python3-venv' >&2; exit 1; }
	@echo 'making .venv: this takes some minutes, once'
	@$(PYTHON) -m venv .venv
	@$(BIN)/pip install --quiet --disable-pip-version-check --editable '.[dev]'
	@touch $@
