# make demo: everything from nothing to a report.   make test: everything from nothing to a green test run.
# make docs: the documentation as a site in build/site, which opens from the disk.
# PIP_ARGS passes options to pip, for instance PIP_ARGS="--index-url https://..." for another build of torch.
PYTHON ?= python3
VENV ?= .venv
PIP_ARGS ?=
DEMO ?= demo
# two test processes of one thread: half the time, 2 GB of memory each; files in the order of tests/conftest.py
PYTEST_ARGS ?= -n 2 --dist loadfile --no-loadscope-reorder --durations 10
BIN := $(VENV)/bin

.PHONY: demo test check wheel-test docs figures clean

demo: $(VENV)/.installed
	@test ! -e $(DEMO) || { echo "$(DEMO) exists: remove it, or choose another folder with DEMO=..."; exit 2; }
	$(BIN)/gensig generate experiment=quickstart out=$(DEMO)/data
	$(BIN)/gensig verify $(DEMO)/data
	$(BIN)/diagnose train data=$(DEMO)/data out=$(DEMO)/report
	@echo "Look at $(DEMO)/report/report.html; the data set is $(DEMO)/data, described in its README.md"

test: $(VENV)/.installed-test
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python -m pytest $(PYTEST_ARGS)

# all tests but those of the tree, from the wheel of the source distribution, in another folder
wheel-test: $(VENV)/.installed-test
	OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 $(BIN)/python -m tests.wheel $(PYTEST_ARGS)

check: $(VENV)/.installed-test
	$(BIN)/ruff check . && $(BIN)/ruff format --check . && $(BIN)/mypy && $(BIN)/lint-imports

# pictures of the pages, by the commands of docs/figures/commands.txt
figures: $(VENV)/.installed
	$(BIN)/python -m tests.figures

docs: $(VENV)/.installed-docs
	$(BIN)/mkdocs build --strict
	@echo "Open build/site/index.html; with the search: $(BIN)/python -m http.server --directory build/site"

$(VENV)/.installed: pyproject.toml constraints.txt | $(VENV)/bin/python
	@echo "installing into $(VENV): some 2 GB with torch, minutes without a line"
	$(BIN)/python -m pip install --quiet $(PIP_ARGS) --constraint constraints.txt --editable ".[diagnose,parquet]"
	@touch $@

$(VENV)/.installed-test: pyproject.toml constraints.txt | $(VENV)/bin/python
	@echo "installing into $(VENV): some 3 GB with torch, minutes without a line"
	$(BIN)/python -m pip install --quiet $(PIP_ARGS) --constraint constraints.txt --editable ".[test]"
	@touch $@ $(VENV)/.installed

$(VENV)/.installed-docs: pyproject.toml constraints.txt | $(VENV)/bin/python
	@echo "installing into $(VENV): minutes without a line"
	$(BIN)/python -m pip install --quiet $(PIP_ARGS) --constraint constraints.txt --editable ".[docs]"
	@touch $@ $(VENV)/.installed

$(VENV)/bin/python:
	$(PYTHON) -m venv $(VENV)

clean:
	rm -rf $(VENV) build *.egg-info
