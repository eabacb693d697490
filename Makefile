# make demo   the running dashboard, in the browser
# make test   everything that is checked: format, rules, types, tests
# make bench  how long everything takes, with ratios to the reference
PYTHON ?= python3
BIN := .venv/bin
# The matrices are small: a second thread of the linear algebra only costs time.
export OMP_NUM_THREADS ?= 1

.PHONY: demo test bench clean

demo: .venv/.program
	$(BIN)/vsep serve --show

# A browser and the server it looks at fill two cores; everything else is tested in two processes.
test: .venv/.checks
	$(BIN)/ruff format --check
	$(BIN)/ruff check
	$(BIN)/mypy
	$(BIN)/python -m pytest -m "not ui" --numprocesses 2 --dist loadfile
	$(BIN)/python -m pytest -m ui

bench: .venv/.checks
	$(BIN)/python -m pytest tests/benchmarks --benchmark-enable --benchmark-only

clean:
	rm -rf .venv .mypy_cache .pytest_cache .ruff_cache .hypothesis build dist

# The stamps say what is installed; the checks need the program too.
.venv/.program: pyproject.toml | .venv/bin/pip
	$(BIN)/pip install --quiet --editable .
	$(BIN)/python -m vsep_app.jobs.warmup
	touch $@

.venv/.checks: pyproject.toml | .venv/bin/pip
	$(BIN)/pip install --quiet --editable '.[dev]'
	$(BIN)/python -m vsep_app.jobs.warmup
	touch $@ .venv/.program

.venv/bin/pip:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
		|| { echo "vsep needs Python 3.11 or newer; set PYTHON=/path/to/python3"; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' \
		|| { echo "vsep needs Python's venv module: apt-get install python3-venv"; exit 1; }
	$(PYTHON) -m venv .venv

# The documentation site in build/docs: pages, executed examples, reference; a warning is an error.
.PHONY: docs
docs: .venv/.docs
	$(BIN)/sphinx-build --fail-on-warning --keep-going --quiet assets/docs build/docs
	@echo "build/docs/index.html"

.venv/.docs: pyproject.toml | .venv/bin/pip
	$(BIN)/pip install --quiet --editable '.[docs]'
	touch $@
