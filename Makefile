# sagline: `make` alone lists what there is to do.

VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
OUT ?= output
TOOLS := build/tools
SEED ?= $(shell date +%s)
FOUND = $(shell for p in python3 python3.13 python3.12 python3.11 python3.14; do \
	$$p -c 'import sys; sys.exit(sys.version_info < (3, 11))' >/dev/null 2>&1 && { echo $$p; break; }; done)
PYTHON ?= $(FOUND)

.DEFAULT_GOAL := help
unexport PYTHONDONTWRITEBYTECODE # else each of a hundred processes compiles anew all that it imports
.PHONY: help env run article test test-all test-extended coverage check format messages record mutants size bench soak c linuxcnc-headers docs dist pins audit sbom clean

help: ## show this list
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | awk -F ':.*## ' '{ printf "  make %-13s %s\n", $$1, $$2 }'
	@echo "  PYTHON=... names the interpreter (Python 3.11 or newer), OUT=... the folder of make run,"
	@echo "  FOLDER=... one folder of tests for make test, test-extended and mutants: FOLDER=calibration"

env: $(STAMP) ## create .venv with everything in it, and build the kernels (again only after changes)
	@$(BIN)/python -m tools.build || true # without a compiler, numba compiles them at the first use

$(STAMP): pyproject.toml
	@test -n "$(PYTHON)" || { echo "sagline needs Python 3.11 or newer and found none; install it or name it: make env PYTHON=/path/to/python3" >&2; exit 2; }
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "$(PYTHON) is no Python 3.11 or newer; name another: make env PYTHON=/path/to/python3" >&2; exit 2; }
	$(PYTHON) -m venv $(VENV)
	SAGLINE_BUILD=later $(BIN)/python -m pip install --quiet --no-compile --disable-pip-version-check \
		--editable '.[viewer,plc,log,workspace,design,sweep,dev]'
	@touch $@

run: env ## the main job: the article's test, its table, runs and figures in OUT (default: output)
	$(BIN)/sagline run --out $(OUT)

article: env ## the article's figures, tables and errata redone, as one page in OUT
	$(BIN)/sagline article --out $(OUT)

test test-extended coverage record mutants soak: export OPENBLAS_NUM_THREADS := 1 # a worker has a core
PYTEST = $(BIN)/python -m pytest
PARALLEL := --numprocesses auto --dist worksteal
INNER := kernels translate # tests of single kernels, which numba compiles once a file; the others run the library
OUTER = $(if $(FOLDER),$(addprefix tests/,$(filter-out $(INNER),$(FOLDER))),tests $(addprefix --ignore=tests/,$(INNER)))
CHOSEN = $(addprefix tests/,$(if $(FOLDER),$(filter $(INNER),$(FOLDER)),$(INNER)))
define run_tests
	$(if $(OUTER),$(PYTEST) $(OUTER) -m "$(1)" $(PARALLEL))
	$(if $(CHOSEN),SAGLINE_BACKEND=numba $(PYTEST) $(CHOSEN) -m "$(1)" $(PARALLEL) --dist loadfile)
endef

test: env ## the first tier of the tests: minutes
	$(call run_tests,not extended and not soak)

test-extended: env ## the second tier: browsers, processes, wide parameters, other programs, documentation
	$(call run_tests,extended and not soak)

test-all: check test test-extended ## style and types, then both tiers

coverage: env ## both tiers again, and which lines they run
	SAGLINE_BACKEND=numba $(PYTEST) --ignore tests/test_back_ends.py --cov $(PARALLEL)

messages: env ## renew the snapshots of messages; read the diff before you commit it
	$(BIN)/python -m pytest --snapshot-update --quiet

record: env ## renew the record of behavior in tests/record; read the diff before you commit it
	$(BIN)/python -m tests.record

mutants: env ## apply plausible mistakes one by one and list which tests catch them
	$(BIN)/python -m tests.mutants $(FOLDER)

check: env ## style, language, types and the direction of imports
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/python tools/prose.py
	$(BIN)/mypy --num-workers 2 src $(wildcard tests examples benchmarks tools)
	$(BIN)/lint-imports

format: env ## put the source in shape
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

size: env ## counts of the source: lines, files, names, imports
	$(BIN)/python tools/size.py

bench: env ## one table of times and ratios, on one core
	$(BIN)/python -m benchmarks.bench

soak: env ## the long tests that test-all leaves out, then all others in a random order
	$(PYTEST) -m soak
	SAGLINE_BACKEND=numba $(PYTEST) --ignore tests/test_back_ends.py --random-order=$(SEED) $(PARALLEL)

c: env ## C99 of all kernels, as OUT/kernels.c
	$(BIN)/python -m tools.translate $(OUT)/kernels.c

linuxcnc-headers: ## Debian's headers of LinuxCNC (250 kB), for the test of its modules
	@test -e /usr/include/linuxcnc/kinematics.h -o -e build/linuxcnc/usr/include/linuxcnc/kinematics.h || \
		{ mkdir -p build/linuxcnc && cd build/linuxcnc && apt-get download -qq linuxcnc-uspace-dev && \
		for file in *.deb; do dpkg-deb -x "$$file" .; done; }

docs: env ## the documentation site, into build/site; warnings and dead links are errors
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[docs]'
	$(BIN)/python -m tools.pages
	$(BIN)/zensical build --strict --clean
	$(BIN)/python -m tools.pages.check build/site
	@echo "open build/site/index.html"

dist: env ## wheel, source distribution and npm package, into dist
	$(BIN)/python -m hatchling build
	$(BIN)/python -m tools.javascript

pins: env ## renew constraints.txt, the versions with which sagline is tested
	$(BIN)/python -m tools.audit --pins > constraints.part && mv constraints.part constraints.txt

$(TOOLS)/.installed: $(STAMP) # programs of `make audit` and `make sbom`, in an environment of their own
	$(BIN)/python -m venv $(TOOLS)
	$(TOOLS)/bin/python -m pip install --quiet --disable-pip-version-check pip-audit cyclonedx-bom && touch $@

audit: env ## licenses of all packages, and known vulnerabilities of the versions in constraints.txt
	@$(MAKE) --silent $(TOOLS)/.installed || true # without it, the next line says that no database was reached
	$(BIN)/python -m tools.audit $(TOOLS)/bin/pip-audit

sbom: env $(TOOLS)/.installed ## software bill of materials (CycloneDX) of constraints.txt, into dist
	mkdir -p dist
	$(TOOLS)/bin/python -W ignore -m cyclonedx_py requirements constraints.txt --pyproject pyproject.toml \
		--mc-type library --output-reproducible --of JSON --output-file dist/sagline.cdx.json

clean: ## remove the environment, the folder output and every cache
	rm -rf $(VENV) output build dist .coverage htmlcov .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache
	find src tests -name __pycache__ -type d -prune -exec rm -rf {} +
