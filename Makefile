# Every target sets up what it needs. A fresh machine needs only make and Python 3.11 or newer.
# Another interpreter: make test PYTHON=python3.12

PYTHON ?= python3
OLDEST_PYTHON ?= python3.11
WORKERS ?= 2
STARTED := $(shell date +%s)

# The stamps say when the environment was last brought in line with pyproject.toml.
READY := .venv/ready.stamp
DOCS_READY := .venv/docs.stamp
BENCH_READY := .venv/bench.stamp
NOTEBOOKS_READY := .venv/notebooks.stamp
OLDEST := .venv-oldest/ready.stamp

# One thread per process: two workers on two cores do not fight, and timings can be compared.
ONE_THREAD := OMP_NUM_THREADS=1 OPENBLAS_NUM_THREADS=1 MKL_NUM_THREADS=1 RAYON_NUM_THREADS=1

# Containers often set it: then each process that a test starts compiles all of smid again.
unexport PYTHONDONTWRITEBYTECODE

.DELETE_ON_ERROR:
.DEFAULT_GOAL := help
.PHONY: help demo test test-kernels test-oldest check docs bench notebooks clean

help:
	@echo "make demo          identify the bundled clutch record, diagnose where it fails, open a report"
	@echo "make test          run the tests"
	@echo "make test-kernels  run numerical tests with the arithmetic of other processors"
	@echo "make test-oldest   run the tests with the oldest dependencies that pyproject.toml admits"
	@echo "make check         lint, format, types, import layers, documentation"
	@echo "make docs          build the documentation in build/docs"
	@echo "make bench         run the benchmarks"
	@echo "make notebooks     run the notebooks and keep their outputs"
	@echo "make clean         remove the environments and every cache"

demo: $(READY)
	.venv/bin/smid demo --since $(STARTED)

test: $(READY)
	$(ONE_THREAD) .venv/bin/pytest -n $(WORKERS) --dist worksteal

# OpenBLAS chooses its kernel by the processor, and the last digits depend on it. numpy knows its own loops by names that
# differ between versions, so it is asked for them.
KERNEL_TESTS := tests/relaxations/solvers/test_solvers.py tests/relaxations/moments/test_lift_and_lasserre.py \
	tests/relaxations/points/test_witness.py tests/relaxations/moments/test_exactness.py \
	tests/smid/recursive tests/smid/networks tests/smid/identification/test_identify.py
WITH_KERNEL = .venv/bin/python .ci/kernel.py && $(ONE_THREAD) .venv/bin/pytest -q -n $(WORKERS) --dist worksteal $(KERNEL_TESTS)

test-kernels: $(READY)
ifeq ($(shell uname -m),x86_64)
	export OPENBLAS_CORETYPE=Haswell; $(WITH_KERNEL)
	export OPENBLAS_CORETYPE=Nehalem NPY_DISABLE_CPU_FEATURES="$$(.venv/bin/python .ci/kernel.py --loops)"; $(WITH_KERNEL)
else
	@echo "skipped: the kernels Haswell and Nehalem are for x86-64, and this machine is $$(uname -m)"
endif

# Old packages use what newer ones of theirs deprecate: that is not for us to mend.
test-oldest: $(OLDEST)
	$(ONE_THREAD) .venv-oldest/bin/python -m pytest -W ignore::DeprecationWarning -W ignore::PendingDeprecationWarning -n $(WORKERS) --dist worksteal

check: $(READY)
	.venv/bin/ruff check .
	.venv/bin/ruff format --check .
	.venv/bin/mypy
	.venv/bin/lint-imports
	$(MAKE) --no-print-directory docs

# Without the folder of generated pages a name that is gone would keep its page.
docs: $(DOCS_READY)
	rm -rf docs/generated
	$(ONE_THREAD) .venv/bin/sphinx-build --quiet --fail-on-warning --keep-going -d build/doctrees docs build/docs

bench: $(BENCH_READY)
	$(ONE_THREAD) .venv/bin/python -m benchmarks

notebooks: $(NOTEBOOKS_READY)
	printf '%s\n' notebooks/*.py | $(ONE_THREAD) xargs -n 1 -P $(WORKERS) .venv/bin/jupytext --quiet --to ipynb --execute

clean:
	rm -rf .venv .venv-oldest build dist docs/generated .cache .hypothesis .import_linter_cache .mypy_cache .pytest_cache .ruff_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +

$(READY): pyproject.toml
	@command -v "$(PYTHON)" >/dev/null || { \
		echo "smid needs Python 3.11 or newer, and '$(PYTHON)' was not found." >&2; \
		echo "Name your interpreter: make $(MAKECMDGOALS) PYTHON=/path/to/python3.11" >&2; exit 1; }
	@"$(PYTHON)" -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
		echo "smid needs Python 3.11 or newer, and '$(PYTHON)' is $$("$(PYTHON)" -V 2>&1)." >&2; \
		echo "Name a newer one: make $(MAKECMDGOALS) PYTHON=/path/to/python3.11" >&2; exit 1; }
	"$(PYTHON)" -m venv .venv
	.venv/bin/python -m pip install -q --disable-pip-version-check -e ".[dev]"
	@touch $@

$(OLDEST): pyproject.toml
	@"$(OLDEST_PYTHON)" -c 'import sys; sys.exit(sys.version_info[:2] != (3, 11))' || { \
		echo "make test-oldest needs Python 3.11, the oldest that pyproject.toml admits." >&2; \
		echo "Name it: make test-oldest OLDEST_PYTHON=/path/to/python3.11" >&2; exit 1; }
	"$(OLDEST_PYTHON)" -m venv --clear .venv-oldest
	.venv-oldest/bin/python -m pip install -q --disable-pip-version-check uv
	.venv-oldest/bin/uv pip install -q --python .venv-oldest/bin/python --resolution lowest-direct -e ".[dev]"
	@touch $@

$(NOTEBOOKS_READY): $(READY)
	.venv/bin/python -m pip install -q --disable-pip-version-check -e ".[dev,notebooks]"
	@touch $@

$(DOCS_READY): $(READY)
	.venv/bin/python -m pip install -q --disable-pip-version-check -e ".[dev,docs]"
	@touch $@

$(BENCH_READY): $(READY)
	.venv/bin/python -m pip install -q --disable-pip-version-check -e ".[dev,bench]"
	@touch $@
