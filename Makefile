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

demo: $(READY) ## start the node, call it with the 1991 problem, certify and draw the answer
	@mkdir -p $(DEMO)
	@# A domain of its own keeps the demo from meeting other nodes of this machine.
	@export ROS_DOMAIN_ID=$$(( $$$$ % 100 + 1 )); \
	$(BIN)/cfplan node $(PROBLEM) --ros-args -p record_directory:=$(DEMO) & node=$$!; \
	trap 'kill $$node; wait $$node' EXIT; \
	$(BIN)/cfplan call $(PROBLEM) --wait 30 --json $(DEMO)/plan.json --figures $(DEMO)
	$(BIN)/cfplan verify $(PROBLEM) $(DEMO)/plan.json
	$(BIN)/cfplan animate $(DEMO)/plan.json --problem $(PROBLEM) -o $(DEMO)/animation.gif
	@echo
	@echo 'The plan is $(DEMO)/plan.json; the recorded run and the pictures are in $(DEMO):'
	@cd $(DEMO) && ls *.mcap *.png *.gif

test: $(READY) ## run the tests of core, standalone runtime and node
	$(BIN)/python -m pytest -n auto --dist loadfile

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
	rm -rf standalone/build standalone/src/*.egg-info
	rm -rf .pytest_cache .hypothesis .mypy_cache .ruff_cache .benchmarks
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# The marker is touched last, so that an interrupted installation starts afresh.
$(READY): constraints.txt setup.py standalone/pyproject.toml
	@test -n "$(PYTHON)" || { \
	echo 'cfplan needs Python 3.10 or newer; name one with make PYTHON=...' >&2; exit 1; }
	@echo 'Installing into .venv; the first time this takes a minute.'
	@$(PYTHON) -m venv --clear .venv
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check \
	--constraint constraints.txt setuptools
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check \
	--constraint constraints.txt --no-build-isolation --editable '.[test,lint]' \
	--editable ./standalone
	@touch $@
