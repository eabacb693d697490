# make demo       the running dashboard, in the browser
# make test       what every change is checked by: format, rules, types, tests, browser
# make test-fast  the same in a minute and a half: no types, no browser, no simulated scenes
# make test-all   what a release is checked by: the long runs too
# make bench      how long everything takes, with ratios to the reference
# make docs       the documentation site, in build/docs
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
# The oldest releases of Panel and Bokeh that the program takes, looked for before those of $(VENV).
OLDER := $(CURDIR)/build/older-releases
# The matrices are small: a second thread of the linear algebra only costs time.
export OMP_NUM_THREADS ?= 1
# Files in the order in which they are collected: the browser's come last.
WORKERS ?= 2
PYTEST := $(BIN)/python -m pytest --numprocesses $(WORKERS) --dist loadfile --no-loadscope-reorder

.PHONY: demo test test-fast test-all test-app rules bench docs clean

demo: $(VENV)/.program
	$(BIN)/vsep serve --show

# Rules and types need no kernels: both at once, the first time.
test: $(VENV)/.installed
	$(MAKE) --jobs 2 rules $(VENV)/.checks
	$(PYTEST) -m "not slow"

rules: $(VENV)/.installed
	$(BIN)/ruff format --check
	$(BIN)/ruff check
	$(BIN)/mypy

test-fast: $(VENV)/.checks
	$(BIN)/ruff format --check
	$(BIN)/ruff check
	$(PYTEST) -m "not (slow or ui or scenario or benchmark)"

test-all: $(VENV)/.checks rules
	$(PYTEST)

# The pages with the older releases of Panel and Bokeh, without a browser.
test-app: export PYTHONPATH := $(OLDER)
test-app: $(OLDER)/.complete
	$(BIN)/python -m pip check
	$(BIN)/python -c 'import bokeh, panel; print("Panel", panel.__version__, "Bokeh", bokeh.__version__)'
	$(PYTEST) tests/app --ignore tests/app/cli --loading panel -m "not (slow or ui or scenario)"

bench: $(VENV)/.checks
	$(BIN)/python -m pytest tests/benchmarks --benchmark-enable --benchmark-only

clean:
	rm -rf .venv .mypy_cache .pytest_cache .ruff_cache .hypothesis build dist

# The stamps say what is installed; the checks need the program too. Kernels are compiled here, so
# that neither a visitor nor a test waits for them.
$(VENV)/.program: pyproject.toml | $(VENV)/bin/pip
	$(BIN)/pip install --quiet --editable '.[dashboard]'
	$(BIN)/python -m vsep_app.jobs.warmup
	touch $@

$(VENV)/.installed: pyproject.toml | $(VENV)/bin/pip
	$(BIN)/pip install --quiet --no-compile --editable '.[dev]'
	touch $@

$(VENV)/.checks: $(VENV)/.installed
	$(BIN)/python -m vsep_app.jobs.warmup
	touch $@ $(VENV)/.program

$(OLDER)/.complete: $(VENV)/.checks
	rm -rf $(OLDER)
	$(BIN)/pip install --quiet --no-compile --no-deps --target $(OLDER) 'panel<1.10' 'bokeh<3.10'
	touch $@

$(VENV)/bin/pip:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
		|| { echo "vsep needs Python 3.11 or newer; set PYTHON=/path/to/python3"; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' \
		|| { echo "vsep needs Python's venv module: apt-get install python3-venv"; exit 1; }
	$(PYTHON) -m venv $(VENV)

# Pages, executed examples and the reference of the interface; a warning is an error.
docs: $(VENV)/.docs
	$(BIN)/sphinx-build --fail-on-warning --keep-going --quiet assets/docs build/docs
	@echo "build/docs/index.html"

$(VENV)/.docs: pyproject.toml | $(VENV)/bin/pip
	$(BIN)/pip install --quiet --editable '.[docs]'
	touch $@
