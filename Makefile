# make demo    the whole study in silico, ends with the path of its report
# make test    style, types, import rules, and what a change can break by mistake
# make test-long   the long tests, other random examples, then the planted bugs; ROOM=rig/machines/device: of one room
# make test-core   the tests that need no extra, with every Python from 3.11 to 3.14 that is there
# make quick ROOM=modeling/fitting   only the tests of one room
# make bench   time the modeling and its rivals, and how late this machine is
# make plant   plant 40 bugs, one at a time, and see which ones the tests catch
# make install set up .venv/ from requirements.lock (demo and test begin with it)
# make docs-tables   renew the tables of keys in docs/ and the JSON Schemas
# make wheel   dist/ with sdist and wheel, and the demo from the wheel alone (PYTHON=…)
# make cross   compile the C headers for Windows and macOS
# make lock    renew requirements.lock from pyproject.toml (needs uv)

SHELL := /bin/sh
PYTHON ?= $(shell for p in python3.11 python3.12 python3; do \
	$$p -c 'import sys; sys.exit(not (3, 11) <= sys.version_info < (3, 13))' 2>/dev/null && echo $$p && break; done)
BIN := .venv/bin
PYTEST_FLAGS ?=
# If Python may not store bytecode, every process that the tests start compiles the
# libraries again; .venv/ and the project store theirs, whatever the machine's settings.
unexport PYTHONDONTWRITEBYTECODE

# Processes that begin side by side would otherwise compile what all of them load, each for itself.
COMPILE := $(BIN)/python -W ignore -m compileall -q -j 0 -x '/tests?/'
LOADED := numpy scipy pandas statsmodels sklearn pingouin seaborn matplotlib psychopy hypothesis _pytest

.PHONY: install demo test test-long test-core quick bench plant collecting lint lock docs-tables wheel cross clean

install: .venv/installed

.venv/packages: requirements.lock
	@test -n "$(PYTHON)" || { echo "error: expected Python 3.11 or 3.12, got neither; install python3.11 and python3-venv (or make PYTHON=/path/to/python)." >&2; exit 1; }
	@echo "Setting up .venv with $(PYTHON) (about 1.8 GB, a minute or two) ..."
	@$(PYTHON) -m venv .venv || { echo "error: expected the venv module, got none; install python3-venv." >&2; exit 1; }
	@$(BIN)/pip install --quiet --disable-pip-version-check --require-hashes --no-compile -r requirements.lock
	@$(COMPILE) $(addprefix .venv/lib/python*/site-packages/,$(LOADED))
	@touch $@

# The project itself and its C parts; reports a missing compiler. Each header counts, whoever includes it.
HEADERS := $(wildcard modeling/*/*.h rig/*/*/*.h benches/*/*.h)
.venv/installed: .venv/packages pyproject.toml setup.py tools/c_parts.py modeling/rendering/call.c $(HEADERS)
	@$(BIN)/pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@$(BIN)/python -c "from tactileq.modeling.rendering.compiled import is_compiled; is_compiled()"
	@$(COMPILE) tactileq tactileq/*/
	@touch $@

demo: install
	@$(BIN)/tactileq demo

lint: install
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# One process more than there are cores: tests with live processes mostly wait. Two more took a tenth longer.
CORE_PYTHONS ?= python3.11 python3.12 python3.13 python3.14
WORKERS := $(shell expr $$(getconf _NPROCESSORS_ONLN) + 1)
PYTEST := OPENBLAS_NUM_THREADS=1 $(BIN)/pytest -n $(WORKERS) --dist worksteal

# While mypy keeps one core busy, the other collects: in a new clone each worker would otherwise
# rewrite the assertions of all tests for itself. What cannot be collected, the tests name.
collecting: install
	@$(BIN)/pytest --collect-only -qq > /dev/null 2>&1 &

test: collecting lint
	@sh tools/system-packages
	$(PYTEST) $(PYTEST_FLAGS)

# Other examples than those of make test each time; what fails prints how to try it again.
test-long: install
	@sh tools/system-packages
	$(PYTEST) --long $(PYTEST_FLAGS) $(if $(ROOM),tests/$(ROOM) || [ $$? = 5 ])
	$(if $(ROOM),,$(MAKE) plant)

# Without psychopy, sounddevice, pyserial and plotly; what needs them is left out, and named.
test-core:
	@for python in $(CORE_PYTHONS); do \
		$$python -c 'import sys; sys.exit(not (3, 11) <= sys.version_info < (3, 15))' 2>/dev/null || continue; \
		version=$$($$python -c 'import sys; print("%d.%d" % sys.version_info[:2])'); \
		echo "The core with $$($$python --version) ..."; \
		tools/core-python $$python && OPENBLAS_NUM_THREADS=1 .venv-core-$$version/bin/pytest -n $(WORKERS) --dist worksteal $(PYTEST_FLAGS) || exit 1; \
	done

quick: install
	@test -d "tests/$(ROOM)" && test -n "$(ROOM)" || { echo "error: expected a room with tests, got ROOM=$(ROOM); for instance make quick ROOM=modeling/fitting." >&2; exit 1; }
	$(PYTEST) $(PYTEST_FLAGS) tests/$(ROOM)

bench: install
	$(BIN)/pytest tests/benchmarks --benchmark-enable --benchmark-columns=min,median,iqr,rounds
	$(BIN)/pytest --long tests/benchmarks/test_bench_live.py --benchmark-enable --benchmark-columns=min,median,max,rounds

# All of them, or BUG=name, or ROOM=name.
plant: install
	nice -n 5 $(BIN)/python tools/plant_bugs/plant.py --bug "$(BUG)" --room "$(ROOM)"

docs-tables: install
	$(BIN)/python tools/docs_tables.py

wheel:
	tools/try-wheel $(PYTHON)

cross:
	tools/cross-headers

lock:
	uv pip compile --universal --python-version 3.11 --generate-hashes --no-emit-index-url --extra test pyproject.toml -o requirements.lock

clean:
	rm -rf .venv .venv-core-* demo dist build *.egg-info .mypy_cache .pytest_cache .ruff_cache .hypothesis
	find modeling rig benches -name '_[a-z]*' \( -name '*.so' -o -name '*.pyd' -o -name '*.c' -o -name '*.o' \) -delete
