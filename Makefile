# The workflow as verbs. Everything is installed into .venv, once: a stamp file says with which extra.
PYTHON ?= python3
SILHOUETTES ?=
BIN := .venv/bin
PYTEST := $(BIN)/python -m pytest -n auto --maxprocesses=2
INSTALL := $(BIN)/python -m pip install -qq --disable-pip-version-check -c constraints.txt
# Something to read meanwhile; it ends with the recipe's shell, $$$$, however that does.
TICKING := { s=0; while sleep 4 && kill -0 $$$$ 2>/dev/null; do s=$$((s + 4)); echo "  installing, $$s s"; done; } &

.DEFAULT_GOAL := help
.PHONY: help demo studio test quick lint format check bench extension clean

help: ## this list
	@awk -F ':.*## ' '/^[a-z]+:.*## / { printf "  make %-9s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

demo: .venv/installed-base ## build a mesh of every silhouette in examples/ and draw how it came about
	@$(BIN)/python -m agents.solve examples --out out
	@echo "The pictures are in out/: open the one named last above."

studio: .venv/installed-studio ## open the studio in the browser: drop a picture, watch its mesh come about
	@$(BIN)/python -m agents.studio

test: .venv/installed-dev ## run the tests, all of them
	@$(PYTEST)

quick: .venv/installed-dev ## run the tests that take less than a minute together
	@$(PYTEST) -m "not slow"

lint: .venv/installed-dev ## look at style, formatting and types
	@$(BIN)/ruff check .
	@$(BIN)/ruff format --check .
	@$(BIN)/mypy

format: .venv/installed-dev ## put right what can be put right of style and formatting
	@$(BIN)/ruff check --fix .
	@$(BIN)/ruff format .

check: lint test ## both lint and test: what has to pass before a change goes in

bench: .venv/installed-bench ## measure the speed and quality; SILHOUETTES=DIR measures on that folder too
	@$(BIN)/python -m benchmarks.run $(if $(SILHOUETTES),--silhouettes "$(SILHOUETTES)")

extension: .venv/installed-base ## pack the coach for Blender into dist/
	@$(BIN)/python -m blender.build

clean: ## remove what was generated; .venv stays
	rm -rf out build dist *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -path ./.venv -prune -o -name __pycache__ -type d -exec rm -rf {} +

.venv/created:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || { \
	  echo "AutoPoly needs Python 3.11 or newer; $(PYTHON) is $$($(PYTHON) --version 2>/dev/null || echo missing)." \
	       "Name another one: make PYTHON=python3.12 $(MAKECMDGOALS)" >&2; exit 1; }
	@$(PYTHON) -m venv .venv
	@touch $@

.venv/installed-base: pyproject.toml constraints.txt | .venv/created
	@echo "Installing AutoPoly into .venv ..."
	@$(TICKING) $(INSTALL) -e .; code=$$?; kill $$!; exit $$code
	@touch $@

.venv/installed-%: pyproject.toml constraints.txt | .venv/created
	@echo "Installing AutoPoly with what '$*' needs into .venv ..."
	@$(TICKING) $(INSTALL) -e '.[$*]'; code=$$?; kill $$!; exit $$code
	@touch $@
