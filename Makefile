# Everything a fresh clone needs: `make help` lists the targets.
SHELL := bash
.SHELLFLAGS := -eu -o pipefail -c
.ONESHELL:
.DEFAULT_GOAL := help
MAKEFLAGS += --no-print-directory

VENV := .venv
BIN := $(VENV)/bin
STAMP := $(VENV)/.installed
# Any Python that Drake has wheels for; `make setup PYTHON=python3.12` chooses one.
PYTHON ?= python3 python3.13 python3.12 python3.11
SYSTEM_PACKAGES := libegl1 libgl1 libgl1-mesa-dri libglib2.0-0 libgomp1 libusb-1.0-0 \
  libx11-6
# `speed` takes a quarter of an hour, `findings` (what is found, not how fast) hours.
BENCHES := $(addprefix speed.,candump canopen_timing command_start facade mapping \
  planner segmentation) findings.strokes
LONG_BENCHES := $(addprefix findings.,edge_bound edges fine_steps hil low_plates \
  map_recordings map_sessions masks masks_pcl misplaced scanned_film)
PYTEST_ARGS ?= -n 2 --dist loadfile

.PHONY: help setup browser demo test coverage test-all test-socketcan lint format bench bench-all \
  notebooks clean

help: ## List the targets
	@grep -hE '^[a-z-]+:.*## ' $(MAKEFILE_LIST) | sed -E 's/:.*## /:/' \
	  | awk -F: '{printf "make %-14s %s\n", $$1, $$2}'

setup: $(STAMP) ## Install system libraries (where allowed) and packages into .venv
	@:

# Installs Debian packages that are missing; without the right to, says what to type.
define install_packages
install_packages() {
  local missing=() as_root=()
  for name in "$$@"; do
    dpkg-query -W -f='$${Status}' "$$name" 2>/dev/null | grep -q 'ok installed' \
      || missing+=("$$name")
  done
  if [ $${#missing[@]} -eq 0 ] || ! command -v apt-get >/dev/null; then return 0; fi
  if [ "$$(id -u)" -ne 0 ]; then as_root=(sudo -n); fi
  if ! "$${as_root[@]}" true 2>/dev/null; then
    echo "setup: not root; if something is missing: sudo apt-get install $${missing[*]}"
    return 0
  fi
  echo "setup: installing system packages: $${missing[*]}"
  "$${as_root[@]}" apt-get update -qq
  DEBIAN_FRONTEND=noninteractive "$${as_root[@]}" apt-get install -qq -y \
    --no-install-recommends "$${missing[@]}" >/dev/null
}
endef

# Prints the first Python that can make a virtual environment for Painter.
define find_python
find_python() {
  for name in $(PYTHON); do
    if "$$name" -c 'import sys, venv, ensurepip; sys.exit(sys.version_info < (3, 11))' \
        >/dev/null 2>&1; then echo "$$name"; return 0; fi
  done
  return 1
}
endef

$(STAMP): pyproject.toml constraints.txt
	@$(install_packages)
	$(find_python)
	install_packages $(SYSTEM_PACKAGES)
	for package in python3-venv python3.11-venv; do
	  python=$$(find_python) && break
	  install_packages $$package
	done
	python=$$(find_python) \
	  || { echo "setup: no Python >= 3.11 with venv; set PYTHON=..." >&2; exit 1; }
	[ -x $(BIN)/python ] || "$$python" -m venv $(VENV)
	echo "setup: installing Python packages into $(VENV) (some minutes the first time)"
	$(BIN)/python -m pip install -qq -c constraints.txt -e '.[dev,hardware,notebooks]'
	touch $@

browser: ## Install Chromium, which the tests of report pages use
	@$(install_packages)
	command -v chromium >/dev/null || install_packages chromium

demo: setup ## Simulate one whole paint cycle and say where its report is
	@$(BIN)/painter simulate cubes --out runs/demo
	echo "Report: $(CURDIR)/runs/demo/report.html"

test: setup ## Run the fast tests
	@$(BIN)/python -m pytest $(PYTEST_ARGS)

coverage: setup ## Run the fast tests, and print their coverage by room
	@$(BIN)/python -m pytest $(PYTEST_ARGS) --cov --cov-report=json:runs/coverage.json
	$(BIN)/python -m benchmarks.support.coverage_by_room runs/coverage.json

test-all: setup ## Run all tests but those that need hardware
	@$(BIN)/python -m pytest -m 'not hardware' $(PYTEST_ARGS)

test-socketcan: setup ## Run the drive tests on a real SocketCAN interface
	@$(install_packages)
	install_packages user-mode-linux kmod iproute2 can-utils || true
	tests/socketcan/run $(BIN)/python

lint: setup ## Check format, style, types and that notebooks are stripped
	@$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	find notebooks -name '*.ipynb' -not -path '*/.*' -exec $(BIN)/nbstripout --verify {} +

format: setup ## Format the code, fix what can be fixed, strip notebooks
	@$(BIN)/ruff format .
	$(BIN)/ruff check --fix .
	find notebooks -name '*.ipynb' -not -path '*/.*' -exec $(BIN)/nbstripout {} +

# Runs some benchmarks one by one and says at the end which have failed.
define run_benches
run_benches() {
  local failed=()
  for bench in "$$@"; do
    echo "== $$bench"
    $(BIN)/python -m "benchmarks.$$bench" || failed+=("$$bench")
  done
  if [ $${#failed[@]} -gt 0 ]; then echo "failed: $${failed[*]}" >&2; return 1; fi
}
endef

bench: setup ## Measure the speed of single stages (a quarter of an hour)
	@$(run_benches)
	run_benches $(BENCHES)

bench-all: bench ## Measure masks, maps and recordings too (hours)
	@$(run_benches)
	run_benches $(LONG_BENCHES)

notebooks: setup ## Run the notebooks in full and keep them as pages in runs/notebooks
	@$(BIN)/python -m jupyter nbconvert --log-level=WARN --to html --execute \
	  --output-dir runs/notebooks notebooks/*.ipynb
	echo "Pages: $(CURDIR)/runs/notebooks"

clean: ## Remove the environment, caches and build results; runs/ stays
	@rm -rf $(VENV) build dist *.egg-info .pytest_cache .ruff_cache .mypy_cache
	find painter perception models tests -name __pycache__ -exec rm -rf {} +
