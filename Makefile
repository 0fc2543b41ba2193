# Everything runs in one virtual environment, .venv. A stamp in it records what is installed, so that a second
# call installs nothing.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
RUN := $(VENV)/.installed-run
TEST := $(VENV)/.installed-test
DOCS := $(VENV)/.installed-docs
OUT ?= out/explore
ARGS ?=
INSTALL := $(BIN)/python -m pip install --quiet --constraint constraints.txt --editable
# Offscreen rendering without a display, where there is EGL.
ifeq ($(shell uname -s)$(DISPLAY)$(WAYLAND_DISPLAY),Linux)
export MUJOCO_GL ?= egl
endif

.DEFAULT_GOAL := help
.PHONY: help explore figures docs test statistics fuzz check format clean

help:  ## List the targets
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "  make %-12s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

explore: $(RUN)  ## Explore a hidden object and name it; ARGS="--shape cube --sigma 5" changes how, OUT= where to
	$(BIN)/python scripts/explore.py --out $(OUT) $(ARGS)

figures: $(RUN)  ## Draw the figures of the paper, and more, into out/figures; ARGS="figure5 film" picks some
	$(BIN)/python scripts/figures.py $(ARGS)

docs: $(DOCS)  ## Build the site into out/site; a link or a reference that leads nowhere fails
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build

test statistics: export PYTHONDONTWRITEBYTECODE :=  # each of the hundreds of processes would compile all modules anew
test: $(TEST)  ## Run the tests, but for the long statistical ones; ARGS="tests/agents" picks some
	$(BIN)/python -m pytest -n 2 --dist worksteal $(ARGS)

statistics: $(TEST)  ## Run the long statistical tests (averages over many trials)
	$(BIN)/python -m pytest -n 2 --dist worksteal -m statistical --timeout 3600 $(ARGS)

fuzz: $(TEST)  ## Try odd inputs by the hundred thousand; FUZZ_EXAMPLES, FUZZ_MINUTES and FUZZ_SEED say how many, how long
	$(BIN)/python -m pytest -m fuzz --timeout 7200 tests/properties $(ARGS)

check: export MYPY_NUM_WORKERS := 2
check: $(TEST)  ## Lint, check the formatting and the types
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

format: $(TEST)  ## Format the code and sort its imports
	$(BIN)/ruff check --fix-only --quiet .
	$(BIN)/ruff format .

clean:  ## Remove the virtual environment, caches and results
	rm -rf $(VENV) out build *.egg-info .pytest_cache .mypy_cache .ruff_cache
	find . -name __pycache__ -prune -exec rm -rf {} +

$(BIN)/python:
	$(PYTHON) -m venv $(VENV)

$(RUN): pyproject.toml constraints.txt | $(BIN)/python
	$(INSTALL) '.[hands,meshes]'
	touch $@

$(DOCS): pyproject.toml constraints.txt | $(BIN)/python
	$(INSTALL) '.[docs]'
	touch $@

$(TEST): pyproject.toml constraints.txt | $(BIN)/python
	$(INSTALL) '.[train,test]'
	touch $(RUN) $(DOCS) $@
