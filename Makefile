# A machine with CPython 3.11, pip, make and a C compiler is enough; uv is used where it is present.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/installed
FOR_TESTS := $(VENV)/installed-for-tests
FOR_REPORTS := $(VENV)/installed-for-reports
BUILT := $(VENV)/built
#: Not the pip of $(VENV), which would have to be installed first.
PIP := $(PYTHON) -m pip --python $(BIN)/python install --quiet --disable-pip-version-check
REPORT ?= reports/latest
#: Sources of the extension; each .pyx is a module of it.
SOURCES := $(shell find src tests -name '*.pyx' -o -name '*.pxd' -o -name '*.h' -o -name '*.c')
MODULES := $(subst /,.,$(patsubst src/%.pyx,%,$(filter src/%.pyx,$(SOURCES))))

# For campaign-pic: impacts in all (counts add up in reports/campaign-pic.json), and processes.
IMPACTS ?= 1e6
# For campaign-features: scenes in all; counts add up in reports/campaign-features.json.
SCENES ?= 10000
# For mutants: faults in all; what was tried stands in reports/mutants.jsonl and is not tried again.
FAULTS ?= 200
# For campaign: how long; counts add up in reports/attacks.
MINUTES ?= 60
JOBS ?= 1
# For engines: those from wheels, which are extras; those from npm stand in the package.json of their folder.
# Newton takes 480 MB of the 2.3 GB that all take, with Warp, and compiles for half a minute once.
WHEELS ?= rapier,dart,drake,ode,newton
NPM_ENGINES := adapters/carom_adapters/npm
# For hazards and atlas: figures over many phases.
HAZARDS := reports/hazards.json
# For wheels: interpreters by name or path, to try a wheel on; CPython 3.11 to 3.13 by their names where none are given.
PYTHONS ?=
# For bench: the interpreter of another build, timed beside this one.
BASELINE ?=

# Tests start hundreds of processes; without compiled modules on disk each of them translates all that it imports.
unexport PYTHONDONTWRITEBYTECODE
# What is imported is translated then: pip would translate all of Cython, NumPy and Matplotlib, one after the other.
# To pip, 0 means yes here, as for each option that switches something off.
export PIP_NO_COMPILE := 0

.PHONY: help demo report test test-long release-check test-browser ci engines test-engines docs docs-bench docs-figures pictures hazards atlas history determinism walls contact stress campaign campaign-pic campaign-features mutants arm wheels bench bench-memory bench-clones weight check changelog coverage coverage-compiled clean

help:
	@echo "make demo               install what it needs, and open a page on which you throw discs"
	@echo "make report             install what it needs, run the built-in suite, and write $(REPORT)/index.html"
	@echo "make test               install what it needs, and run the tests"
	@echo "make test-long          run the tests that take minutes"
	@echo "make release-check      (hours) run what only a release needs: builds, wheels, ARM, past releases of engines, campaigns"
	@echo "make test-browser       run the tests of the play page, in Chromium"
	@echo "make engines            install the engines that are not in the extra 'all': from npm (needs node), and $(WHEELS)"
	@echo "make test-engines       run the tests of those engines that are installed"
	@echo "make docs               write the documents as a site, site/index.html, and print their reading ease; a warning is an error"
	@echo "make docs-bench         (minutes, on a quiet machine) run the bench whose diagram the README shows; then make docs-figures"
	@echo "make docs-figures       write the README's tables and diagram from committed results"
	@echo "make pictures           take the README's pictures of the play page and of the sample report, in Chromium"
	@echo "make hazards            (ten minutes) run each engine at many phases; write docs/results/hazards.md and the tables of docs/engines"
	@echo "make atlas              (half an hour) run all scenes and some stress tests with all engines; write the tables of docs/engines"
	@echo "make stress             (fifteen minutes) run all stress tests in full; write docs/results/stress.md"
	@echo "make history            (minutes, needs the network) run past releases of engines; write docs/results/history.md"
	@echo "make determinism        test whether repeated runs of the installed engines are bit-identical; write docs/results/determinism.md"
	@echo "make contact            measure how discs slide, roll and rest in the installed engines; write the tables of docs/results/contact.md"
	@echo "make walls              measure thin walls, floors in pieces, ends and corners in the installed engines; write the tables of docs/results/walls.md"
	@echo "make campaign           MINUTES=60: attack files, options, journals, reports and processes; write docs/contributing/reliability.md"
	@echo "make campaign-pic       IMPACTS=300e6 JOBS=2: check this many impacts of PIC, one by one"
	@echo "make campaign-features  SCENES=20000 JOBS=2: compare PIC with certified runs and with itself, in random scenes of all features"
	@echo "make arm                compile the extension for ARM, run it in an emulator, and compare its results bit by bit"
	@echo "make wheels             PYTHONS='python3.11 python3.12': build a wheel and test it with each of these; also build one for musl"
	@echo "make mutants            FAULTS=200 MINUTES=60: plant faults in the numerics and list those that no test notices, in docs/contributing/reliability.md"
	@echo "make bench              BASELINE=/path/to/python: time the numerics, in turn with another build"
	@echo "make bench-memory       measure memory and time for reading, comparing and drawing 1e5 rows, and for the suite"
	@echo "make bench-clones       SINCE=80e3cd0: time make report, make test, the suite and one run in fresh clones of both commits"
	@echo "make weight             SINCE=80e3cd0: count lines of code, and hand-written words of the documents"
	@echo "make quick              lint and format in seconds; run it before each commit"
	@echo "make generated          write schemas, tables and snapshots of outputs again; read the diff afterwards"
	@echo "make check              check lint, format, spelling, style of the documents, types and import contracts"
	@echo "make changelog          move the fragments of changelog.d into CHANGELOG.md"
	@echo "make coverage           run the tests, and report which lines and branches of Python they reach; too few fail"
	@echo "make coverage-compiled  report which lines and branches of the compiled code the tests reach"
	@echo "make clean              remove $(VENV) and caches"

demo: $(VENV)/built-for-reports
	$(BIN)/carom demo

# Deviations of the engines are what the report is there to show, so they do not fail it; a crash does.
report: $(VENV)/built-for-reports
	$(BIN)/carom run --out $(REPORT) --fail-on never

test: $(VENV)/built-for-tests
	$(BIN)/python -m pytest --ignore tests/browser -n auto --dist worksteal

# By file: the tests of one file share what was built for them.
test-long: $(BUILT)
	$(BIN)/python -m pytest -m long -n auto --dist loadfile

# What only a release needs: builds, wheels, other processors, many more random cases. Tests by Hypothesis draw more examples.
release-check: $(BUILT)
	$(BIN)/python -m pytest -m release -n auto --dist loadfile
	HYPOTHESIS_PROFILE=more $(BIN)/python -m pytest -m "hypothesis and not long and not release and not browser and not engines" -n auto --dist loadfile
	$(MAKE) wheels arm
	$(MAKE) campaign campaign-pic campaign-features SCENES=1000

test-browser: $(BUILT)
	$(BIN)/python -m pytest -m browser tests/browser -n auto

engines: $(BUILT)
	npm install --no-package-lock --no-audit --no-fund --prefix $(NPM_ENGINES)
	@if command -v uv >/dev/null 2>&1; then \
		uv pip install --python $(BIN)/python --editable '.[$(WHEELS)]'; \
	else \
		$(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[$(WHEELS)]'; \
	fi

test-engines: $(BUILT)
	$(BIN)/python -m pytest -m engines tests/adapters tests/engines -n auto --dist loadfile

# Not --quiet: then warnings count for nothing. The variable silences Material's advertisement for its successor.
docs: $(BUILT)
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build
	$(BIN)/python -m docs.prose ease

docs-bench: $(BUILT)
	rm -rf reports/bench
	$(BIN)/carom bench gravity/box -e pymunk -e box2d -e mujoco -e pybullet -p tuned --rounds 15 --budget 160 --out reports/bench
	$(MAKE) docs-figures

docs-figures: $(BUILT)
	$(BIN)/python -m docs.figures.readme

campaign: $(BUILT)
	$(BIN)/python -m tests.attacks --minutes $(MINUTES) --write docs/contributing/reliability.md

pictures: $(BUILT)
	$(BIN)/python docs/figures/pictures.py
	$(BIN)/python docs/figures/walkthrough.py
	$(BIN)/python docs/figures/throw_gallery.py

# With every engine installed, or the page is not written: `make engines` brings those that are not.
$(HAZARDS): | $(BUILT)
	$(MAKE) hazards

hazards: $(BUILT)
	mkdir -p reports
	$(BIN)/python -m tests.hazards --figures $(HAZARDS) --write docs/results/hazards.md
	$(BIN)/python docs/figures/engine_pages.py

# An engine that crashes or gives no answer in time, exit code 4, is a row of the atlas.
ROWS = || [ $$? -eq 4 ]
# With the engines that are installed: `make engines` brings those that are not.
atlas: $(BUILT) $(HAZARDS)
	$(BIN)/carom run paper classics gravity engines -p all --out reports/atlas --no-timing --fail-on never --resume $(ROWS)
	$(BIN)/carom run classics/oblique-3-4-5 classics/box classics/gas -p all --dt 1/60 --out reports/atlas-speed --fail-on never $(ROWS)
	$(BIN)/carom stress tunnelling slow mass-ratio grazing duration --quick --out reports/atlas-stress --resume
	$(BIN)/python -m docs.figures.atlas reports/atlas reports/atlas-speed reports/atlas-stress $(HAZARDS)
	$(BIN)/python docs/figures/engine_pages.py

stress: $(BUILT)
	$(BIN)/carom stress --out reports/stress --resume
	$(BIN)/python docs/figures/stress_tables.py reports/stress/stress.md

# Installs releases, each into a folder of its own: see docs/reference/security.md.
history: $(BUILT)
	$(BIN)/python docs/figures/history.py

determinism: $(BUILT)
	$(BIN)/python docs/figures/determinism.py

# An engine that is not installed keeps its rows: `make engines` brings those that are not.
contact: $(BUILT)
	$(BIN)/python docs/figures/contact.py

walls: $(BUILT)
	$(BIN)/python docs/figures/walls.py
	$(BIN)/python docs/figures/engine_pages.py

campaign-pic: $(BUILT)
	$(BIN)/python -m tests.campaign --impacts $(IMPACTS) --jobs $(JOBS) --state reports/campaign-pic.json

campaign-features: $(BUILT)
	$(BIN)/python -m tests.campaign.features --scenes $(SCENES) --jobs $(JOBS) --state reports/campaign-features.json

# Downloads some 250 MB, once, into build/arm; needs apt-get and dpkg, not root.
arm: $(BUILT)
	$(BIN)/python -m tests.packaging.arm build/arm

wheels: $(BUILT)
	$(BIN)/python -m tests.packaging.wheels build/wheels $(PYTHONS)

mutants: $(BUILT)
	$(BIN)/python -m tests.mutants --faults $(FAULTS) --minutes $(MINUTES) --write docs/contributing/reliability.md

bench: $(BUILT)
	for part in pic pit kinds certified start; do \
		$(BIN)/python -m benchmarks.$$part $(if $(BASELINE),--baseline $(BASELINE)) || exit 1; \
	done
	$(BIN)/python -m benchmarks.time_of_impact

bench-memory: $(BUILT)
	$(BIN)/python -m benchmarks.memory --suite

bench-clones: $(BUILT)
	$(BIN)/python -m benchmarks.clones $(if $(SINCE),--since $(SINCE))

weight: $(BUILT)
	$(BIN)/python -m benchmarks.weight $(SINCE)
	$(BIN)/python -m docs.prose words

quick:
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/codespell README.md CONTRIBUTING.md CHANGELOG.md docs src adapters benchmarks

# Tests hold each of these to what makes it. Pictures, atlas, hazards and the tutorial take minutes and have targets of their own.
generated: $(BUILT)
	$(BIN)/carom diff --schema > src/carom/results.schema.json
	$(BIN)/carom scenes --schema | $(BIN)/python -m json.tool --indent 2 --sort-keys > src/carom/scene.schema.json
	$(BIN)/python -c 'from json import dumps; from carom.engines.protocol.messages import build_protocol_schema as schema; print(dumps(schema(), indent=2))' > docs/reference/engine-protocol.schema.json
	$(BIN)/python -m tests.packaging.core_wasm
	$(MAKE) docs-figures
	$(BIN)/python docs/figures/engine_pages.py
	$(BIN)/python docs/figures/scoring_tables.py
	$(BIN)/python docs/figures/stages.py
	CAROM_SNAPSHOTS=write $(BIN)/python -m pytest -q tests/unit/test_snapshots.py
	git diff --stat

check: $(BUILT)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/codespell README.md CONTRIBUTING.md CHANGELOG.md docs src adapters benchmarks
	$(BIN)/python -m docs.prose
	$(BIN)/mypy
	$(BIN)/lint-imports
	MYPYPATH=src $(BIN)/python -m mypy.stubtest --mypy-config-file pyproject.toml $(MODULES)

# What must hold before anything lands. With -j 2 single processes run next to tests, which start first and take longest.
ci: coverage check test-long docs test-browser report

changelog:
	$(PYTHON) docs/figures/changelog.py

coverage: $(BUILT)
	$(BIN)/python -m pytest --ignore tests/browser -n auto --dist worksteal --cov --cov-report=term

coverage-compiled: $(BUILT)
	$(BIN)/python -m tests.compiled_coverage

# PyBullet's wheel has 165 MB of models, robots and a renderer, and 125 MB of debug symbols: without them .venv takes 380 MB
# for a report instead of 668. A new file replaces the engine's, since uv links files of its cache.
define slim
cd $(VENV)/lib/python3.*/site-packages && rm -rf eglRenderer.*.so $(patsubst %,pybullet_%,data envs examples robots utils) && \
	for engine in pybullet.*.so; do \
		strip --strip-debug -o stripped $$engine 2>/dev/null && mv stripped $$engine || rm -f stripped; \
	done
endef

# A report needs the engines, tests need pytest and a compiler's front end too, and the rest is for who works on it: each
# target installs what it needs, and what has more needs nothing besides. pip compiles Carom while a second one unpacks.
define install
	@$(PYTHON) -c 'import sys; sys.exit(0 if sys.version_info >= (3, 11) else "Carom needs CPython 3.11 or later, and $(PYTHON) is " + sys.version.split()[0] + ": make PYTHON=python3.11 ...")'
	@command -v uv >/dev/null 2>&1 || $(PYTHON) -c 'import pip, sys; sys.exit(0 if tuple(map(int, pip.__version__.split(".")[:2])) >= (22, 3) else "pip of $(PYTHON) is " + pip.__version__ + ", 22.3 or later is needed: $(PYTHON) -m pip install --upgrade pip")'
	@rm -rf build
	@if command -v uv >/dev/null 2>&1; then \
		uv venv --quiet --allow-existing --python $(PYTHON) $(VENV) && uv pip install --python $(BIN)/python --editable '.[$(1)]'; \
	else \
		$(PYTHON) -m venv --without-pip $(VENV) && { \
			$(PIP) --no-deps --editable . & compiling=$$!; \
			$(PYTHON) build_backend/requirements.py $(1) >$(VENV)/requirements.txt && \
				$(PIP) --requirement $(VENV)/requirements.txt pip; unpacked=$$?; \
			wait $$compiling && exit $$unpacked; \
		}; \
	fi
	@$(slim)
	@touch $(2)
endef

# Flags and directives stand in setup.py, and Cython does not see when they change: so everything is built again.
$(INSTALLED): pyproject.toml setup.py
	$(call install,dev,$(INSTALLED) $(FOR_TESTS) $(FOR_REPORTS))

$(FOR_TESTS): pyproject.toml setup.py
	$(call install,test,$(FOR_TESTS) $(FOR_REPORTS))

$(FOR_REPORTS): export CAROM_WITHOUT_PROBE := 1
$(FOR_REPORTS): pyproject.toml setup.py
	$(call install,all,$(FOR_REPORTS))

# Installing has built the extension already; after that what has changed is compiled again, and all where that is not
# enough: a source that is gone, or was renamed, is newer than nothing.
define build
	@for all in "" --force; do \
		$(BIN)/python -c 'import carom.core.built, carom.core.extension as e; raise SystemExit(carom.core.built.DIGEST != e.compute_sources_digest())' 2>/dev/null \
			|| $(BIN)/python setup.py --quiet build_ext --inplace $$all || exit 1; \
	done
	@touch $@
endef

$(BUILT): $(INSTALLED) $(SOURCES)
	$(build)

$(VENV)/built-for-tests: $(FOR_TESTS) $(SOURCES)
	$(build)

# Nothing here compiles outside of an install: an edited source has it installed again.
$(VENV)/built-for-reports: $(FOR_REPORTS) $(SOURCES)
	@$(BIN)/python -c 'import carom.core.built, carom.core.extension as e; raise SystemExit(carom.core.built.DIGEST != e.compute_sources_digest())' 2>/dev/null \
		|| { rm $(FOR_REPORTS) && $(MAKE) $(FOR_REPORTS); }
	@touch $@

clean:
	rm -rf $(VENV) .mypy_cache .pytest_cache .ruff_cache .import_linter_cache .hypothesis build dist site
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
	find src tests -name '*.so' -delete
