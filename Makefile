# Every target makes what it needs in $(VENV) and is quick the second time.
PYTHON  ?= python3
VENV    ?= .venv
OUT     ?= out
WORKERS ?= 2
PYTEST_ARGS ?=
FUZZ_ARGS ?=
MUTANTS_ARGS ?=
REPRODUCE_ARGS ?=

BIN    := $(VENV)/bin
PY     := $(BIN)/python
DONE    = $(VENV)/.installed-$(1)
FIGURES := iekf-fig2 iekf-fig3 iekf-fig4
ONE_THREAD := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1 NUMBA_NUM_THREADS=1
PYTEST  = $(ONE_THREAD) $(PY) -m pytest -n $(WORKERS)
BUILD  := docs/_build

.DEFAULT_GOAL := help
.DELETE_ON_ERROR:
.PHONY: help venv reproduce test test-slow test-random test-portable twins fuzz vectors vectors-check mutants lint format notebooks notebooks-check docs docs-index bench pair-table orb-precision freak-table freak-precision vocabulary grade clean

help:
	@echo "make reproduce   redraw the paper's figures 2-4 into $(OUT)/ and judge its claims"
	@echo "make test        run the tests (make test-slow: the long ones)"
	@echo "make test-random test properties with fresh random examples"
	@echo "make test-portable   test the numeric rooms as two older processors compute"
	@echo "make twins       test the Numba twins and turn them on after a change of either form"
	@echo "make fuzz        damage 10,000 files of every reader and see what it says"
	@echo "make vectors     make the conformance vectors anew (make vectors-check: compare)"
	@echo "make mutants     count the mistakes in formulas that the vectors notice"
	@echo "make lint        style, types, import contracts (make format: repair the style)"
	@echo "make notebooks   generate and execute notebooks/ from docs/chapters/"
	@echo "make docs        build the book into $(BUILD)/html"
	@echo "make bench       measure this machine, beside the peers that are installed"
	@echo "make pair-table  learn the pairs of pixels that ORB compares (make orb-precision: beside OpenCV's)"
	@echo "make freak-table learn the pairs of fields that FREAK compares (make freak-precision: beside contrib's)"
	@echo "make vocabulary  train the vocabulary of ORB's words that comes with the package"
	@echo "make grade EXERCISE=16_name FILE=mine.py   grade an answer"
	@echo "make clean       remove everything that was made"

# --- the environment ------------------------------------------------------------------------

$(PY):
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || \
	  { echo "Python 3.11 or newer is needed; name one: make PYTHON=python3.12 ..." >&2; exit 2; }
	$(PYTHON) -m venv $(VENV)

# One stamp per extra; a changed pyproject.toml installs again. Editable: a changed source counts at once.
$(VENV)/.installed-%: pyproject.toml | $(PY)
	$(PY) -m pip install --quiet --disable-pip-version-check --editable ".[$*]"
	@touch $@

venv: $(call DONE,fast)

# --- what people run ------------------------------------------------------------------------

reproduce: $(call DONE,fast)
	$(BIN)/vslam-ref reproduce $(FIGURES) --out $(OUT) $(REPRODUCE_ARGS)

test: $(call DONE,fast) $(call DONE,test)
	$(PYTEST) $(PYTEST_ARGS)

test-slow: $(call DONE,fast) $(call DONE,test)
	$(PYTEST) -m slow $(PYTEST_ARGS)

test-random: $(call DONE,fast) $(call DONE,test)
	$(PYTEST) -m "hypothesis and not slow" --hypothesis-profile=fresh $(PYTEST_ARGS)

PROCESSORS ?= prescott haswell
test-portable: $(call DONE,fast) $(call DONE,test)
	$(ONE_THREAD) $(PY) tests/portable.py $(PROCESSORS) -- -n $(WORKERS) $(PYTEST_ARGS)

twins: $(call DONE,fast) $(call DONE,test)
	$(ONE_THREAD) $(PY) tests/kernels/bless.py

fuzz: $(call DONE,fast) $(call DONE,test)
	$(ONE_THREAD) $(PY) tests/datasets/fuzz_readers.py $(FUZZ_ARGS)

vectors: $(call DONE,fast) $(call DONE,test)
	$(PY) tests/conformance/generate.py

vectors-check: $(call DONE,fast) $(call DONE,test)
	$(PY) tests/conformance/generate.py --check

mutants: $(call DONE,fast) $(call DONE,test)
	$(ONE_THREAD) $(PY) tests/conformance/mutants.py $(MUTANTS_ARGS)

bench: $(call DONE,fast) $(call DONE,test)
	@mkdir -p $(OUT)
	-$(PY) -m pip install --quiet --disable-pip-version-check --editable ".[peers]"
	$(BIN)/vslam-ref bench --json $(OUT)/bench.json

pair-table: $(call DONE,fast)
	$(ONE_THREAD) $(PY) -m vslam_ref.experiments.orb.learned_pairs

vocabulary: $(call DONE,fast)
	$(ONE_THREAD) $(PY) -m vslam_ref.experiments.orb.words

orb-precision: $(call DONE,fast) $(call DONE,test)
	$(ONE_THREAD) $(PY) tests/orb/precision.py

freak-table: $(call DONE,fast)
	$(ONE_THREAD) $(PY) -m vslam_ref.experiments.freak.learned_pairs

freak-precision: $(call DONE,fast) $(call DONE,test)
	$(ONE_THREAD) $(PY) tests/freak/precision.py

grade: $(call DONE,fast) $(call DONE,test)
	@test -n "$(EXERCISE)" && test -n "$(FILE)" || { echo "say: make grade EXERCISE=16_name FILE=mine.py" >&2; exit 2; }
	$(ONE_THREAD) $(PY) docs/_tools/grade.py "$(EXERCISE)" "$(FILE)"

# --- the house ------------------------------------------------------------------------------

lint: $(call DONE,fast) $(call DONE,test)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-logo
	$(PY) docs/_tools/docstrings.py --check

format: $(call DONE,test)
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

# --- the book -------------------------------------------------------------------------------

notebooks: $(call DONE,fast) $(call DONE,docs)
	$(ONE_THREAD) $(PY) docs/_tools/notebooks.py --write

notebooks-check: $(call DONE,fast) $(call DONE,docs)
	$(ONE_THREAD) $(PY) docs/_tools/notebooks.py --check --execute

docs-index: $(call DONE,fast)
	$(PY) docs/_tools/equation_index.py --write

docs: $(call DONE,fast) $(call DONE,docs)
	$(PY) docs/_tools/equation_index.py --check
	$(PY) docs/_tools/mathjax.py $(BUILD)/mathjax
	$(PY) docs/_tools/stage.py $(BUILD)/source
	$(PY) docs/_tools/make_site.py $(BUILD)

clean:
	rm -rf $(VENV) $(OUT) $(BUILD) dist .pytest_cache .mypy_cache .ruff_cache .hypothesis .import_linter_cache
	find vslam_ref tests docs -name __pycache__ -type d -prune -exec rm -rf {} +
