# Asset2Sim. `make` lists the targets. Paths are relative, so that the checkout may lie in a folder with a space in its name.

DATA ?= data/raw
OUT ?= data/refined
# Further options of a target's command, taken as they stand: make looks not into them (a hook's $ is the shell's).
override ARGS := $(value ARGS)

VARIABLES := DATA OUT ARGS ASSET TO SHARED ONLY WORK JOBS PYTHON TORCH_INDEX VENV BIN SHELL
FLAGS := NO_% ALLOW_OUTSIDE ASK_AGAIN DRY_RUN FORCE NOW RETRY_FAILED REVIEWED STRICT
# The names set on the command line: a word of a value with spaces may look like one, but has no such origin.
named = $(firstword $(subst :, ,$(subst =, ,$(1))))
GIVEN := $(foreach word,$(MAKEOVERRIDES),$(if $(filter command,$(origin $(call named,$(word)))),$(call named,$(word))))
spelt = --$(shell echo '$(1)' | tr 'A-Z_' 'a-z-')$(if $(filter $(FLAGS),$(1)),, $(if $(word 2,$($(1))),'$($(1))',$($(1))))
$(foreach name,$(filter-out $(VARIABLES),$(GIVEN)),$(error $(name) is no variable of this Makefile; say ARGS="$(call spelt,$(name))"))

# Set and empty, they would be the current folder.
$(foreach folder,DATA OUT,$(if $(strip $($(folder))),,$(error $(folder) is empty; name a folder, or leave $(folder)= out)))

VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed
PIP = $(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt

# A file's tests stay in one process and in order.
PARALLEL = --numprocesses $(if $(JOBS),$(JOBS),4) --dist loadfile --no-loadscope-reorder

comma := ,
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help install flow test test-fast lint typecheck failures report screenshots settings learn view rate ratings views doctor nightly ui judge judged probe clone recorded figures shapes rules dataset withheld corrections origins compare first bench-defects bench-gym samples questions summary loaders held touched weights docs picture clean bench

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  %-14s %s\n", $$1, $$2 }' Makefile
	@echo
	@echo "  variables: DATA and OUT, folders or URLs; ARGS, the options of a target's command (asset2sim refine --help);"
	@echo "             of one target each: ASSET TO SHARED ONLY WORK JOBS PYTHON TORCH_INDEX"
	@echo "  for example: make flow DATA=../shared/partnet_mobility OUT=/tmp/paper9 ARGS=\"--subset paper9 --workers 2\""

install: $(INSTALLED) ## make .venv with the tested versions; needs Python 3.11 (or PYTHON=/path/to/python3.11)

$(INSTALLED): pyproject.toml lab/pyproject.toml constraints.txt
	@for candidate in $(if $(PYTHON),"$(PYTHON)",python3.11 python3 python); do \
		if "$$candidate" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' 2>/dev/null; then \
			python="$$candidate"; break; \
		fi; \
	done; \
	if [ -z "$$python" ]; then \
		echo "Python 3.11 was not found; install it, or name it: make install PYTHON=/path/to/python3.11" >&2; exit 1; \
	fi; \
	echo "installing into $(VENV) with $$python ..."; \
	"$$python" -m venv --clear $(VENV)
	@$(PIP) pip || echo "pip stays as Python has it; it is slower"
	@$(PIP) --no-compile --editable '.[pipeline,dev,browser,engines,gym,usd,s3,view]' --editable ./lab
	@$(BIN)/python -m compileall -qq -j 0 $(VENV)/lib || true  # some packages have files that no Python 3 compiles
	@touch $@

flow: $(INSTALLED) ## refine DATA (data/raw) into OUT (data/refined); ARGS="--workers 2", as asset2sim refine --help lists them
	@$(BIN)/python -m flows.command refine "$(DATA)" --out "$(OUT)" $(ARGS)

# Hundreds of processes would each compile our modules anew where the environment asks for no bytecode.
PYTEST = env -u PYTHONDONTWRITEBYTECODE $(BIN)/python -m pytest

test: $(INSTALLED) ## run all tests, in JOBS processes (4: many wait); ARGS="-k dataset" chooses
	@$(PYTEST) $(PARALLEL) $(ARGS)

test-fast: $(INSTALLED) ## run the tests that start no engine, server or process: a minute
	@$(PYTEST) $(PARALLEL) -m "not system" $(ARGS)

lint: $(INSTALLED) ## ruff, and the contract on imports
	@$(BIN)/ruff check .
	@$(BIN)/lint-imports

typecheck: $(INSTALLED) ## mypy, strict
	@$(BIN)/mypy

failures: $(INSTALLED) ## the failure modes in OUT; ARGS=--reviewed: each failure with its review
	@$(BIN)/python -m flows.command failures --out "$(OUT)" $(ARGS)

view: $(INSTALLED) ## look at OUT's objects, touch and review them, on a page; ASSET
	@$(BIN)/python -m flows.command view $(if $(ASSET),"$(ASSET)") --out "$(OUT)" $(ARGS)

rate: $(INSTALLED) ## let people rate anonymous variants in OUT, also that of compare, on a page
	@$(BIN)/python -m flows.command rate "$(OUT)" $(ARGS)

ratings: $(INSTALLED) ## what people made of the variants in OUT, by method; ARGS="--published FOLDER": beside the paper's tables
	@$(BIN)/python -m flows.command ratings "$(OUT)" $(ARGS)

report: $(INSTALLED) ## write the report for people, OUT/report, as a run does at its end; ARGS=--force: every page anew
	@$(BIN)/python -m flows.command report --out "$(OUT)" $(ARGS)

settings: $(INSTALLED) ## every setting with its unit and its reason, as a file for --settings
	@$(BIN)/python -m flows.command settings $(ARGS)

learn: $(VENV)/.learn ## a robot learns to use OUT's objects, with PPO, into OUT
	@$(BIN)/python -m flows.command learn "$(OUT)" --out "$(OUT)" $(ARGS)

# torch and stable-baselines3, which nothing else needs (TORCH_INDEX is an index of its CPU builds).
$(VENV)/.learn: $(INSTALLED)
	@echo "installing torch and stable-baselines3 into $(VENV) ..."
	@$(PIP) $(if $(TORCH_INDEX),--extra-index-url "$(TORCH_INDEX)") --editable . --editable './lab[learn]'
	@touch $@

views: $(INSTALLED) ## write the pictures that a run with --no-views left out, into OUT
	@$(BIN)/python -m flows.command views --out "$(OUT)" $(ARGS)

doctor: $(INSTALLED) ## what works on this machine
	@$(BIN)/python -m flows.command doctor --out "$(OUT)" $(ARGS)

nightly: $(INSTALLED) ## refine DATA into OUT on the schedule of catalog.yaml, until interrupted; ARGS=--now: once, at once
	@$(BIN)/python -m flows.command nightly "$(DATA)" --out "$(OUT)" $(ARGS)

ui: $(INSTALLED) ## the report, Prefect's and MLflow's pages, until interrupted
	@$(BIN)/python -m flows.command ui --out "$(OUT)" $(ARGS)

samples: $(INSTALLED) ## make data/raw anew, byte for byte
	@$(BIN)/python -m tests.samples.sample_dataset

judge: $(INSTALLED) .venv-judge/.installed ## an independent checker, simcheck, over OUT
	@$(BIN)/python -m lab.simcheck.checker "$(OUT)" $(if $(JOBS),--jobs "$(JOBS)")

.venv-judge/.installed:
	@echo "installing simcheck into .venv-judge ..."
	@$(BIN)/python -m venv --clear .venv-judge && \
	.venv-judge/bin/python -m pip install --quiet --disable-pip-version-check "simcheck[all]" networkx  # which its mesh checks need
	@touch $@

judged: $(INSTALLED) ## record, judge (ARGS: of asset2sim judge-videos) and rate variants of OUT, a run or a comparison
	@$(BIN)/python -m flows.command record-motion "$(OUT)"
	@$(BIN)/python -m flows.command judge-videos "$(OUT)" $(ARGS)
	@$(BIN)/python -m flows.command ratings "$(OUT)"

probe: $(VENV)/.gripper ## a policy does the paper's tasks with variants of OUT; ARGS="--policy openpi://HOST:PORT", else the scripted one
	@$(BIN)/python -m flows.command probe "$(OUT)" --policy scripted $(ARGS)

# The Robotiq gripper's model lies in robosuite's package, of which nothing is run; its dependencies want an older NumPy.
$(VENV)/.gripper: $(INSTALLED)
	@echo "installing the Robotiq gripper's model into $(VENV) ..."
	@$(PIP) --no-deps robosuite==1.5.2
	@touch $@

clone: $(INSTALLED) ## a network learns from the scripted expert what to do with the objects of OUT, into TO (OUT/clone)
	@$(BIN)/python -m lab.flows.clone_expert "$(OUT)" "$(or $(TO),$(OUT)/clone)" $(ARGS)

rules: $(INSTALLED) ## refine DATA as it came, with the paper's ranges and by ours, and write the table of docs/checks.md
	@$(BIN)/python -m lab.flows.compare rules "$(DATA)" "$(OUT)" docs/checks.md

dataset: $(INSTALLED) ## runs over whole datasets, ARGS="NAME=OUT …": a column each of a table of docs/measured.md
	@$(BIN)/python -m lab.comparisons.dataset_table docs/measured.md $(ARGS)

withheld: $(INSTALLED) ## DATA without labels, and with each category left out of the tables: a table of docs/compared.md
	@$(BIN)/python -m lab.flows.compare withheld "$(DATA)" "$(OUT)" docs/compared.md

corrections: $(INSTALLED) ## answers of models as they are, corrected, asked again: a table of docs/compared.md; ARGS="--models … --subset paper9"
	@$(BIN)/python -m lab.flows.compare corrections "$(DATA)" "$(OUT)" --page docs/compared.md $(ARGS)

origins: $(INSTALLED) ## objects from other hands, each folder of SHARED (../shared)/other_origins, or DATA, a row of a table of docs/measured.md
	@$(BIN)/python -m lab.flows.compare origins $(if $(filter file,$(origin DATA)),"$(or $(SHARED),../shared)"/other_origins/*/ \
		"$(or $(SHARED),../shared)"/other_origins/*/kitchen/,"$(DATA)") --out "$(OUT)" --allow-outside --page docs/measured.md $(ARGS)

compare: $(INSTALLED) ## methods and models on the same objects: the paper's tables and charts, into OUT
	@$(BIN)/python -m lab.flows.compare_methods "$(DATA)" "$(OUT)" $(ARGS)

first: $(INSTALLED) ## a table of docs/compared.md: models and methods on the paper's nine, into OUT; SHARED (../shared)
	@$(BIN)/python -m lab.flows.compare_methods "$(or $(SHARED),../shared)/partnet_mobility" "$(OUT)" --subset paper9 \
		--methods asset2sim,no-semantics,ivw,direct,constant,reference --engines pybullet,mujoco,sapien \
		--models "prior/household,prior/noisy,recorded/lab/answers" --settings lab/answers/settings.yaml --first docs/compared.md

recorded: $(INSTALLED) ## a scripted arm does a task with each object of OUT; ARGS="--page docs/trials.md"
	@$(BIN)/python -m flows.command record-motion "$(OUT)" $(ARGS)

figures: $(INSTALLED) ## every measured block of docs/ that is older than what it measures, hours; ONLY=first,weights; SHARED (../shared)
	@$(BIN)/python -m lab.pages.figures "$(or $(SHARED),../shared)" "$(OUT)/figures" $(ONLY)

shapes: $(INSTALLED) ## a table of docs/compared.md: Φ of methods on the same shapes, the paper's nine, into OUT; SHARED (../shared)
	@$(BIN)/python -m lab.flows.compare_methods "$(or $(SHARED),../shared)/partnet_mobility" "$(OUT)" --subset paper9 \
		--methods reference,ivw,direct,asset2sim --no-interaction --models "prior/noisy,recorded/lab/answers" \
		--settings lab/answers/settings.yaml --shapes docs/compared.md

bench-defects: $(INSTALLED) ## plant known defects in clean objects: what share is caught, and what is mended
	@$(BIN)/python -m lab.flows.bench_defects "$(OUT)"

bench-gym: $(INSTALLED) ## actions a second of a core with OUT's objects (ASSET: some); ARGS="--door PYTHON": one with robosuite, beside its door task
	@$(BIN)/python -m lab.speed.environment_rate $(if $(ASSET),$(foreach asset,$(subst $(comma), ,$(ASSET)),"$(OUT)/assets/$(asset)"),"$(OUT)"/assets/*) $(ARGS)

bench: $(INSTALLED) ## what refining takes without caches, and where its time goes; DATA (../shared/partnet_mobility), WORK; ARGS="--limit 3"
	@$(BIN)/python -m lab.flows.bench "$(if $(filter file,$(origin DATA)),../shared/partnet_mobility,$(DATA))" \
		"$(if $(WORK),$(WORK),$(OUT)/bench)" $(ARGS)

questions: $(INSTALLED) ## write five questions and OUT's answers into docs/catalog.md
	@$(BIN)/python -m lab.pages.blocks questions "$(OUT)" docs/catalog.md

summary: $(INSTALLED) ## write the table of OUT's latest run into docs/output.md
	@$(BIN)/python -m lab.pages.blocks summary "$(OUT)" docs/output.md

loaders: $(INSTALLED) ## what each engine's own loader honours of OUT's URDFs, measured, into docs/load.md
	@$(BIN)/python -m lab.pages.blocks loaders "$(OUT)" docs/load.md

held: $(INSTALLED) ## what holds in every engine, by its own URDF loader and through asset2sim.load, into docs/load.md
	@$(MAKE) --no-print-directory .venv-load/.installed || echo "Drake, Genesis or Newton cannot be installed; their rows will say so" >&2
	@$(BIN)/python -m lab.pages.blocks held "$(OUT)" docs/load.md

touched: $(INSTALLED) ## every check once more by the ways in which users get OUT's objects: load, MJCF, USD; into OUT/touched.jsonl
	@$(BIN)/python -m lab.loaders.touched "$(OUT)" "$(OUT)/touched.jsonl" $(ARGS)

# Engines that asset2sim.load knows and we do not run: Newton's solver pins another MuJoCo, Genesis brings torch
# (TORCH_INDEX is an index of its CPU builds, where yours has none).
.venv-load/.installed:
	@echo "installing Drake, Newton and Genesis into .venv-load ..."
	@$(BIN)/python -m venv --clear .venv-load && \
	.venv-load/bin/python -m pip install --quiet --disable-pip-version-check \
		$(if $(TORCH_INDEX),--extra-index-url "$(TORCH_INDEX)") drake "newton[sim]" genesis-world "torch==2.13.0"
	@touch $@

weights: $(INSTALLED) ## weigh the objects of SHARED (../shared) beside published weights, into docs/masses.md
	@$(BIN)/python -m lab.weights.compare "$(or $(SHARED),../shared)" docs/masses.md

docs: $(INSTALLED) ## the documentation: its pages from the schemas, then HTML in OUT/docs with the report of OUT, if there is one
	@$(BIN)/python -m lab.pages.reference docs
	@ASSET2SIM_REPORT="$(OUT)/report" $(BIN)/python -m sphinx -q -W --keep-going -d "$(OUT)/docs/.doctrees" docs "$(OUT)/docs" && echo "see $(OUT)/docs/index.html"

picture: $(INSTALLED) ## draw the README's before-and-after picture from data/raw and data/refined
	@$(BIN)/python -m lab.pages.picture data/raw data/refined docs/before_after.png \
		laptop_silver box_wooden storage_sideboard trashcan_pedal toilet_white

screenshots: $(INSTALLED) ## take the two pictures of docs/report.md from data/refined, with the system's Chromium
	@$(BIN)/python -m lab.pages.screenshots data/refined/report docs

clean: ## remove the environment, the caches and data/refined
	rm -rf $(VENV) .venv-judge .venv-load .venv-consumers .prefect data/refined .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	find schemas asset2sim tasks flows tests -name __pycache__ -type d -prune -exec rm -rf {} +
