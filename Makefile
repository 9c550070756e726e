# `make train` and `make test` set everything up on a fresh machine by themselves.

VENV ?= .venv
PYTHON ?= python3
RUN ?= runs/latest
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
PLAY_STAMP := $(VENV)/.installed-play
TEST_FLAGS ?=
SOAK_MINUTES ?= 120

# One thread for each library in each process: spinning thread pools slow two cores down.
export OMP_NUM_THREADS := 1
export OPENBLAS_NUM_THREADS := 1
export MKL_NUM_THREADS := 1
export PIP_DISABLE_PIP_VERSION_CHECK := 1

.PHONY: help train play rehearse test check format test-all slow chaos fuzz bench soak docs clean
.DEFAULT_GOAL := help

help: ## this list
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z-]+):.*## (.*)/  make \1|\2/' | column -t -s '|'

$(BIN)/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "riposte needs Python 3.11 or newer; found $$($(PYTHON) --version): make PYTHON=python3.11 ..."; exit 2; }
	@echo "setting up: new environment in $(VENV)"; $(PYTHON) -m venv $(VENV) || \
	  { echo "the venv module is missing; on Debian: apt install python3-venv"; exit 2; }

$(STAMP): pyproject.toml constraints.txt | $(BIN)/python
	@echo "setting up: torch (the largest part, a few minutes on a slow line)"
	@$(BIN)/pip install --quiet -c constraints.txt "$$(grep '^torch==' constraints.txt)"
	@echo "setting up: everything else"
	@$(BIN)/pip install --quiet -c constraints.txt -e '.[dev]'
	@touch $@ $(PLAY_STAMP)

$(PLAY_STAMP): pyproject.toml constraints.txt | $(BIN)/python
	@echo "setting up: what playing needs, which is not torch"
	@$(BIN)/pip install --quiet -c constraints.txt -e '.[play]'
	@touch $@

train: $(STAMP) ## train two fencers on this machine and write a report
	@$(BIN)/riposte train $(ARGS)

play: $(PLAY_STAMP) ## fence against the robot in a browser; ARGS='--antagonist heuristic' needs none
	@$(BIN)/riposte play $(ARGS)

rehearse: $(STAMP) ## a PR2, a Vive, a strap and a sound card that are not there, to rehearse in
	@$(BIN)/python -m tests.integration.full_stack.rehearsal $(ARGS)

test: $(STAMP) ## unit, property, integration and replay tests
	@$(BIN)/pytest -q -n 2 --no-loadscope-reorder \
	  -m "not slow and not chaos and not hardware and not gpu and not bench" \
	  --ignore=tests/chaos --ignore=tests/hardware --ignore=tests/bench tests $(TEST_FLAGS)

test-all: $(STAMP) ## every test that needs no robot
	@$(BIN)/pytest -q -m "not hardware and not gpu" tests $(TEST_FLAGS)

slow: $(STAMP) ## whole runs, the quick budget of both phases among them
	@$(BIN)/pytest -q -m slow tests $(TEST_FLAGS)

chaos: $(STAMP) ## tests that kill, delay and lose things
	@$(BIN)/pytest -q -m chaos tests $(TEST_FLAGS)

fuzz: $(STAMP) ## a million hostile inputs; ARGS='--atheris wire/Rollout --inputs 100000' by coverage
	@$(BIN)/python -m tests.fuzz $(ARGS)

check: $(STAMP) ## format, lint, types, import rules
	@$(BIN)/ruff format --check --quiet --output-format=concise . || \
	  { echo "make format rewrites these files"; exit 1; }
	@$(BIN)/ruff check --quiet .
	@$(BIN)/pyright --pythonpath $(BIN)/python
	@$(BIN)/lint-imports --no-cache --no-logo

format: $(STAMP) ## rewrite the files as `make check` wants them
	@$(BIN)/ruff format .
	@$(BIN)/ruff check --fix .

bench: $(STAMP) ## list the benchmarks; make bench ARGS='actor --write' measures one
	@$(BIN)/riposte bench $(ARGS)

soak: $(STAMP) ## training and play together for SOAK_MINUTES (120): does anything grow?
	@$(BIN)/python -m benchmarks.soak --minutes $(SOAK_MINUTES) --write $(ARGS)

docs: $(STAMP) ## renew the generated parts of docs/ and deploy/
	@$(BIN)/python -m shared.messages.table --write docs/architecture.md
	@$(BIN)/python -m shared.telemetry.columns docs/recordings.md
	@$(BIN)/python -m shared.identification.hidden.catalogue_page docs/effects.md
	@$(BIN)/python -m benchmarks.identification.summary docs/identify_results.md
	@$(BIN)/python -m services.router deploy/zenoh/site.toml --print-config > deploy/zenoh/zenohd.json5.new && mv deploy/zenoh/zenohd.json5.new deploy/zenoh/zenohd.json5
	@$(BIN)/python -m services.jobs.site > deploy/local.toml.new && mv deploy/local.toml.new deploy/local.toml

clean: ## remove the environment, caches and builds; runs/ stays
	rm -rf $(VENV) build dist .pytest_cache .ruff_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
