# Every target sets the workspace up first; where that is done already it costs nothing.
SHELL := /bin/bash
.DEFAULT_GOAL := help
.PHONY: help setup training run demo test fast coverage bench checks types fuzz lint blind-check results clean

WITH_ENV := . ./env.sh &&
DATA ?= $(wildcard ../shared/data)

help:     ## say what can be made
	@sed -nE 's/^([a-z-]+): .*## (.*)/make \1\t\2/p' Makefile | expand -t 20

setup:    ## set the workspace up: environment, messages, nodes
	@sh tools/setup.sh

training: ## set up, and fetch torch, which only the training of networks needs
	@sh tools/setup.sh --training

run: setup  ## drive, twin, record and replay the emulated bench, then diagnose one; BAG=... [SERVO=...] for a recording
	@$(WITH_ENV) servo-twin run $(if $(BAG),--bag "$(BAG)") $(if $(SERVO),--servo "$(SERVO)") $(ARGS)
	@$(if $(BAG)$(ARGS),,$(WITH_ENV) bash tools/demonstrate.sh)

demo: setup  ## leave an effect out of a twin, record, diagnose: the answer beside the truth
	@$(WITH_ENV) bash tools/demonstrate.sh

test: training  ## run the tests; ARGS=... goes to pytest
	@$(WITH_ENV) python -m pytest tests -n 2 $(ARGS)

fast: setup  ## run the tests that start no ROS graph and take less than five seconds each
	@$(WITH_ENV) python -m pytest tests -n 2 -m 'not slow and not ros' $(ARGS)

checks: lint types  ## check style, words, links, imports, packages, security and types; a minute
	@$(WITH_ENV) python -m pytest -q tests/house/test_words.py tests/house/test_pages.py \
	    tests/house/test_imports.py tests/house/test_packages.py tests/house/test_security.py

types: setup  ## check the types of the physics and of the front door
	@$(WITH_ENV) mypy

coverage: setup  ## run the fast tests and say which lines none of them ran
	@rm -rf log/coverage && mkdir -p log/coverage
	@$(WITH_ENV) coverage run -m pytest tests -q -n 2 -m 'not slow and not ros' $(ARGS)
	@$(WITH_ENV) coverage combine -q && coverage report

fuzz: setup  ## try spoilt servo files, mappings and tables for some minutes; new ones each time
	@$(WITH_ENV) HYPOTHESIS_PROFILE=search python -m pytest tests/house/test_fuzz.py $(ARGS)

lint: setup  ## check the style
	@$(WITH_ENV) ruff check src tests tools

BENCHES = start step bag replay fit diagnose libraries chain
bench: setup  ## what users feel, each beside its reference: start, step, bag, replay, fit, diagnosis, chain
	@$(WITH_ENV) for one in $(BENCHES); do \
	    echo "== bench_$$one.py"; python tests/benchmarks/bench_$$one.py || exit 1; done

blind-check: setup  ## score the diagnosis on rigs with effects withheld; ARGS=--first 40, ...
	@$(WITH_ENV) servo-identify blind-check --scored $(ARGS)

results: training  ## compare the models on the bench and on real machines; DATA=... published recordings
	@$(WITH_ENV) servo-identify results $(DATA) $(ARGS)

clean:    ## remove all that the set-up made
	rm -rf .venv build install log
