# Asset2Sim. `make` lists the targets. Paths are relative, so that the checkout may lie in a folder with a space in its name.

DATA ?= data/raw
OUT ?= data/refined
# A shell command, taken as it stands: neither make nor the recipe's shell looks into it.
override HOOK := $(value HOOK)
export HOOK

# Set and empty, they would be the current folder.
$(foreach folder,DATA OUT,$(if $(strip $($(folder))),,$(error $(folder) is empty; name a folder, or leave $(folder)= out)))

VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed

FROM_FILE = $(if $(SETTINGS),--settings "$(SETTINGS)")
# What follows an option is quoted: folders may have spaces in their names.
OPTIONS = --out "$(OUT)" $(if $(MODEL),--model "$(MODEL)") \
	$(if $(API_BASE),--api-base "$(API_BASE)") $(if $(SUBSET),--subset "$(SUBSET)") $(if $(ASSETS),--assets "$(ASSETS)") \
	$(if $(LIMIT),--limit "$(LIMIT)") $(if $(METHOD),--method "$(METHOD)") $(if $(WORKERS),--workers "$(WORKERS)") \
	$(if $(SCHEDULER),--scheduler "$(SCHEDULER)") $(if $(NO_VIEWS),--no-views,$(if $(VIEWS),--views "$(VIEWS)")) $(if $(STRICT),--strict) \
	$(if $(ENGINES),--engines "$(ENGINES)") $(if $(COLLISION),--collision "$(COLLISION)") $(if $(STATE),--state "$(STATE)") \
	$(if $(UP),--up="$(UP)") $(if $(PACKAGE),--package "$(PACKAGE)") $(if $(ALLOW_OUTSIDE),--allow-outside) \
	$(if $(DYNAMICS),--dynamics "$(DYNAMICS)") $(if $(EXPORT),--export "$(EXPORT)") $(if $(CHECK),--check "$(CHECK)") \
	$(if $(REFINEMENT_MODEL),--refinement-model "$(REFINEMENT_MODEL)") $(if $(JUDGE_MODEL),--judge-model "$(JUDGE_MODEL)") \
	$(if $(PROPOSER),--proposer "$(PROPOSER)") \
	$(if $(BUDGET_USD),--budget-usd "$(BUDGET_USD)") $(if $(BUDGET_CALLS),--budget-calls "$(BUDGET_CALLS)") \
	$(if $(CORRECT),--correct "$(CORRECT)") $(if $(SAMPLES),--samples "$(SAMPLES)") \
	$(if $(ASK_AGAIN),--ask-again) $(if $(NO_ASK_AGAIN),--no-ask-again) \
	$(if $(BUDGET_TOKENS),--budget-tokens "$(BUDGET_TOKENS)") $(if $(ASSET_BUDGET_USD),--asset-budget-usd "$(ASSET_BUDGET_USD)") \
	$(if $(ASSET_BUDGET_CALLS),--asset-budget-calls "$(ASSET_BUDGET_CALLS)") $(if $(RPM),--rpm "$(RPM)") \
	$(if $(ASSET_TIMEOUT),--asset-timeout "$(ASSET_TIMEOUT)") $(if $(MIN_SUCCESS),--min-success "$(MIN_SUCCESS)") \
	$(if $(MAX_NEW_FAILURES),--max-new-failures "$(MAX_NEW_FAILURES)") $(if $(GATE),--gate "$(GATE)") \
	$(if $(NO_ANSWER_CACHE),--no-answer-cache) $(if $(FORCE),--force) $(if $(RETRY_FAILED),--retry-failed) \
	$(if $(NO_REPORT),--no-report) $(if $(DRY_RUN),--dry-run) $(if $(KEEP_DAYS),--keep-days "$(KEEP_DAYS)") $(if $(HOOK),--hook "$$HOOK") $(FROM_FILE)

# A file's tests stay in one process and in order.
PARALLEL = --numprocesses $(if $(JOBS),$(JOBS),3) --dist loadfile --no-loadscope-reorder

comma := ,
.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help install flow test test-fast lint typecheck failures report screenshots settings learn view rate ratings views doctor nightly ui judge judged probe clone rules withheld proposers corrections compare first bench-defects bench-gym samples questions summary loaders held weights docs picture clean bench

help: ## list the targets
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "  %-14s %s\n", $$1, $$2 }' Makefile
	@echo
	@echo "  variables of flow and nightly: DATA OUT MODEL API_BASE SUBSET ASSETS LIMIT METHOD WORKERS SCHEDULER NO_VIEWS=1 VIEWS STRICT=1"
	@echo "                                 ENGINES COLLISION DYNAMICS STATE UP EXPORT CHECK REFINEMENT_MODEL PROPOSER JUDGE_MODEL RPM"
	@echo "                                 CORRECT SAMPLES ASK_AGAIN=1 NO_ASK_AGAIN=1"
	@echo "                                 PACKAGE=name=path ALLOW_OUTSIDE=1"
	@echo "                                 BUDGET_USD BUDGET_CALLS BUDGET_TOKENS ASSET_BUDGET_USD ASSET_BUDGET_CALLS NO_ANSWER_CACHE=1"
	@echo "                                 FORCE=1 RETRY_FAILED=1 NO_REPORT=1 KEEP_DAYS HOOK SETTINGS=settings.yaml DRY_RUN=1 ASSET_TIMEOUT"
	@echo "                                 MIN_SUCCESS MAX_NEW_FAILURES GATE (warn or error); of nightly: CRON='0 2 * * *' NOW=1"
	@echo "  of compare, beside those: METHODS MODELS LEVELS JUDGE_MODEL NO_INTERACTION=1 PAGE FIRST"
	@echo "  for example: make flow DATA=../shared/partnet_mobility SUBSET=paper9 OUT=/tmp/paper9 WORKERS=2"

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
	"$$python" -m venv --clear $(VENV) && \
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt \
		--editable '.[dev,browser,engines,gym,usd,s3,view]' --editable ./lab
	@touch $@

flow: $(INSTALLED) ## refine DATA (data/raw) into OUT (data/refined)
	@$(BIN)/python -m flows.command refine "$(DATA)" $(OPTIONS)

test: $(INSTALLED) ## run all tests, in JOBS processes (3: many wait); ARGS="-k dataset" chooses
	@$(BIN)/python -m pytest $(PARALLEL) $(ARGS)

test-fast: $(INSTALLED) ## run the tests that start no engine, server or process: a minute
	@$(BIN)/python -m pytest $(PARALLEL) -m "not system" $(ARGS)

lint: $(INSTALLED) ## ruff, and the contract on imports
	@$(BIN)/ruff check .
	@$(BIN)/lint-imports

typecheck: $(INSTALLED) ## mypy, strict
	@$(BIN)/mypy

failures: $(INSTALLED) ## the failure modes in OUT; REVIEWED=1: each failure with its review
	@$(BIN)/python -m flows.command failures --out "$(OUT)" $(if $(REVIEWED),--reviewed)

view: $(INSTALLED) ## look at OUT's objects, touch and review them, on a page; ASSET, PORT (8080)
	@$(BIN)/python -m flows.command view $(if $(ASSET),"$(ASSET)") --out "$(OUT)" $(if $(PORT),--port "$(PORT)") $(FROM_FILE)

rate: $(INSTALLED) ## let people rate anonymous variants in OUT, also that of compare, on a page; METHODS, ASSETS, PORT (8080)
	@$(BIN)/python -m flows.command rate "$(OUT)" $(if $(METHODS),--methods "$(METHODS)") $(if $(ASSETS),--assets "$(ASSETS)") \
		$(if $(PORT),--port "$(PORT)") $(FROM_FILE)

ratings: $(INSTALLED) ## what people made of the variants in OUT, by method; PUBLISHED: the folder of the paper's tables, beside them
	@$(BIN)/python -m flows.command ratings "$(OUT)" $(if $(PUBLISHED),--published "$(PUBLISHED)")

report: $(INSTALLED) ## write the report for people, OUT/report, as a run does at its end; FORCE=1: every page anew
	@$(BIN)/python -m flows.command report --out "$(OUT)" $(if $(WORKERS),--workers "$(WORKERS)") $(if $(FORCE),--force) $(FROM_FILE)

settings: $(INSTALLED) ## every setting with its unit and its reason, as a file for SETTINGS=
	@$(BIN)/python -m flows.command settings $(FROM_FILE)

learn: $(VENV)/.learn ## a robot learns to use OUT's objects, with PPO, into OUT; TASKS, METHODS, BUDGET, MINUTES, SEEDS, WARP, PAGE
	@$(BIN)/python -m flows.command learn "$(OUT)" --out "$(OUT)" $(if $(TASKS),--tasks "$(TASKS)") \
		$(if $(METHODS),--methods "$(METHODS)") $(if $(ASSETS),--assets "$(ASSETS)") $(if $(BUDGET),--budget "$(BUDGET)") \
		$(if $(MINUTES),--minutes "$(MINUTES)") $(if $(SEEDS),--seeds "$(SEEDS)") $(if $(WARP),--warp "$(WARP)") $(if $(WORKERS),--workers "$(WORKERS)") \
		$(if $(FORCE),--force) $(if $(PAGE),--page "$(PAGE)") $(FROM_FILE)

# torch and stable-baselines3, which nothing else needs (TORCH_INDEX is an index of its CPU builds).
$(VENV)/.learn: $(INSTALLED)
	@echo "installing torch and stable-baselines3 into $(VENV) ..."
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check --constraint constraints.txt \
		$(if $(TORCH_INDEX),--extra-index-url "$(TORCH_INDEX)") --editable . --editable './lab[learn]'
	@touch $@

views: $(INSTALLED) ## write the pictures that a run with VIEWS=later left out, into OUT
	@$(BIN)/python -m flows.command views --out "$(OUT)" $(if $(WORKERS),--workers "$(WORKERS)") $(FROM_FILE)

doctor: $(INSTALLED) ## what works on this machine
	@$(BIN)/python -m flows.command doctor --out "$(OUT)" $(if $(MODEL),--model "$(MODEL)") $(if $(API_BASE),--api-base "$(API_BASE)") \
		$(if $(REFINEMENT_MODEL),--refinement-model "$(REFINEMENT_MODEL)") $(if $(JUDGE_MODEL),--judge-model "$(JUDGE_MODEL)") \
		$(FROM_FILE)

nightly: $(INSTALLED) ## refine DATA into OUT on the schedule of catalog.yaml or CRON, until interrupted; NOW=1: once, at once
	@$(BIN)/python -m flows.command nightly "$(DATA)" $(OPTIONS) $(if $(CRON),--cron "$(CRON)") $(if $(NOW),--now)

ui: $(INSTALLED) ## the report, Prefect's and MLflow's pages, until interrupted; REPORT_PORT (4100), PREFECT_PORT (4200), MLFLOW_PORT (5000)
	@$(BIN)/python -m flows.command ui --out "$(OUT)" $(if $(REPORT_PORT),--report-port "$(REPORT_PORT)") $(if $(PREFECT_PORT),--prefect-port "$(PREFECT_PORT)") \
		$(if $(MLFLOW_PORT),--mlflow-port "$(MLFLOW_PORT)")

samples: $(INSTALLED) ## make data/raw anew, byte for byte
	@$(BIN)/python -m lab.samples.sample_dataset

judge: $(INSTALLED) .venv-judge/.installed ## an independent checker, simcheck, over OUT
	@$(BIN)/python -m lab.simcheck.checker "$(OUT)" $(if $(JOBS),--jobs "$(JOBS)")

.venv-judge/.installed:
	@echo "installing simcheck into .venv-judge ..."
	@$(BIN)/python -m venv --clear .venv-judge && \
	.venv-judge/bin/python -m pip install --quiet --disable-pip-version-check "simcheck[all]" networkx  # which its mesh checks need
	@touch $@

judged: $(INSTALLED) ## record, judge and rate variants of OUT, a run or a comparison; JUDGES, TRIALS, FRAMES, SEED, PAGE, README
	@$(BIN)/python -m flows.command record-motion "$(OUT)" $(if $(PAGE),--page "$(PAGE)") $(if $(README),--readme "$(README)")
	@$(BIN)/python -m flows.command judge-videos "$(OUT)" $(if $(JUDGES),--judges "$(JUDGES)") $(if $(TRIALS),--trials "$(TRIALS)") \
		$(if $(FRAMES),--frames "$(FRAMES)") $(if $(SEED),--seed "$(SEED)") $(if $(API_BASE),--api-base "$(API_BASE)") \
		$(if $(BUDGET_USD),--budget-usd "$(BUDGET_USD)") $(if $(BUDGET_CALLS),--budget-calls "$(BUDGET_CALLS)") $(FROM_FILE)
	@$(BIN)/python -m flows.command ratings "$(OUT)"

probe: $(INSTALLED) ## POLICY (openpi://HOST:PORT, or scripted) does the paper's tasks with variants of OUT; NAME, TRIALS, METHODS, PAGE, README
	@$(BIN)/python -m flows.command probe "$(OUT)" --policy "$(or $(POLICY),scripted)" $(if $(NAME),--name "$(NAME)") \
		$(if $(TRIALS),--trials "$(TRIALS)") $(if $(METHODS),--methods "$(METHODS)") $(if $(ASSETS),--assets "$(ASSETS)") \
		$(if $(WORKERS),--workers "$(WORKERS)") $(if $(FORCE),--force) $(if $(PUBLISHED),--published "$(PUBLISHED)") \
		$(if $(NETWORK),--network "$(NETWORK)") $(if $(PAGE),--page "$(PAGE)") $(if $(README),--readme "$(README)") $(FROM_FILE)

clone: $(INSTALLED) ## a network learns from the scripted expert what to do with the objects of OUT, into TO (OUT/clone); COUNT
	@$(BIN)/python -m lab.flows.clone_expert "$(OUT)" "$(or $(TO),$(OUT)/clone)" $(if $(COUNT),--count "$(COUNT)")

rules: $(INSTALLED) ## refine DATA as it came, with the paper's ranges and by ours, and write the table of docs/measured.md
	@$(BIN)/python -m lab.flows.compare rules "$(DATA)" "$(OUT)" docs/measured.md

withheld: $(INSTALLED) ## DATA without labels, and with each category left out of the tables: a table of docs/measured.md
	@$(BIN)/python -m lab.flows.compare withheld "$(DATA)" "$(OUT)" docs/measured.md

proposers: $(INSTALLED) ## a search first, or a model at every step, on what overlaps: a table of docs/method.md; MODELS, ASSETS
	@$(BIN)/python -m lab.flows.compare proposers "$(DATA)" $(if $(filter file,$(origin DATA)),,data/raw) --out "$(OUT)" --page docs/method.md \
		$(if $(MODELS),--models "$(MODELS)") $(if $(ASSETS),--assets "$(ASSETS)")

corrections: $(INSTALLED) ## answers of MODELS over SUBSET as they are, corrected, asked again: a table of docs/measured.md
	@$(BIN)/python -m lab.flows.compare corrections "$(DATA)" "$(OUT)" $(if $(MODELS),--models "$(MODELS)") \
		$(if $(SUBSET),--subset "$(SUBSET)") --page docs/measured.md

compare: $(INSTALLED) ## methods and models on the same objects: the paper's tables and charts, into OUT
	@$(BIN)/python -m lab.flows.compare_methods "$(DATA)" "$(OUT)" $(if $(SUBSET),--subset "$(SUBSET)") \
		$(if $(ASSETS),--assets "$(ASSETS)") $(if $(LIMIT),--limit "$(LIMIT)") $(if $(METHODS),--methods "$(METHODS)") \
		$(if $(MODELS),--models "$(MODELS)") $(if $(LEVELS),--levels "$(LEVELS)") $(if $(ENGINES),--engines "$(ENGINES)") \
		$(if $(API_BASE),--api-base "$(API_BASE)") $(if $(JUDGE_MODEL),--judge-model "$(JUDGE_MODEL)") \
		$(if $(NO_INTERACTION),--no-interaction) $(if $(WORKERS),--workers "$(WORKERS)") $(if $(PAGE),--page "$(PAGE)") \
		$(if $(FIRST),--first "$(FIRST)") $(FROM_FILE)

first: $(INSTALLED) ## a table of docs/measured.md: models and methods on the paper's nine, into OUT; SHARED (../shared)
	@$(BIN)/python -m lab.flows.compare_methods "$(or $(SHARED),../shared)/partnet_mobility" "$(OUT)" --subset paper9 \
		--methods asset2sim,direct,constant,reference --engines pybullet,mujoco,sapien --first docs/measured.md \
		--models "prior/household,prior/noisy,recorded/$(or $(SHARED),../shared)/vlm_answers"

bench-defects: $(INSTALLED) ## plant known defects in clean objects: what share is caught, and what is mended
	@$(BIN)/python -m lab.flows.bench_defects "$(OUT)"

bench-gym: $(INSTALLED) ## actions a second of a core with OUT's objects, ASSETS; DOOR: a Python with robosuite, beside its door task
	@$(BIN)/python -m lab.speed.environment_rate $(if $(ASSETS),$(foreach asset,$(subst $(comma), ,$(ASSETS)),"$(OUT)/assets/$(asset)"),"$(OUT)"/assets/*) \
		$(if $(DOOR),--door "$(DOOR)")

bench: $(INSTALLED) ## how fast a night is, and where its time goes; DATA (../shared/partnet_mobility), WORK, LIMIT
	@$(MAKE) --no-print-directory .venv-judge/.installed || echo "simcheck cannot be installed; its line will say so" >&2
	@$(BIN)/python -m lab.flows.bench "$(if $(filter file,$(origin DATA)),../shared/partnet_mobility,$(DATA))" \
		"$(if $(WORK),$(WORK),$(OUT)/bench)" $(if $(LIMIT),--limit "$(LIMIT)") $(if $(STRICT),--strict) $(ARGS)

questions: $(INSTALLED) ## write five questions and OUT's answers into docs/catalog.md
	@$(BIN)/python -m lab.pages.blocks questions "$(OUT)" docs/catalog.md

summary: $(INSTALLED) ## write the table of OUT's latest run into docs/output.md
	@$(BIN)/python -m lab.pages.blocks summary "$(OUT)" docs/output.md

loaders: $(INSTALLED) ## what each engine's own loader honours of OUT's URDFs, measured, into docs/load.md
	@$(BIN)/python -m lab.loaders.loader_table "$(OUT)" docs/load.md

held: $(INSTALLED) ## what holds in every engine, by its own URDF loader and through asset2sim.load, into docs/load.md
	@$(MAKE) --no-print-directory .venv-load/.installed || echo "Drake, Genesis or Newton cannot be installed; their rows will say so" >&2
	@$(BIN)/python -m lab.loaders.held_table "$(OUT)" docs/load.md

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

docs: $(INSTALLED) ## the documentation: its pages from the schemas, then HTML in OUT/docs
	@$(BIN)/python -m lab.pages.reference docs
	@$(BIN)/python -m sphinx -q -W --keep-going -d "$(OUT)/docs/.doctrees" docs "$(OUT)/docs" && echo "see $(OUT)/docs/index.html"

picture: $(INSTALLED) ## draw the README's before-and-after picture from data/raw and data/refined
	@$(BIN)/python -m lab.pages.picture data/raw data/refined docs/before_after.png \
		laptop_silver box_wooden storage_sideboard trashcan_pedal toilet_white

screenshots: $(INSTALLED) ## take the README's two pictures of the report of data/refined, with the system's Chromium
	@$(BIN)/python -m lab.pages.screenshots data/refined/report docs

clean: ## remove the environment, the caches and data/refined
	rm -rf $(VENV) .venv-judge .venv-load .prefect data/refined .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	find schemas asset2sim tasks flows tests -name __pycache__ -type d -prune -exec rm -rf {} +
