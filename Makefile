# From a task's name to an evaluated policy: make all TASK=stack. `make help` lists everything.

# A task that comes with hilt, or the TOML file of another.
TASK   ?= pick-up
RUNS   ?= runs
SEED   ?= 0
# best: every documented mend; paper: as literal as can work; mended: paper with the mends that lift hil above bc.
PRESET ?= best
# Robot: jaco, panda, ur5e, or the TOML file of another. Another than the pipeline's has a directory of its own, RUNS/ROBOT.
ROBOT  ?=
PAPER_TASKS := pick-up pick-and-place stack
TASKS := $(PAPER_TASKS) tower sort bin
# Where TASK is a file, that.
TASK_FILE = $(if $(filter %.toml,$(TASK)),$(TASK))
TASK_NAME = $(basename $(notdir $(TASK)))
PIPELINE_best   = $(or $(TASK_FILE),pipelines/$(TASK).toml)
# Of the paper's own tasks; what it did for stacking is what the preset has for others.
PIPELINE_paper  = $(if $(filter $(PAPER_TASKS),$(TASK)),pipelines/paper/$(TASK).toml,pipelines/paper/other.toml)
PIPELINE_mended = pipelines/mended.toml
PIPELINE ?= $(PIPELINE_$(PRESET))
# hil: hybrid imitation learning; bc: behavior cloning; sc: state cloning; bc-rl: behavior cloning, then reinforcement learning with its loss: all
# share the demos. ppo: reinforcement learning, which needs none.
# Each has a policy of its own in RUNS/TASK.
METHOD ?= hil
# 1: an interrupted training goes on from its checkpoint. Planning and simulation go on by themselves.
RESUME ?=
# Seconds between two checkpoints of training.
CHECKPOINT ?= 60
# 1: pretraining and training write their metrics as they come beside their weights, for hilt plot --watch RUNS/TASK.
LIVE   ?=
# Overrides, separated by blanks: SET="plan.speed=0.5 train.rho=0.3"; a blank inside brackets or quotes belongs to the value.
SET    ?=
# An experiment's name; its seeds (0-4,9) and episodes, and how many of its steps run side by side, where not as its file or hilt has them.
NAME     ?= smoke
SEEDS    ?=
EPISODES ?=
JOBS     ?=
# Worker threads; no result depends on them.
ifeq ($(origin THREADS),undefined)
  THREADS := $(shell nproc 2>/dev/null || sysctl -n hw.ncpu 2>/dev/null || echo 2)
endif

SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:
.SUFFIXES:
.DEFAULT_GOAL := help
MAKEFLAGS += --no-builtin-rules

# --- the variables, refused before anything is done ---------------------------------------------------------------------------------

define newline


endef
# What was typed, to the letter: a dollar sign in it names no variable, a line break is a blank.
typed = $(subst $(newline), ,$(if $(filter file,$(origin $(1))),$($(1)),$(value $(1))))
override TASK       := $(strip $(call typed,TASK))
override RUNS       := $(call typed,RUNS)
override SEED       := $(strip $(call typed,SEED))
override PRESET     := $(strip $(call typed,PRESET))
override PIPELINE   := $(call typed,PIPELINE)
override METHOD     := $(strip $(call typed,METHOD))
override ROBOT      := $(call typed,ROBOT)
override RESUME     := $(strip $(call typed,RESUME))
override CHECKPOINT := $(strip $(call typed,CHECKPOINT))
override LIVE       := $(strip $(call typed,LIVE))
override SET        := $(call typed,SET)
override NAME       := $(strip $(call typed,NAME))
override SEEDS      := $(strip $(call typed,SEEDS))
override EPISODES   := $(strip $(call typed,EPISODES))
override JOBS       := $(strip $(call typed,JOBS))
override THREADS    := $(strip $(call typed,THREADS))

PRESETS := best mended paper
METHODS := hil bc sc ppo bc-rl
# What a method learns from: by its artefact, the last stage before training.
LEARNS_FROM := $(if $(filter ppo,$(METHOD)),,$(if $(filter bc-rl,$(METHOD)),convert,pretrain))
EXPERIMENTS := $(patsubst pipelines/experiments/%.toml,%,$(wildcard pipelines/experiments/*.toml))

# Characters that mean something to make or to a shell.
ODD := ' " ` \ : ; % & | < > ( ) { } [ ] * ? ! ~ = $$ \#
is-odd = $(strip $(foreach c,$(ODD),$(findstring $c,$(1))) $(word 2,x$(1)x))
# As one word of a command line.
word-of = $(if $(call is-odd,$(1)),'$(subst ','\'',$(1))',$(1))
one-of = $(if $(filter-out 1,$(words $($(1))))$(filter-out $(2),$($(1))),$(error $(1) is "$($(1))": it must be one of: $(2)))
not-digits = $(subst 0,,$(subst 1,,$(subst 2,,$(subst 3,,$(subst 4,,$(subst 5,,$(subst 6,,$(subst 7,,$(subst 8,,$(subst 9,,$(1)))))))))))
number = $(if $($(1)),$(if $(call not-digits,$($(1))),$(error $(1) is "$($(1))": it must be a whole number)),$(error $(1) is empty: it must be a whole number))

$(if $(TASK_FILE),$(if $(call is-odd,$(notdir $(TASK)))$(filter -%,$(TASK)),$(error TASK is "$(TASK)": a file's name must be without blanks and without any of $(ODD))),$(call one-of,TASK,$(TASKS)))
$(call one-of,PRESET,$(PRESETS))
$(call one-of,METHOD,$(METHODS))
$(if $(RESUME),$(call one-of,RESUME,0 1))
$(if $(LIVE),$(call one-of,LIVE,0 1))
$(call number,SEED)
$(call number,THREADS)
$(call number,CHECKPOINT)
$(if $(strip $(RUNS)),,$(error RUNS is empty: it must name a directory, for example RUNS=runs))
$(if $(call is-odd,$(RUNS))$(filter -%,$(RUNS)),$(error RUNS is "$(RUNS)": it must name a directory without blanks, without a leading - and without any of $(ODD)))
$(if $(call is-odd,$(notdir $(ROBOT)))$(filter -%,$(ROBOT)),$(error ROBOT is "$(ROBOT)": it must name a robot or its TOML file, whose name is without blanks and without any of $(ODD)))
$(if $(strip $(PIPELINE)),,$(error PIPELINE is empty: it must name a file with settings, for example pipelines/stack.toml))

# --- the run ------------------------------------------------------------------------------------------------------------------------

# A target directory of cargo's that make cannot name gets a link: target/release/hilt is there in any case.
plain = $(if $(call is-odd,$(1)),,$(1))
HILT := $(or $(call plain,$(CARGO_TARGET_DIR)),$(call plain,$(CARGO_BUILD_TARGET_DIR)),target)/release/hilt

ROBOT_DIR := $(if $(strip $(ROBOT)),$(basename $(notdir $(ROBOT)))/)
DIR := $(RUNS)/$(ROBOT_DIR)$(TASK_NAME)
# What stands in the names of a method's own files.
OF := $(patsubst %,-%,$(filter-out hil,$(METHOD)))
FLAGS := --pipeline $(call word-of,$(PIPELINE)) --task $(call word-of,$(TASK)) $(if $(strip $(ROBOT)),--robot $(call word-of,$(ROBOT))) --seed $(SEED) $(if $(strip $(SET)),--sets $(call word-of,$(SET)))
RUN = --threads $(THREADS) --log $(DIR)/logs/$(1).log
SETTINGS := $(HILT) settings $(FLAGS) --threads $(THREADS)
MADE := pipelines/made.sh $(DIR) $(METHOD)

PLANS      := $(DIR)/plans.parquet
RECORDINGS := $(DIR)/recordings
DATASET    := $(DIR)/dataset
DYNAMICS   := $(DIR)/dynamics.safetensors
POLICY     := $(DIR)/policy$(OF).safetensors
EVALUATION := $(DIR)/evaluation$(OF).json
ARTEFACTS  := $(PLANS) $(RECORDINGS) $(DATASET) $(DYNAMICS) $(POLICY) $(EVALUATION)

.PHONY: all stages smoke experiment table2 table3 figure7 figures report test cluster-test check transfer meta-world interop report-test view-test qemu bench fuzz help clean-runs build install need-cargo FORCE $(ARTEFACTS)

all: $(EVALUATION) ## run every stage of TASK; writes RUNS/TASK/policy.safetensors and RUNS/TASK/evaluation.json
	@$(MADE) result

# Up to one artefact. Settings are refused before anything is touched; what is out of date is asked of a binary that is up to date.
$(PLANS):      LAST := plan
$(RECORDINGS): LAST := simulate
$(DATASET):    LAST := convert
$(DYNAMICS):   LAST := pretrain
$(POLICY):     LAST := train$(OF)
$(EVALUATION): LAST := evaluate$(OF)
$(ARTEFACTS): $(HILT)
	@$(SETTINGS) > /dev/null
	@$(MAKE) --no-print-directory stages LAST=$(LAST)

# --- the stages ---------------------------------------------------------------------------------------------------------------------

# A stage's target says what its artefact was made with and how large it was left: DIR/settings/STAGE.toml, written when the stage has
# succeeded. A run that fails or is stopped leaves it, and the artefact, as they are.
STAMP := $(DIR)/settings
STAGE_GOAL := $(filter stages,$(MAKECMDGOALS))
stages: $(STAMP)/$(LAST).toml
	@:

ifneq ($(STAGE_GOAL),)
# Stages whose settings or artefacts are others than those that make left.
$(patsubst %,$(STAMP)/%.toml,$(shell $(MADE) stale $(SETTINGS))): FORCE
endif
FORCE:

# Dropped episodes are counted and named, and the rest of the artefact is whole. A stage is one command without a shell around it, so
# that a signal to make reaches it and make waits for its end.
$(STAMP)/plan.toml:
	@$(MADE) start plan $(SETTINGS)
	$(HILT) plan $(FLAGS) $(call RUN,plan) --allow-dropped --out $(PLANS)
	@$(MADE) done plan

$(STAMP)/simulate.toml: $(STAMP)/plan.toml
	@$(MADE) start simulate $(SETTINGS)
	$(HILT) simulate $(FLAGS) $(call RUN,simulate) --allow-dropped --plans $(PLANS) --out $(RECORDINGS)
	@$(MADE) done simulate

$(STAMP)/convert.toml: $(STAMP)/simulate.toml
	@$(MADE) start convert $(SETTINGS)
	$(HILT) convert $(FLAGS) $(call RUN,convert) --allow-dropped --recordings $(RECORDINGS) --out $(DATASET)
	@$(MADE) done convert

$(STAMP)/pretrain.toml: $(STAMP)/convert.toml
	@$(MADE) start pretrain $(SETTINGS)
	$(HILT) pretrain $(FLAGS) $(call RUN,pretrain) --dataset $(DATASET) --out $(DYNAMICS)$(if $(filter 1,$(LIVE)), --live $(DYNAMICS:.safetensors=.pretraining.jsonl))
	@$(MADE) done pretrain

$(STAMP)/train$(OF).toml: $(LEARNS_FROM:%=$(STAMP)/%.toml)
	@$(MADE) start train $(SETTINGS)
	$(HILT) train $(FLAGS) $(call RUN,train$(OF)) --method $(METHOD) $(if $(LEARNS_FROM),--dataset $(DATASET)) $(if $(filter pretrain,$(LEARNS_FROM)),--dynamics $(DYNAMICS)) --out $(POLICY) --checkpoint-every $(CHECKPOINT) $(if $(filter 1,$(RESUME)),--resume)$(if $(filter 1,$(LIVE)), --live $(POLICY:.safetensors=.training.jsonl))
	@$(MADE) done train

$(STAMP)/evaluate$(OF).toml: $(STAMP)/train$(OF).toml
	@$(MADE) start evaluate $(SETTINGS)
	$(HILT) evaluate $(FLAGS) $(call RUN,evaluate$(OF)) --policy $(POLICY) --out $(EVALUATION)
	@$(MADE) done evaluate

# --- experiments --------------------------------------------------------------------------------------------------------------------

# What is finished of them is not done again; hilt itself sees to that.
optional = $(if $($(2)),--$(1) $(call word-of,$($(2))))
EXPERIMENT = $(HILT) experiment $(1) --dir $(RUNS)/experiments/$(1) --threads $(THREADS) $(call optional,seeds,SEEDS) $(call optional,episodes,EPISODES) $(call optional,jobs,JOBS)

experiment: $(HILT) ## run experiment NAME of pipelines/experiments under RUNS/experiments/NAME
	@:$(call one-of,NAME,$(EXPERIMENTS))
	$(call EXPERIMENT,$(NAME))

table2: $(HILT) ## the paper's Table 2 (hours); SEEDS=0-1 EPISODES=20 for less
table3: $(HILT) ## the paper's Table 3 (hours)
table2 table3:
	$(call EXPERIMENT,$@)

OTHER_EXPERIMENTS := $(filter-out table2 table3 smoke figure7,$(EXPERIMENTS))
.PHONY: $(OTHER_EXPERIMENTS)
$(OTHER_EXPERIMENTS): $(HILT)
	$(call EXPERIMENT,$@)

# One figure of the paper: imitation without a warm start and with one, and reinforcement learning.
figure7: $(HILT)
	$(call EXPERIMENT,figure7)
	$(call EXPERIMENT,figure7-warm)
	$(call EXPERIMENT,figure7-rl)

figures: figure6 figure7 figure8 ## the runs behind the paper's figures 6, 7 and 8

report: $(HILT) ## a page of the experiments that have finished runs: RUNS/report/index.html
	$(HILT) report --runs $(RUNS)/experiments --out $(RUNS)/report --threads $(THREADS) $(call optional,seeds,SEEDS) $(call optional,episodes,EPISODES)

# --- the binary ---------------------------------------------------------------------------------------------------------------------

build: $(HILT) ## build the optimised binary

# An empty file is no binary.
SOURCES := $(if $(STAGE_GOAL),,$(shell find src pipelines proto build.rs Cargo.toml Cargo.lock -type f 2>/dev/null || true; test -s $(HILT) || echo FORCE))

# cargo says where it built: its own settings may name another directory or another target.
$(HILT): $(SOURCES)
	@command -v cargo > /dev/null || { echo "make: $@ is missing or older than its sources, and cargo is missing: install Rust from https://rustup.rs and open a new shell" >&2; exit 1; }
	@echo cargo build --release --locked
	@built=$$(cargo build --release --locked --message-format json-render-diagnostics | sed -n 's/.*"executable":"\([^"]*\)".*/\1/p' | tail -n 1); \
	if test -s "$$built" && ! test "$$built" -ef $@; then mkdir -p $(@D) && ln -sf "$$built" $@; fi
	@test -s $@ || { echo "make: cargo build has left no $@" >&2; exit 1; }
	@touch -c $@

PREFIX ?= /usr/local
install: $(HILT) ## hilt, its manual pages and completions of bash, zsh and fish under PREFIX (/usr/local)
	install -d $(DESTDIR)$(PREFIX)/bin $(DESTDIR)$(PREFIX)/share/bash-completion/completions \
	    $(DESTDIR)$(PREFIX)/share/zsh/site-functions $(DESTDIR)$(PREFIX)/share/fish/vendor_completions.d
	install -m 755 $(HILT) $(DESTDIR)$(PREFIX)/bin/hilt
	$(HILT) man $(DESTDIR)$(PREFIX)/share/man/man1
	$(HILT) completions bash > $(DESTDIR)$(PREFIX)/share/bash-completion/completions/hilt
	$(HILT) completions zsh > $(DESTDIR)$(PREFIX)/share/zsh/site-functions/_hilt
	$(HILT) completions fish > $(DESTDIR)$(PREFIX)/share/fish/vendor_completions.d/hilt.fish

need-cargo:
	@command -v cargo > /dev/null || { echo "make: cargo is missing: install Rust from https://rustup.rs and open a new shell" >&2; exit 1; }

# --- checks -------------------------------------------------------------------------------------------------------------------------

# A few episodes, a few updates: every stage runs, nothing is learned.
SMOKE := plan.episodes=12 pretrain.epochs=2 train.warm_start_updates=50 train.epochs=1 train.min_updates=0 evaluate.episodes=8
SMOKE_DIR := $(RUNS)/smoke/$(ROBOT_DIR)$(TASK_NAME)
smoke: build ## a tiny run of all stages under RUNS/smoke/TASK, in less than a minute
	@$(MAKE) --no-print-directory all RUNS=$(RUNS)/smoke SET=$(call word-of,$(SMOKE) $(SET))
	$(HILT) evaluate $(FLAGS) --threads $(THREADS) --policy planner --episodes 8
	$(HILT) inspect $(SMOKE_DIR)/policy$(OF).safetensors
	$(HILT) render $(SMOKE_DIR)/recordings/episode-00000.mcap --png --out $(SMOKE_DIR)/episode-00000.png

test: need-cargo ## run all tests
	cargo test --release --locked

check: need-cargo ## what CI runs: format, lints, documentation, tests
	cargo fmt --check
	cargo clippy --release --locked --all-targets -- -D warnings
	RUSTDOCFLAGS="-D warnings" cargo doc --release --locked --no-deps
	cargo test --release --locked

cluster-test: build ## a tiny experiment through Snakemake and through Slurm on this machine, the bytes of a plain run (needs root, installs both)
	tests/cluster/run.sh $(HILT)

transfer: ## the policy of TASK on DeepMind's Jaco in MuJoCo, EPISODES of them (500): RUNS/TASK/transfer (needs Python 3.11; docs/transfer.md)
	@:$(if $(EPISODES),$(call number,EPISODES))
	@:$(if $(filter-out $(PAPER_TASKS),$(TASK))$(filter-out jaco,$(ROBOT)),$(error make transfer knows the tasks $(PAPER_TASKS) on the jaco, not TASK=$(TASK) ROBOT=$(ROBOT)))
	@$(MAKE) --no-print-directory all
	python/transfer/run.sh $(HILT) $(POLICY) $(EVALUATION:.json=.episodes.parquet) $(DIR)/transfer$(OF) $(or $(EPISODES),500) $(call word-of,$(basename $(notdir $(PIPELINE)))$(OF))

meta-world: build ## BC, HIL and two rivals on Meta-World's 50 tasks: RUNS/meta-world (hours; stopped, it goes on; SEEDS, EPISODES, JOBS; needs Python 3.11; docs/meta-world.md)
	python/meta_world/run.sh $(HILT) $(RUNS)/meta-world $(RUNS)/meta-world-report $(if $(SEEDS),--seeds $(SEEDS)) $(if $(EPISODES),--episodes $(EPISODES)) $(if $(JOBS),--jobs $(JOBS))

interop: build ## tiny runs of all tasks, read by mcap, pyarrow, DuckDB, pandas, LeRobot, safetensors, ONNX, driven by openpi's client and Stable-Baselines3, and the tests under python (needs Python 3.12)
	for task in $(TASKS); do $(MAKE) --no-print-directory all TASK=$$task RUNS=$(RUNS)/smoke SET="$(SMOKE)"; done
	tests/interop/policies.sh $(HILT) $(RUNS)/smoke
	tests/interop/run.sh $(RUNS)/smoke $(HILT)

report-test: report ## open that page in headless Chromium: no network, no errors, every figure (needs Python 3; installs Playwright and Chromium)
	tests/report/browser.sh $(RUNS)/report

view-test: build ## play a page of hilt view in headless Chromium and compare its poses with the recordings (as report-test)
	$(HILT) evaluate --task $(TASK) --policy planner --episodes 4 --record $(RUNS)/view-test/recordings
	$(HILT) view $(RUNS)/view-test/recordings --no-open --out $(RUNS)/view-test/page.html
	tests/report/browser.sh $(RUNS)/view-test/page.html $(RUNS)/view-test/recordings/*.mcap

qemu: build ## the same bytes as processors with and without FMA, all kernels, another libm (needs qemu-user and cc; minutes)
	tests/qemu.sh

bench: need-cargo ## measure planner, simulator and training
	cargo bench --locked --bench plan --bench simulate --bench hil

fuzz: need-cargo ## give every reader of files mutated inputs, INPUTS of them (200000), and count what goes wrong
	cargo bench --locked --bench fuzz -- --inputs $(or $(INPUTS),200000)

clean-runs: ## remove what was made for TASK under RUNS; files that make did not make stay
	@$(MADE) clean

help: ## this list
	@echo "make TARGET [TASK=$(subst $( ) ,|,$(TASKS))|FILE.toml] [ROBOT=jaco|panda|ur5e|FILE.toml] [RUNS=DIR] [SEED=N] [THREADS=N] [PRESET=best|mended|paper] [PIPELINE=FILE]"
	@echo "            [METHOD=hil|bc|sc|ppo|bc-rl] [RESUME=1] [LIVE=1] [CHECKPOINT=SECONDS] [SET=\"stage.key=value ...\"]"
	@echo "            experiments: [NAME=$(subst $( ) ,|,$(EXPERIMENTS))] [SEEDS=0-4,9] [EPISODES=N] [JOBS=N]"
	@awk -F ':.*## ' '/^[a-z0-9 -]+:.*## / { printf "  %-12s %s\n", $$1, $$2 }' $(firstword $(MAKEFILE_LIST))
	@echo "RUNS is a directory without blanks and special characters. METHOD=bc writes policy-bc.safetensors and evaluation-bc.json beside those of hil."
	@echo "Results are not rebuilt when only the source code changes: make clean-runs first."
