# make run | test | test-slow | docs | bench, each with ARGS="..." if need be, or make lint | nightly | image | clean.
# Each makes .venv when there is none, adds what it needs to it, and compiles the kernels that were edited.
PYTHON ?= python3
BIN := .venv/bin
PIP := $(BIN)/pip --quiet --disable-pip-version-check
# Each worker of the tests and each process they start would compile our modules anew where an environment asks for no bytecode.
unexport PYTHONDONTWRITEBYTECODE
KERNELS := $(shell find iiwa_sim -name '*_kernel.py' -o -name '*_kernel.pxd')

.PHONY: run test test-slow lint docs bench nightly image clean

run: .venv/kernels
	@$(BIN)/iiwa-sim $(ARGS)

test: .venv/test
	$(BIN)/pytest --numprocesses auto --dist worksteal -m 'not slow' $(ARGS)

test-slow: .venv/test
	HYPOTHESIS_PROFILE=many $(BIN)/pytest --numprocesses auto --dist worksteal -m 'slow or hypothesis' $(ARGS)

lint: .venv/test .venv/lint
	$(BIN)/ruff check
	$(BIN)/mypy
	$(BIN)/lint-imports
	$(BIN)/python -m tools.requirements
	$(BIN)/python tools/lines.py
	$(BIN)/python tools/sentences.py

docs: .venv/docs
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict $(ARGS)

bench: .venv/bench
	@$(BIN)/python -m benchmarks.bench $(ARGS)

nightly: .venv/nightly .venv/docs .venv/bench
	.ci/nightly

image:
	.ci/image

clean:
	rm -rf .venv build dist *.egg-info
	find iiwa_sim -name '*.so' -delete

# A group of [dependency-groups]; only groups of these names have a rule.
.venv/test .venv/lint .venv/docs .venv/bench .venv/nightly: pyproject.toml .venv/kernels
	@echo 'libraries of the group $(@F): about 20 s'
	@$(PIP) install --group $(@F)
	@touch $@

.venv/kernels: setup.py build_backend.py .venv/ready $(KERNELS)
	@echo '3/3 compile: about 30 s in a fresh clone'
	@PYTHONWARNINGS=ignore $(PIP) install --no-build-isolation --no-deps --editable .
	@touch $@

.venv/ready: pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo 'iiwa-sim needs Python 3.11 or newer as $(PYTHON); name another one: make PYTHON=python3.12 ...' >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
	  echo '$(PYTHON) cannot make virtual environments; on Debian and Ubuntu: sudo apt install python3-venv' >&2; exit 1; }
	@echo '1/3 environment: about 10 s'
	@$(PYTHON) -m venv .venv
	@$(PIP) install --upgrade 'pip>=25.1'  # earlier ones know no groups
	@echo '2/3 libraries: about 20 s'
	@$(PIP) install $$($(BIN)/python -c 'import tomllib; p = tomllib.load(open("pyproject.toml", "rb")); \
	  print(*p["build-system"]["requires"], *p["project"]["dependencies"])') \
	  $$(test -n "$$CC" || command -v cc gcc clang >/dev/null || echo ziglang)
	@touch $@
