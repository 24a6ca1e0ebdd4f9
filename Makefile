# From a task's name to an evaluated policy: make all TASK=stack. `make help` lists everything.

TASK   ?= pick-up
RUNS   ?= runs
SEED   ?= 0
# Worker threads; no result depends on them.
THREADS ?= $(shell nproc 2>/dev/null || echo 2)
# best: every documented mend; paper: as literal as can work.
PRESET ?= best
PIPELINE ?= $(if $(filter paper,$(PRESET)),pipelines/paper/$(TASK).toml,pipelines/$(TASK).toml)
# hil: hybrid imitation learning; bc: behavior cloning; sc: state cloning.
METHOD ?= hil
# 1: an interrupted training goes on from its checkpoint.
RESUME ?=
# Overrides, separated by blanks: SET="plan.speed=0.5 train.rho=0.3".
SET    ?=

SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:
.SUFFIXES:
.DEFAULT_GOAL := help
MAKEFLAGS += --no-builtin-rules

TASKS := pick-up pick-and-place stack
PRESETS := best paper
ifneq ($(filter-out $(TASKS),$(TASK)),)
  $(error unknown TASK "$(TASK)"; allowed: $(TASKS))
endif
ifneq ($(filter-out $(PRESETS),$(PRESET)),)
  $(error unknown PRESET "$(PRESET)"; allowed: $(PRESETS))
endif

CARGO := $(shell command -v cargo 2>/dev/null)
HILT := $(or $(CARGO_TARGET_DIR),target)/release/hilt
SOURCES := $(shell find src pipelines proto build.rs Cargo.toml Cargo.lock -type f 2>/dev/null)

DIR := $(RUNS)/$(TASK)
FLAGS = --pipeline $(PIPELINE) --task $(TASK) --seed $(SEED) $(addprefix --set ,$(SET))
RUN = --threads $(THREADS) --log $(DIR)/logs/$(1).log
# Exit code 3 says that episodes were dropped, counted and named; the rest of the artefact is whole.
DONE = || test $$? -eq 3

.PHONY: all smoke test check interop qemu bench help clean-runs build need-cargo FORCE

all: $(DIR)/evaluation.json ## run every stage of TASK; writes RUNS/TASK/policy.safetensors and RUNS/TASK/evaluation.json

# --- the stages -----------------------------------------------------------------------------------------------------------------

$(DIR)/plans.parquet: $(DIR)/settings/plan.toml | $(HILT)
	$(HILT) plan $(FLAGS) $(call RUN,plan) --out $@ $(DONE)

$(DIR)/recordings: $(DIR)/plans.parquet $(DIR)/settings/simulate.toml | $(HILT)
	$(HILT) simulate $(FLAGS) $(call RUN,simulate) --plans $< --out $@ $(DONE)

$(DIR)/dataset: $(DIR)/recordings $(DIR)/settings/convert.toml | $(HILT)
	$(HILT) convert $(FLAGS) $(call RUN,convert) --recordings $< --out $@ $(DONE)

$(DIR)/dynamics.safetensors: $(DIR)/dataset $(DIR)/settings/pretrain.toml | $(HILT)
	$(HILT) pretrain $(FLAGS) $(call RUN,pretrain) --dataset $< --out $@

$(DIR)/policy.safetensors: $(DIR)/dynamics.safetensors $(DIR)/settings/train.toml | $(HILT)
	$(HILT) train $(FLAGS) $(call RUN,train) --method $(METHOD) --dataset $(DIR)/dataset --dynamics $< --out $@ $(if $(filter-out 0,$(RESUME)),--resume)

$(DIR)/evaluation.json: $(DIR)/policy.safetensors $(DIR)/settings/evaluate.toml | $(HILT)
	$(HILT) evaluate $(FLAGS) $(call RUN,evaluate) --policy $< --out $@

# The settings that a stage reads, written anew only when they change: so a changed key reruns its stage and what follows, no more.
$(DIR)/settings/%.toml: FORCE | $(HILT)
	@mkdir -p $(@D)
	@{ $(HILT) settings $(FLAGS) --stage $*; echo '# method $(if $(filter train,$*),$(METHOD),-)'; } > $@.new || { rm -f $@.new; exit 2; }
	@if cmp -s $@.new $@; then rm $@.new; else mv $@.new $@; fi

.SECONDARY:
FORCE:

# --- the binary -----------------------------------------------------------------------------------------------------------------

build: $(HILT) ## build the optimised binary

$(HILT): $(SOURCES) | need-cargo
	cargo build --release --locked
	@touch $@

need-cargo:
	@$(if $(CARGO),:,echo "cargo is missing: install Rust from https://rustup.rs and open a new shell" >&2; exit 1)

# --- checks ---------------------------------------------------------------------------------------------------------------------

# A few episodes, a few updates: every stage runs, nothing is learned.
SMOKE := plan.episodes=12 pretrain.epochs=2 train.warm_start_updates=50 train.epochs=1 train.min_updates=0 evaluate.episodes=8
smoke: build ## a tiny run of all stages under RUNS/smoke/TASK, in less than a minute
	$(MAKE) --no-print-directory all RUNS=$(RUNS)/smoke SET="$(SMOKE) $(SET)"
	$(HILT) evaluate $(FLAGS) --threads $(THREADS) --policy planner --episodes 8
	$(HILT) inspect $(RUNS)/smoke/$(TASK)/policy.safetensors
	$(HILT) render $(RUNS)/smoke/$(TASK)/recordings/episode-00000.mcap --png --out $(RUNS)/smoke/$(TASK)/episode-00000.png

test: need-cargo ## run all tests
	cargo test --release --locked

check: need-cargo ## what CI runs: format, lints, documentation, tests
	cargo fmt --check
	cargo clippy --release --locked --all-targets -- -D warnings
	RUSTDOCFLAGS="-D warnings" cargo doc --release --locked --no-deps
	cargo test --release --locked

interop: build ## tiny runs of all tasks, read by mcap, pyarrow, DuckDB, pandas, LeRobot and safetensors (needs Python 3.12)
	for task in $(TASKS); do $(MAKE) --no-print-directory all TASK=$$task RUNS=$(RUNS)/smoke SET="$(SMOKE)"; done
	tests/interop/run.sh $(RUNS)/smoke

qemu: build ## the same bytes as processors with and without FMA, all kernels, another libm (needs qemu-user and cc; minutes)
	tests/qemu.sh

bench: need-cargo ## measure planner, simulator and training
	cargo bench --locked

clean-runs: ## remove what was made for TASK under RUNS
	rm -rf $(DIR)

help: ## this list
	@echo "make TARGET [TASK=pick-up|pick-and-place|stack] [RUNS=DIR] [SEED=N] [THREADS=N] [PRESET=best|paper] [PIPELINE=FILE]"
	@echo "            [METHOD=hil|bc|sc] [RESUME=1] [SET=\"stage.key=value ...\"]"
	@grep -hE '^[a-z-]+:.*## ' $(firstword $(MAKEFILE_LIST)) | sed -E 's/^([a-z-]+):.*## (.*)$$/  \1|\2/' | column -t -s '|'
	@echo "Results are not rebuilt when only the source code changes: make clean-runs first."
