# Everything that people do with celaje. Needs a Rust toolchain (1.88 or newer) and Python (3.10 or newer, with venv);
# all else goes into .venv and target, here in this folder.

PYTHON ?= python3
BIN := .venv/bin
PIP := $(BIN)/python -m pip --disable-pip-version-check --quiet

# What the installed package is built from.
SOURCES := Cargo.toml Cargo.lock pyproject.toml setup.py \
	$(shell find crates data python -type f \( -name '*.rs' -o -name '*.toml' -o -name '*.csv' -o -name '*.py' -o -name '*.pyi' \))

# Codes that ours is measured beside, and how an environment of their own is made in target.
SASKTRAN2 := sasktran2==2026.10.1
ERADIATE := eradiate==1.2.0 eradiate-mitsuba==0.5.0
peer = $(PYTHON) -m venv target/$(1) && \
	target/$(1)/bin/python -m pip --disable-pip-version-check --quiet install $(2)

.DEFAULT_GOAL := help
.PHONY: help sky test check bench bench-mie bench-peers data docs gallery accuracy prerequisites clean

help:  ## Show this help
	@awk -F ':.*## ' '/^[a-z-]+:.*## / { printf "make %-11s %s\n", $$1, $$2 }' $(MAKEFILE_LIST)

sky: .venv/installed  ## Set everything up and render an evening sky over Zaragoza
	$(BIN)/celaje render --at 41.65,-0.88 --time 2026-06-21T18:30Z -o sky.png -o sky.exr
	@echo "The picture is $(CURDIR)/sky.png; sky.exr beside it holds the spectrum of every pixel."

test: .venv/installed-dev  ## Run all tests: Rust, Python, examples of the documentation
	cargo test --locked
	$(BIN)/python -m pytest --doctest-modules --pyargs celaje tests/python

check: .venv/installed-dev  ## Check formatting, lints and types, as continuous integration does
	cargo fmt --all --check
	cargo clippy --locked --workspace --all-targets -- -D warnings
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy

accuracy: prerequisites  ## Run the long statistical tests, which make test leaves out
	cargo test --locked --release -- --ignored

bench: prerequisites  ## Measure kernels, and the time to a stated error
	cargo bench --locked -p celaje --bench kernels --bench mie --bench time_to_error

bench-mie: prerequisites  ## Measure Mie theory beside sasktran2's, which goes into target/sasktran2
	$(call peer,sasktran2,$(SASKTRAN2))
	cargo bench --locked -p celaje --bench mie -- --python $(CURDIR)/target/sasktran2/bin/python

bench-peers: prerequisites  ## Measure the peer scene beside Eradiate and sasktran2, which go into target
	$(call peer,eradiate,$(ERADIATE))
	$(call peer,sasktran2,$(SASKTRAN2))
	cargo bench --locked -p celaje --bench peers -- \
		--eradiate $(CURDIR)/target/eradiate/bin/python --sasktran2 $(CURDIR)/target/sasktran2/bin/python

data: prerequisites  ## Compute the shipped tables of particle optics anew (five minutes of processor time)
	cargo run --locked --release -p celaje --example make_tables -- data/mie_tables

gallery: .venv/installed-dev  ## Make every picture of the gallery anew (some minutes)
	for script in $(filter-out %/common.py,$(wildcard docs/gallery/*.py)); do $(BIN)/python $$script || exit 1; done

docs: gallery  ## Build the manual of the library, the figures and the gallery
	cargo doc --locked --workspace --no-deps
	cargo run --locked --release -p celaje --example conventions -- docs/figures
	@echo "The manual is $(CURDIR)/target/doc/celaje/index.html"

clean:  ## Remove all that was built
	rm -rf .venv target build python/*.egg-info

prerequisites:
	@sh scripts/prerequisites.sh $(PYTHON)

.venv/bin/python: | prerequisites
	$(PYTHON) -m venv .venv

.venv/installed: .venv/bin/python $(SOURCES)
	@echo "Building and installing celaje into .venv (some minutes the first time)"
	@rm -rf build  # setuptools would pack what an older build left there
	$(PIP) install .
	@touch $@

.venv/installed-dev: .venv/bin/python $(SOURCES)
	@echo "Building and installing celaje and what its tests need into .venv (some minutes the first time)"
	@rm -rf build
	$(PIP) install '.[dev]'
	@touch $@ .venv/installed
