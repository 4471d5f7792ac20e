# make demo   the main job on a bundled scene, in a virtual environment of its own
# make test   style, types and layers (alone: make lint), and the tests of seconds (alone: make test-fast)
# make test-slow   the tests that take longer; CI runs them too
# make test-long   slow tests that CI leaves out, since others are near to them or few changes can break what they show: before a
#   release, and after changes near to them
# make docs   the manual, in docs/_build/html: runs the tutorials and the gallery of scenes that have changed
# make docs-check   the manual without running them; CI does it
# make links  follow the manual's links to other sites
# make clean  remove what these made

PYTHON ?= python3
BIN := .venv/bin
PLUGINS := $(patsubst %/pyproject.toml,%,$(wildcard plugins/*/pyproject.toml))
PROJECTS := pyproject.toml $(addsuffix /pyproject.toml,$(PLUGINS))
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check
SPHINX := $(BIN)/python -m sphinx --fail-on-warning --keep-going --quiet

.PHONY: demo test lint test-fast test-slow test-long docs docs-check links clean

demo: .venv/demo.stamp
	$(BIN)/vibrokit run hertz-0.570

# Types need one processor: beside the tests they take less time than before them.
test: .venv/test.stamp
	$(MAKE) --jobs=2 lint test-fast

lint: .venv/test.stamp
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

test-fast: .venv/test.stamp
	$(BIN)/python -m pytest --numprocesses auto --dist loadfile -m 'not slow'

test-slow: .venv/test.stamp
	$(BIN)/python -m pytest --numprocesses auto --dist worksteal -m 'slow and not long'

test-long: .venv/test.stamp
	$(BIN)/python -m pytest --numprocesses auto --dist load -m long

docs: .venv/docs.stamp
	$(SPHINX) -b html docs docs/_build/html

docs-check: .venv/docs.stamp
	$(SPHINX) -D plot_gallery=0 -b html docs docs/_build/check

links: .venv/docs.stamp
	$(SPHINX) -D plot_gallery=0 -b linkcheck docs docs/_build/links

clean:
	rm -rf .venv build dist docs/_build docs/tutorials docs/gallery docs/findings.rst docs/validation.rst docs/performance.rst docs/barriers.rst .pytest_cache .mypy_cache .ruff_cache .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

# A stamp says that what its target needs is installed; it ages when a pyproject.toml changes.
.venv/demo.stamp: pyproject.toml | .venv/bin/python
	@echo "Installing vibrokit into .venv"
	$(PIP) --editable .
	@touch $@

.venv/test.stamp: $(PROJECTS) | .venv/bin/python
	@echo "Installing vibrokit and what its tests need into .venv"
	$(PIP) --editable '.[test]' $(addprefix --editable ./,$(PLUGINS))
	@touch $@

.venv/docs.stamp: pyproject.toml | .venv/bin/python
	@echo "Installing vibrokit and what its manual needs into .venv"
	$(PIP) --editable '.[docs]'
	@touch $@

.venv/bin/python:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' \
	  || { echo "vibrokit needs Python 3.11 or newer and '$(PYTHON)' is not; install one and say 'make PYTHON=/path/to/it'."; exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null \
	  || { echo "'$(PYTHON)' comes without the venv module; install it (Debian, Ubuntu: apt install python3-venv) and try again."; exit 1; }
	$(PYTHON) -m venv .venv
