# A machine with CPython 3.11, pip and make is enough; uv is used where it is present.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/installed
REPORT ?= reports/latest
# For campaign-pic: impacts in all (counts add up in build/campaign-pic.json), and processes.
IMPACTS ?= 1e6
JOBS ?= 1

.PHONY: help report test test-long campaign-pic check clean

help:
	@echo "make report   install everything, run the built-in suite, write $(REPORT)/index.html"
	@echo "make test     install everything, run the tests"
	@echo "make test-long     the tests that take minutes"
	@echo "make campaign-pic  IMPACTS=300e6 JOBS=2: check so many impacts of PIC, one by one"
	@echo "make check    lint, format, types, import contracts"
	@echo "make clean    remove $(VENV) and caches"

# Deviations of the engines are what the report is there to show, so they do not fail it; a crash does.
report: $(INSTALLED)
	$(BIN)/carom run --report $(REPORT) --fail-on never

test: $(INSTALLED)
	$(BIN)/python -m pytest -n auto --dist worksteal

test-long: $(INSTALLED)
	$(BIN)/python -m pytest -n auto --dist worksteal -m long

campaign-pic: $(INSTALLED)
	@mkdir -p build
	$(BIN)/python -m tests.campaign --impacts $(IMPACTS) --jobs $(JOBS) --state build/campaign-pic.json

check: $(INSTALLED)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

$(INSTALLED): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit(0 if sys.version_info >= (3, 11) else "Carom needs CPython 3.11 or later, and $(PYTHON) is " + sys.version.split()[0] + ": make PYTHON=python3.11 ...")'
	@if command -v uv >/dev/null 2>&1; then \
		uv venv --quiet --allow-existing --python $(PYTHON) $(VENV) && uv pip install --python $(BIN)/python --editable '.[all,dev]'; \
	else \
		$(PYTHON) -m venv $(VENV) && $(BIN)/python -m pip install --quiet --disable-pip-version-check --editable '.[all,dev]'; \
	fi
	@touch $(INSTALLED)

clean:
	rm -rf $(VENV) .mypy_cache .pytest_cache .ruff_cache .import_linter_cache .hypothesis build dist
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
