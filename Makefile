# Python 3.10 or newer and make are all that is needed; everything else goes into .venv.

.DEFAULT_GOAL := help
.PHONY: help demo test lint format types bench clean

# The first Python on the path that is new enough. To choose another: make PYTHON=... demo
PYTHON = $(shell for p in python3 python3.13 python3.12 python3.11 python3.10; do \
	if $$p -c 'import sys; sys.exit(sys.version_info < (3, 10))' 2>/dev/null; then \
	echo $$p; break; fi; done)
BIN = .venv/bin
READY = .venv/.ready

PROBLEM = config/problems/trinkle_hunter_1991.yaml
DEMO = runs/demo

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "  make %-8s %s\n", $$1, $$2 }' Makefile

demo: $(READY) ## plan the 1991 problem, certify the plan, draw the figures and an animation
	$(BIN)/cfplan plan $(PROBLEM) --json $(DEMO)/plan.json --figures $(DEMO)
	$(BIN)/cfplan verify $(PROBLEM) $(DEMO)/plan.json
	$(BIN)/cfplan animate $(DEMO)/plan.json --problem $(PROBLEM) -o $(DEMO)/animation.gif
	@echo
	@echo 'The plan is $(DEMO)/plan.json; the pictures are in $(DEMO):'
	@cd $(DEMO) && ls *.png *.gif

test: $(READY) ## run the tests
	$(BIN)/python -m pytest

lint: $(READY) ## check style and formatting
	$(BIN)/ruff check
	$(BIN)/ruff format --check

format: $(READY) ## put the source into its format
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

types: $(READY) ## check types
	$(BIN)/mypy

bench: export OMP_NUM_THREADS = 1
bench: export OPENBLAS_NUM_THREADS = 1
bench: export MKL_NUM_THREADS = 1
bench: $(READY) ## measure planning time, memory and import time
	$(BIN)/python -m pytest benchmark --benchmark-quiet -q

clean: ## remove .venv and everything that was built, cached or drawn by the demo
	rm -rf .venv build install log dist *.egg-info $(DEMO)
	rm -rf .pytest_cache .hypothesis .mypy_cache .ruff_cache .benchmarks
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# The marker is touched last, so that an interrupted installation starts afresh.
$(READY): constraints.txt setup.py
	@test -n "$(PYTHON)" || { \
	echo 'cfplan needs Python 3.10 or newer; name one with make PYTHON=...' >&2; exit 1; }
	@echo 'Installing into .venv; the first time this takes a minute.'
	@$(PYTHON) -m venv --clear .venv
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check \
	--constraint constraints.txt setuptools
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check \
	--constraint constraints.txt --no-build-isolation --editable '.[test,lint]'
	@touch $@
