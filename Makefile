# make demo    a sample museum, its database and a floor plan, from nothing but python3 and make
# make walk    a walk through that museum, in a browser
# make test    everything the tests need, then the tests
# make lint    ruff, mypy, and tsc for what is JavaScript
# make bench   the benchmarks, on the data at hand
# make bench-codec   only those of the texture codec, beside other formats (about an hour)
# make bench-pvs     cells and visibility, what is traded for what (a quarter of an hour)
# make bench-ach     coverage hints: what accuracy costs (a quarter of an hour)
# make bench-walk    what clients show to a walker: all policies, links and scenes (an hour)
# make bench-web     how soon a view is there, by the walk page and by what people do otherwise
#                    (a day; it continues where it was stopped)
# make fuzz    100,000 damaged and hostile files for every reader, 1,000 damaged buildings (an hour)
# make page    bundle the page of web/page and web/systems into the packages, with esbuild; print its table of sizes
# make dist    a wheel and an sdist in build/dist, with a bill of materials
# make man     the manual page of ptm, in release/man (make dist packs it)
# make sample  only the sample museum
# make setup   only the virtual environment
# make docs    the documentation as a web site, in build/docs
# make docs-tables     print the exact tables of benchmarks/RESULTS.md into it (ten minutes)
# make docs-timings    print its timed tables, on a machine that does nothing else (an hour)
# make docs-pictures   draw the pictures of the docs
# make clean   remove what was built, except the virtual environment

SHELL := bash
.SHELLFLAGS := -eu -o pipefail -c
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help
MAKEFLAGS += --no-builtin-rules

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet
JOBS ?= 2
PYTEST_ARGS ?=
export PTM_SHARED ?= $(abspath ../shared)

.PHONY: help setup demo walk test lint bench bench-codec bench-pvs bench-ach bench-walk bench-web fuzz page sample dist docs man docs-tables docs-timings docs-pictures clean

help:
	@sed -n 's/^# \(make .*\)/\1/p' Makefile

$(VENV)/.made:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "ptmtools needs Python 3.11 or newer; give one with: make PYTHON=python3.12 …" >&2; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || \
	  { echo "python3-venv is missing; on Debian or Ubuntu: apt install python3-venv" >&2; exit 1; }
	$(PYTHON) -m venv $(VENV)
	@touch $@

# The version is part of what pip records, which the bill of materials reads.
$(VENV)/.installed: $(VENV)/.made pyproject.toml ptmtools/version.py
	@echo "Installing ptmtools and what it needs into $(VENV) …"
	$(PIP) install --editable '.[plot]'
	@touch $@

$(VENV)/.installed-dev: $(VENV)/.installed
	@echo "Installing what the tests need into $(VENV) …"
	$(PIP) install --editable '.[dev]'
	@touch $@

setup: $(VENV)/.installed

# The stamp, not the OBJ, is the target: the command decides what to write again.
build/museum/.made: $(wildcard sample_data/ptmtools_samples/*.py) | $(VENV)/.installed
	$(BIN)/ptm sample museum -o build/museum
	@touch $@

sample: build/museum/.made

dist: $(VENV)/.installed-dev man
	@rm -rf build/dist
	$(BIN)/python -m build --no-isolation -o build/dist .
	$(BIN)/python release/bill.py -o build/dist

man: $(VENV)/.installed-dev
	$(BIN)/python release/man_page.py -o release/man/ptm.1

# The cell of the first viewpoint.
FIRST_CELL = $(BIN)/python -c 'import json; hints = json.load(open("build/museum.db/www/hints.json")); print(hints["viewpoints"][0]["cell"])'

demo: build/museum/.made
	$(BIN)/ptm build-scene build/museum/museum.obj -o build/museum.db
	$(BIN)/ptm plot build/museum.db --cell "$$($(FIRST_CELL))" -o build/museum.png --force
	@echo
	@echo "The floor plan of the museum, with what is seen from the first viewpoint, is in build/museum.png."
	@echo "Walk through it: make walk"
	@echo "Your own model: $(BIN)/ptm build-scene MODEL.obj -o MODEL.db"

walk: build/museum/.made
	$(BIN)/ptm build-scene build/museum/museum.obj -o build/museum.db
	$(BIN)/ptm serve build/museum.db --open

test: $(VENV)/.installed-dev
	@.ci/test-components
	$(BIN)/python -m pytest -n $(JOBS) --dist worksteal $(PYTEST_ARGS)

# Groups of checks, the longest first. They run beside each other; the output of each is printed at its end.
LINTS := lint-types lint-tables lint-scripts lint-docs lint-repository
.PHONY: $(LINTS)

lint: $(VENV)/.installed-dev
	@.ci/test-components
	@$(MAKE) --no-print-directory --jobs=$(JOBS) --output-sync=target --keep-going $(LINTS)

$(LINTS): $(VENV)/.installed-dev

# One after the other: they share a cache.
lint-types:
	$(BIN)/mypy
	$(BIN)/mypy --config-file benchmarks/mypy.ini
	$(BIN)/mypy --config-file benchmarks/mypy.ini -p benchmarks.codebase -p benchmarks.fuzz -p benchmarks.web_rivals

lint-tables:
	$(BIN)/python benchmarks/docs_tables.py --check

lint-scripts:
	$(BIN)/python -m tests.web.checked_types

lint-docs:
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build

lint-repository:
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	@large=$$(git ls-files -z | xargs -0 stat -c '%s %n' | awk '$$1 > 1048576 { print $$2 }'); \
	  [ -z "$$large" ] || { echo "Tracked files over 1 MiB: $$large" >&2; exit 1; }
	$(BIN)/python benchmarks/house.py --check
	$(BIN)/repo-review . --show err
	$(BIN)/zizmor --offline --quiet .github

bench-codec: $(VENV)/.installed-dev
	@mkdir -p build/bench
	$(BIN)/python benchmarks/codec/sizes.py
	$(BIN)/python benchmarks/codec/progressive.py
	$(BIN)/python benchmarks/codec/floats.py --fetch
	$(BIN)/python benchmarks/codec/near_lossless.py
	$(BIN)/python benchmarks/codec/huge.py
	$(BIN)/python benchmarks/codec/startup.py
	$(BIN)/python -m benchmarks.fuzz --count 100000 --jobs $(JOBS) --only ptm

bench-pvs: build/museum/.made $(VENV)/.installed-dev
	$(BIN)/python benchmarks/pvs_trade.py

bench-ach: build/museum/.made $(VENV)/.installed-dev
	$(BIN)/python benchmarks/ach.py

bench-walk: build/museum/.made $(VENV)/.installed-dev
	$(BIN)/python benchmarks/walk_speed.py
	$(BIN)/python benchmarks/walk_table.py

bench-web: build/museum/.made $(VENV)/.installed-dev
	$(BIN)/python benchmarks/scenes.py museum rooms hospital office web_gallery atrium
	$(BIN)/python benchmarks/page_weight.py
	$(BIN)/python -m benchmarks.web_rivals.bytes
	$(BIN)/python -m benchmarks.web_rivals
	$(BIN)/python -m benchmarks.web_rivals --memory --scene museum,rooms
	$(BIN)/python benchmarks/mesh_levels.py

bench: $(VENV)/.installed-dev
	@mkdir -p build/bench
	$(BIN)/python benchmarks/codec/sizes.py --only-png --profiles raw,fast
	$(BIN)/python benchmarks/cells.py
	@for map in $(PTM_SHARED)/prt/*.prt; do [ -f "$$map" ] || continue; set -x; \
	  $(BIN)/python benchmarks/prt.py "$$map" -o "build/bench/$$(basename "$$map" .prt).npz" \
	    --reference "$${map%.prt}.visible.npz"; { set +x; } 2>/dev/null; done
	@[ ! -d build/museum.db ] || { set -x; $(BIN)/ptm validate build/museum.db --segments 1000000; }
	$(BIN)/python benchmarks/ach.py sample_data/two_rooms/two_rooms.obj --only presets speed
	$(BIN)/python benchmarks/emission.py
	$(BIN)/python benchmarks/formats.py
	$(BIN)/python benchmarks/geometry.py
	$(BIN)/python benchmarks/simplification.py --faces 100000
	$(BIN)/python benchmarks/apo.py --triangles 50000
	$(BIN)/python benchmarks/interlace.py --quick
	$(BIN)/python benchmarks/light.py $(CURDIR)/sample_data/two_rooms/two_rooms.obj
	$(BIN)/python benchmarks/manifests.py --most 10000
	$(BIN)/python benchmarks/objects.py --textures 500
	@[ ! -f build/museum/museum.obj ] || { set -x; $(BIN)/python benchmarks/rounded.py; { set +x; } 2>/dev/null; }
	$(BIN)/python -m benchmarks.fuzz --count 5000 --jobs $(JOBS)

fuzz: $(VENV)/.installed-dev
	$(BIN)/python -m benchmarks.fuzz --jobs $(JOBS)
	$(BIN)/python -m benchmarks.fuzz.foreign --count 200 --jobs $(JOBS)
	$(BIN)/python -m benchmarks.fuzz.geometry --count 1000 --jobs $(JOBS)

# A warning, such as a broken link, is an error (mkdocs.yml). Without the variable Material advertises.
docs: $(VENV)/.installed-dev
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build

docs-tables: $(VENV)/.installed-dev
	$(BIN)/python benchmarks/docs_tables.py

docs-timings: build/museum/.made $(VENV)/.installed-dev
	$(BIN)/python benchmarks/docs_tables.py --timed

docs-pictures: build/museum/.made
	$(BIN)/ptm build-scene build/museum/museum.obj -o build/museum.db
	$(BIN)/python benchmarks/docs_pictures.py build/museum.db

page: $(VENV)/.installed-dev
	@.ci/test-components
	$(BIN)/python web/page/build.py
	$(BIN)/python benchmarks/docs_tables.py page

clean:
	rm -rf build dist release/man *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis
	find . -name __pycache__ -not -path './$(VENV)/*' -prune -exec rm -rf {} +
