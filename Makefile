# Every target makes what it needs, from a fresh clone with Python >= 3.11, make and a C compiler.
PYTHON ?= python3
WORKERS ?= 2
VENV := .venv
BIN := $(VENV)/bin
PIP = $(BIN)/python -m pip install --quiet --disable-pip-version-check
PEERS ?= $(BIN)
# One environment that grows: what the paper needs, what the fast tests need, everything.
RUNTIME := $(VENV)/runtime.stamp
TESTING := $(VENV)/test.stamp
EVERYTHING := $(VENV)/dev.stamp
# Each worker would compile every test file anew, and each program that a test starts every module.
unexport PYTHONDONTWRITEBYTECODE
# Environments of `make test-numba`, named after their lock in requirements/.
NUMBAS := build/numba/oldest build/numba/runtime
SOURCES := pyproject.toml hatch_build.py $(shell find src -type f -not -path '*/__pycache__/*')
CODE := conftest.py hatch_build.py src tests studies $(wildcard benchmarks examples docs)

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help .venv test test-fast test-slow test-numba test-all wheel lint types contract format paper docs bench lock clean

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z.-]+:.*## / { printf "  make %-10s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

.venv: $(EVERYTHING) ## the local environment with all extras, every version and hash pinned

$(VENV)/created.stamp:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "printhammer needs Python >= 3.11; set it with make PYTHON=...")'
	$(PYTHON) -m venv $(VENV)
	@touch $@

$(RUNTIME): requirements/runtime.txt requirements/build.txt pyproject.toml | $(VENV)/created.stamp
	$(PIP) --require-hashes --requirement requirements/runtime.txt --requirement requirements/build.txt
	$(PIP) --no-deps --no-build-isolation --editable .
	@touch $@

$(TESTING) $(EVERYTHING): $(VENV)/%.stamp: requirements/%.txt $(RUNTIME)
	$(PIP) --require-hashes --requirement $<
	@touch $@

test: lint types contract test-fast ## everything but the slow tests

test-fast: $(TESTING) ## the fast tests alone
	$(BIN)/python -m pytest -n $(WORKERS) --dist loadfile

test-slow: $(EVERYTHING) ## the slow tests alone
	$(BIN)/python -m pytest -n $(WORKERS) --dist loadfile -m slow

test-numba: $(TESTING) $(NUMBAS:=/installed.stamp) ## the wheel with the oldest numba that is allowed and with the newest
	PRINTHAMMER_PYTHONS=$(subst $(eval) ,:,$(NUMBAS:%=$(CURDIR)/%/bin/python)) $(BIN)/python -m pytest -m slow tests/test_numba.py

wheel: build/wheel.stamp ## the wheel, into build/wheel; every llvmlite that is allowed can read its modules

# LLVM reads the modules of earlier versions, so the oldest lowers them; the newest compiles the fastest machine code.
build/wheel.stamp: build/numba/oldest/packages.stamp $(EVERYTHING) $(SOURCES)
	rm -rf build/numba/modules build/wheel
	build/numba/oldest/bin/python hatch_build.py build/numba/modules --lower
	PRINTHAMMER_MODULES=$(CURDIR)/build/numba/modules $(BIN)/python -m hatchling build -t wheel -d build/wheel
	@touch $@

build/numba/%/packages.stamp: requirements/%.txt
	$(PYTHON) -m venv build/numba/$*
	build/numba/$*/bin/python -m pip install --quiet --disable-pip-version-check --require-hashes --requirement $<
	@touch $@

.PRECIOUS: build/numba/%/packages.stamp

build/numba/%/installed.stamp: build/numba/%/packages.stamp build/wheel.stamp
	build/numba/$*/bin/python -m pip install --quiet --disable-pip-version-check --no-deps --force-reinstall build/wheel/*.whl
	@touch $@

test-all: test test-slow ## everything

lint: $(TESTING) ## ruff
	$(BIN)/ruff check $(CODE)
	$(BIN)/ruff format --check $(CODE)

types: $(TESTING) ## mypy --strict
	$(BIN)/mypy

contract: $(TESTING) ## who may import whom
	$(BIN)/lint-imports

format: $(TESTING) ## sort the imports and lay out the code
	$(BIN)/ruff check --select I --fix $(CODE)
	$(BIN)/ruff format $(CODE)

paper: $(RUNTIME) ## every figure and claim of the paper, into build/paper
	$(BIN)/printhammer paper --out build/paper

docs: $(EVERYTHING) ## the documentation, into build/docs; says which measured tables are stale
	$(BIN)/sphinx-build -W --keep-going -b html docs build/docs

bench: $(EVERYTHING) ## the benchmark table (PEERS=folder of another environment's programs)
	$(PEERS)/python -m benchmarks.solvers --peers benchmarks/peers --out docs/benchmarks.md --force

# Resolve again; the files name versions and hashes only, never an address.
LOCK := build/lock-venv/bin/uv pip compile --quiet --universal --fork-strategy fewest --python-version 3.11 \
	--generate-hashes --no-emit-index-url --no-emit-find-links --no-header --no-annotate

# What lint, types and the fast tests need; the docs need sphinx, which nothing else does.
TESTED := laws tables netcdf sweep cluster studies notebook pdf test lint

lock: ## resolve the pinned requirements again (UPGRADE=--upgrade for the newest)
	$(PYTHON) -m venv build/lock-venv
	build/lock-venv/bin/python -m pip install --quiet --disable-pip-version-check --require-hashes --requirement requirements/lock.txt
	$(LOCK) $(UPGRADE) requirements/lock.in --output-file requirements/lock.txt
	$(LOCK) $(UPGRADE) pyproject.toml requirements/build.in --extra all --output-file requirements/dev.txt
	$(LOCK) $(UPGRADE) pyproject.toml --extra laws --constraint requirements/dev.txt --output-file requirements/runtime.txt
	$(LOCK) $(UPGRADE) pyproject.toml requirements/oldest.in --extra laws --output-file requirements/oldest.txt
	$(LOCK) $(UPGRADE) requirements/build.in --constraint requirements/dev.txt --output-file requirements/build.txt
	$(LOCK) $(UPGRADE) pyproject.toml requirements/build.in $(foreach extra,$(TESTED),--extra $(extra)) \
		--constraint requirements/dev.txt --output-file requirements/test.txt

clean: ## remove the environment and everything built
	rm -rf $(VENV) build dist .mypy_cache .pytest_cache .ruff_cache .import_linter_cache .hypothesis docs/gallery
