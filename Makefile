# Set-up, tests and the main job. Each target first builds or updates the virtual environment where needed.

VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
# Options for `make run`, e.g.  make run ARGS="--robot go2 --terrain flat --seed 7"
ARGS ?=
# Options for `make test`, e.g.  make test PYTEST_ARGS="-k terrain"
PYTEST_ARGS ?=
# Number of test processes
WORKERS ?= 2

.DEFAULT_GOAL := help
.PHONY: help setup run test lint format docs clean

help:  ## Show this list
	@grep -hE '^[a-z]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/^([a-z]+):.*## /make \1|/' | awk -F'|' '{ printf "  %-12s %s\n", $$1, $$2 }'

setup: $(STAMP)  ## Build or update .venv (done by the other targets when needed), compile numerical kernels
	-@$(BIN)/python -m quadpips_drake.cli.main doctor --warm

run: $(STAMP)  ## ANYmal C crosses stepping stones by its own camera; prints where recording, report and film lie
	@mkdir -p out
	$(BIN)/python -m quadpips_drake.cli.main run --overwrite --film out/film.mp4 $(ARGS)

test: lint  ## Lint, format check and all tests
	-@$(BIN)/python -m quadpips_drake.cli.main doctor --warm
	$(BIN)/python -m pytest -q --benchmark-disable -n $(WORKERS) --dist loadfile --no-loadscope-reorder $(PYTEST_ARGS)

lint: $(STAMP)  ## Lint and format check only
	$(BIN)/ruff check
	$(BIN)/ruff format --check

format: $(STAMP)  ## Repair what lint can repair by itself
	$(BIN)/ruff check --fix
	$(BIN)/ruff format

docs: $(STAMP)  ## Documentation as a site that needs no network: out/site/index.html
	NO_MKDOCS_2_WARNING=1 $(BIN)/python -m mkdocs build --strict --quiet
	@echo "documentation: out/site/index.html"

clean:  ## Remove .venv, results and caches
	rm -rf $(VENV) out build dist *.egg-info .pytest_cache .ruff_cache .benchmarks
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# The first interpreter that is new enough and can make a virtual environment. Each candidate is tried, not only
# looked up: a name on the path may be a stub that does not run.
$(STAMP): pyproject.toml constraints.txt
	@if ! $(BIN)/python -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then \
	  for python in python3 python3.11 python3.12 python3.13 python3.14; do \
	    if $$python -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))' 2>/dev/null; then \
	      echo "Making $(VENV) with $$($$python --version)"; \
	      rm -rf $(VENV) && $$python -m venv $(VENV) && break; \
	    fi; \
	  done; \
	fi
	@test -x $(BIN)/python || { \
	  echo "No Python 3.11 or newer with its venv module was found; on Debian or Ubuntu: apt install python3 python3-venv" >&2; \
	  exit 1; }
	@rm -rf *.egg-info  # an old one would hide the entry points of the new installation
	$(BIN)/python -m pip install --quiet --constraint constraints.txt --editable '.[test]'
	@touch $@
