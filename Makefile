# Asset2Sim. `make` lists the targets. Paths are relative, so that the checkout may lie in a folder with a space in its name.

DATA ?= data/raw
OUT ?= data/refined
MODEL ?= prior/household

VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed

# What follows an option is quoted: folders may have spaces in their names.
OPTIONS = --out "$(OUT)" --model "$(MODEL)" \
	$(if $(API_BASE),--api-base "$(API_BASE)") $(if $(SUBSET),--subset "$(SUBSET)") $(if $(ASSETS),--assets "$(ASSETS)") \
	$(if $(LIMIT),--limit "$(LIMIT)") $(if $(METHOD),--method "$(METHOD)") $(if $(WORKERS),--workers "$(WORKERS)") \
	$(if $(SCHEDULER),--scheduler "$(SCHEDULER)") $(if $(NO_VIEWS),--no-views) $(if $(STRICT),--strict) \
	$(if $(ENGINES),--engines "$(ENGINES)") $(if $(COLLISION),--collision "$(COLLISION)") $(if $(STATE),--state "$(STATE)") \
	$(if $(DYNAMICS),--dynamics "$(DYNAMICS)") $(if $(EXPORT),--export "$(EXPORT)")

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help install flow test lint typecheck failures doctor nightly ui judge rules bench-defects samples summary picture clean

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  %-14s %s\n", $$1, $$2 }' Makefile
	@echo
	@echo "  variables of flow and nightly: DATA OUT MODEL API_BASE SUBSET ASSETS LIMIT METHOD WORKERS SCHEDULER NO_VIEWS=1 STRICT=1"
	@echo "                                 ENGINES COLLISION DYNAMICS STATE EXPORT"
	@echo "  for example: make flow DATA=../shared/partnet_mobility SUBSET=paper9 OUT=/tmp/paper9 WORKERS=2"

install: $(INSTALLED) ## make .venv with the tested versions; needs Python 3.11 (or PYTHON=/path/to/python3.11)

$(INSTALLED): pyproject.toml constraints.txt
	@for candidate in $(if $(PYTHON),"$(PYTHON)",python3.11 python3 python); do \
		if "$$candidate" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' 2>/dev/null; then \
			python="$$candidate"; break; \
		fi; \
	done; \
	if [ -z "$$python" ]; then \
		echo "Python 3.11 was not found; install it, or name it: make install PYTHON=/path/to/python3.11" >&2; exit 1; \
	fi; \
	echo "installing into $(VENV) with $$python ..."; \
	"$$python" -m venv --clear $(VENV) && \
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt --editable '.[dev,engines,usd]'
	@touch $@

flow: $(INSTALLED) ## refine DATA (data/raw) into OUT (data/refined)
	@$(BIN)/python -m flows.command refine "$(DATA)" $(OPTIONS)

test: $(INSTALLED) ## run the tests; ARGS="-k dataset" chooses
	@$(BIN)/python -m pytest $(ARGS)

lint: $(INSTALLED) ## ruff, and the contract on imports
	@$(BIN)/ruff check .
	@$(BIN)/lint-imports

typecheck: $(INSTALLED) ## mypy, strict
	@$(BIN)/mypy

failures: $(INSTALLED) ## the failure modes in OUT
	@$(BIN)/python -m flows.command failures --out "$(OUT)"

doctor: $(INSTALLED) ## what works on this machine
	@$(BIN)/python -m flows.command doctor --out "$(OUT)" --model "$(MODEL)" $(if $(API_BASE),--api-base "$(API_BASE)")

nightly: $(INSTALLED) ## refine DATA into OUT on the schedule of catalog.yaml, until interrupted
	@$(BIN)/python -m flows.command nightly "$(DATA)" $(OPTIONS)

ui: $(INSTALLED) ## Prefect's and MLflow's pages, until interrupted
	@$(BIN)/python -m flows.command ui --out "$(OUT)"

samples: $(INSTALLED) ## make data/raw anew, byte for byte
	@$(BIN)/python -m asset2sim.samples

judge: $(INSTALLED) .venv-judge/.installed ## an independent checker, simcheck, over OUT
	@$(BIN)/python -m asset2sim.judge "$(OUT)" $(if $(JOBS),--jobs "$(JOBS)")

.venv-judge/.installed:
	@echo "installing simcheck into .venv-judge ..."
	@$(BIN)/python -m venv --clear .venv-judge && \
	.venv-judge/bin/python -m pip install --quiet --disable-pip-version-check "simcheck[all]"
	@touch $@

rules: $(INSTALLED) ## refine DATA as it came, by the paper's rules and by ours, and write the README's table
	@$(BIN)/python -m flows.compare_rules "$(DATA)" "$(OUT)" README.md

bench-defects: $(INSTALLED) ## plant known defects in clean objects: what share is caught, and what is mended
	@$(BIN)/python -m asset2sim.defects "$(OUT)"

summary: $(INSTALLED) ## write the table of OUT's latest run into the README
	@$(BIN)/python -m asset2sim.readme "$(OUT)" README.md

picture: $(INSTALLED) ## draw the README's before-and-after picture from data/raw and data/refined
	@$(BIN)/python -m asset2sim.showcase data/raw data/refined docs/before_after.png \
		laptop_silver box_wooden storage_sideboard trashcan_pedal toilet_white

clean: ## remove the environment, the caches and data/refined
	rm -rf $(VENV) .venv-judge .prefect data/refined .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	find schemas asset2sim tasks flows tests -name __pycache__ -type d -prune -exec rm -rf {} +
