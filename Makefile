# Every target sets the workspace up first; where that is done already it costs nothing.
SHELL := /bin/bash
.DEFAULT_GOAL := help
.PHONY: help setup training run demo test test-long fast coverage checks types fuzz soak limits lint licences \
    audit lock bench blind-check results clean docs docs-check docs-tools notebooks

WITH_ENV := . ./env.sh &&
# Tests start hundreds of processes, which are to find their modules compiled, whatever the shell says.
PYTEST := PYTHONDONTWRITEBYTECODE= python -m pytest
# One to a processor: beside more a browser starts too late.
WORKERS ?= 2
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

test: training  ## run the tests but the long ones; WORKERS=2, ARGS=... goes to pytest
	@$(WITH_ENV) $(PYTEST) tests -n $(WORKERS) --dist worksteal -m 'not long' -o faulthandler_timeout=600 $(ARGS)

test-long: training  ## run the tests that take ten seconds and more, and all drives; some half an hour
	@$(WITH_ENV) $(PYTEST) tests -n 2 --dist worksteal -m long $(ARGS)

fast: setup  ## run the tests that start no ROS graph and take less than two seconds each
	@$(WITH_ENV) $(PYTEST) tests -n 2 -m 'not slow and not long and not ros' $(ARGS)

checks: lint types  ## check style, words, links, imports, packages, security, sizes, repeats and types; a minute
	@$(WITH_ENV) python -m pytest -q tests/house/test_words.py tests/house/test_pages.py \
	    tests/house/test_imports.py tests/house/test_packages.py tests/house/test_security.py \
	    tests/house/test_modules.py tests/house/test_duplicates.py

types: setup  ## check the types of the physics, the diagnosis and the front door
	@$(WITH_ENV) mypy

FLOORS = physics:80 diagnose:60 api:75
coverage: setup  ## run the fast tests and say which lines none of them ran; fails below the floors
	@rm -rf log/coverage && mkdir -p log/coverage
	@$(WITH_ENV) coverage run -m pytest tests -q -n 2 -m 'not slow and not long and not ros' $(ARGS)
	@$(WITH_ENV) coverage combine -q && coverage report
	@$(WITH_ENV) for one in $(FLOORS); do echo "$${one%:*}, at least $${one#*:} %:"; \
	    coverage report --format=total --include="*/$${one%:*}/*" --fail-under=$${one#*:} || exit 1; done

fuzz: setup  ## try spoilt files, frames and command lines; SECONDS=600 SEED=1 JOBS=2 GUIDED=1, ARGS=...
	@$(if $(GUIDED),$(WITH_ENV) python -m pip install -q -r requirements/fuzz.txt)
	@$(WITH_ENV) python tests/fuzz/fuzz.py --seconds $(or $(SECONDS),600) --seed $(or $(SEED),1) \
	    --jobs $(or $(JOBS),2) $(if $(GUIDED),--guided) $(ARGS)
	@$(WITH_ENV) HYPOTHESIS_PROFILE=search python -m pytest tests/house/test_fuzz.py -k 'loads_or or is_read_or'

soak: setup  ## run the bench for an hour while faults come; SOAK=24h SEED=1, ARGS=-o DIR for the report
	@$(WITH_ENV) python tests/soak/soak.py $(or $(SOAK),1h) --seed $(or $(SEED),1) $(ARGS)

limits: setup  ## find where rates, bags, rigs and servo files break; ARGS=--only rate, ...
	@$(WITH_ENV) python tests/benchmarks/bench_limits.py $(ARGS)

licences: setup  ## list the licence of every package in the environment
	@$(WITH_ENV) python tools/licences.py

audit: setup  ## ask for known vulnerabilities of what is installed; needs the network
	@python3 -m venv .venv/audit && .venv/audit/bin/pip install --quiet pip-audit==2.10.1
	@.venv/audit/bin/pip-audit --path $$(.venv/bin/python -c 'import sysconfig; \
	    print(sysconfig.get_paths()["purelib"])')

lock:     ## hold every package by the hashes of its files; needs the network
	@python3 -m venv .venv/lock && .venv/lock/bin/pip install --quiet uv==0.13.9
	@cat requirements/workspace.txt requirements/ros_wheels.txt | .venv/lock/bin/uv pip compile - \
	    --quiet --universal --python-version 3.11 --generate-hashes --no-header --no-annotate \
	    -o requirements/ros_wheels.lock

lint: setup  ## check the style
	@$(WITH_ENV) ruff check src tests tools

bench: setup  ## write docs/speed.md: start, step, bag, replay, fit, diagnosis, chain, set-up, each beside its reference; ARGS="fit step"
	@$(WITH_ENV) python tests/benchmarks/speed_table.py $(ARGS) --page docs/speed.md

blind-check: setup  ## score the diagnosis on rigs with effects withheld; ARGS=--first 40, ...
	@$(WITH_ENV) servo-identify blind-check --scored --force $(ARGS)

results: training  ## compare the models on the bench and on real machines; DATA=... published recordings
	@$(WITH_ENV) servo-identify results --force $(DATA) $(ARGS)

docs-tools: setup
	@$(WITH_ENV) python -m pip install -q -r requirements/docs.txt

docs: docs-tools  ## build the documentation site into site/; a dead link or a warning fails
	@$(WITH_ENV) set -o pipefail; NO_MKDOCS_2_WARNING=1 python -m mkdocs build --strict 2>&1 | { grep -v ^INFO || true; }
	@echo site/index.html

docs-check: setup  ## run every example of the pages, the slow ones too; some minutes
	@$(WITH_ENV) SERVO_DOCS_SLOW=1 python -m pytest tests/house/test_examples.py tests/house/test_notebooks.py $(ARGS)

notebooks: docs-tools  ## run the notebooks and keep their output in them
	@$(WITH_ENV) python tools/run_notebooks.py

clean:    ## remove all that the set-up made
	rm -rf .venv build install log site
