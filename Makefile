# `make demo` and `make test` work from a fresh clone: each makes its own environment first.
VENV   ?= .venv
PYTHON ?= python3
BIN    := $(VENV)/bin
INSTALL = $(BIN)/python -m pip install --quiet --disable-pip-version-check -c constraints.txt

# The tests start two hundred programs; without byte code each would compile all it imports.
unexport PYTHONDONTWRITEBYTECODE
# `lint` keeps one core busy, `bytecode` the other.
MAKEFLAGS += --jobs=2

.PHONY: demo test test-all bytecode matrix lint real soak fuzz mutants bench docs clean

$(VENV)/.fly: pyproject.toml constraints.txt
	$(PYTHON) -m venv $(VENV)
	$(INSTALL) -e '.[plot,report]'
	@touch $@

$(VENV)/.test: $(VENV)/.fly
	$(INSTALL) --no-compile -e '.[test]'
	$(INSTALL) --no-compile --no-deps MAVProxy
	@touch $@

demo: $(VENV)/.fly  ## fly the bundled vehicle and show what was measured
	$(BIN)/companion demo

# In the order of the files: sorted by their number of tests, the long flights would come last.
PYTEST := $(BIN)/python -m pytest -n 3 --dist loadscope --no-loadscope-reorder

test: lint bytecode  ## style, types, import rules, then the tests
	$(PYTEST) -m 'not slow'

test-all: lint bytecode  ## the same with every test, also what only proves more widely what others prove
	$(PYTEST)

bytecode: $(VENV)/.test  ## byte code of the tests and numba's of the mock: every worker would make its own
	@$(BIN)/python -m pytest --collect-only -p no:cacheprovider > /dev/null || true  # the tests tell it
	@$(BIN)/python -c 'from companion.testing import MockVehicle as M; M(compiled=True).run(0.1)'

matrix: $(VENV)/.test  ## every fault in every phase of a flight, in about three minutes
	$(BIN)/python -m pytest -n 2 tests/flight/test_fault_matrix.py

lint: $(VENV)/.test
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# TIMES=3 for medians, SETS=straight,near for a part of it, MINUTES=35 for a limit, OUT=folder,
# FIFO=--fifo on a busy computer; docs/real-autopilots.md.
REALLY := $(if $(AUTOPILOT),--autopilot $(AUTOPILOT)) $(if $(TIMES),--times $(TIMES)) $(if $(SETS),--sets $(SETS)) \
	$(if $(MINUTES),--minutes $(MINUTES)) $(if $(OUT),--out $(OUT)) $(FIFO)

real: $(VENV)/.test  ## real autopilots in their simulations, against truth: REAL=folder or YAML file, AUTOPILOT=px4
	REAL="$(REAL)" $(BIN)/python -m tests.real.campaign $(REALLY)

soak: $(VENV)/.test  ## half an hour in real time over a bad link
	$(BIN)/python -m tests.soak --minutes 30

fuzz: $(VENV)/.test  ## an hour of random files, frames and telemetry
	nice -n 19 $(BIN)/python -m tests.fuzz --minutes 60

$(VENV)/.mutants: $(VENV)/.test
	$(INSTALL) -e '.[mutants]'
	@touch $@

mutants: $(VENV)/.mutants  ## do the tests notice a change of the code? ROOM=attitude; an hour or more for all
	nice -n 19 $(BIN)/python -m tests.mutants $(ROOM)

bench: $(VENV)/.test  ## latency of our link against a bare echo and MAVSDK
	$(BIN)/companion bench link

$(VENV)/.docs: $(VENV)/.fly
	$(INSTALL) -e '.[docs]'
	@touch $@

docs: $(VENV)/.docs  ## the pages of docs/ as a site in site/; a broken link is an error
	$(BIN)/zensical build --strict --clean

clean:
	rm -rf $(VENV) build site *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
