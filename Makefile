# Every target sets up what it needs first (tools/setup.sh); a second time that takes no time.
# Arguments go through ARGS, as in: make compare ARGS="--design slender"
BIN := .venv/bin
# Without compiled modules each of the tests' many processes would compile what it imports.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: help setup setup-tests compare test test-all test-release coverage docs verification lint format bench sbom clean
.DEFAULT_GOAL := help

help: ## list these targets
	@sed -n 's/^\([a-z-]*\):.*## /  make \1\t/p' Makefile | expand -t 22

setup: ## set up this machine: Debian's packages, .venv, this project
	@tools/setup.sh

setup-tests: setup # the browser that opens the report, too
	@tools/setup.sh tests

compare: setup ## the main job: compare all solvers on the default finger
	$(BIN)/compare $(or $(ARGS),--design default)

# Each worker computes on one thread: two that share two cores would wait for each other. In the order of their
# names the last files are many and quick, so that no worker waits long for the other one's last.
PYTEST = OMP_NUM_THREADS=1 $(BIN)/pytest -n $(or $(WORKERS),$(shell nproc)) --dist loadfile --no-loadscope-reorder

test: setup ## run the quick tests, some four minutes on two cores
	$(PYTEST) -m "not slow and not release" $(ARGS)

test-all: setup-tests ## run all tests but those of a release, as CI does
	$(PYTEST) -m "not release" $(ARGS)

test-release: setup-tests ## run what is left for a release: the dearest tests, notebooks, licences and advisories
	$(PYTEST) -m release $(ARGS)

# ARGS=linkcheck asks the network whether the links to other sites are alive.
docs: setup ## build the documentation site, build/docs/html
	$(BIN)/python -m pip -qq install --no-deps -r requirements/docs.txt
	OMP_NUM_THREADS=1 $(if $(ARGS),NOTEBOOKS=off) $(BIN)/python -m sphinx -M $(or $(ARGS),html) docs build/docs -W --keep-going -q

verification: setup ## measure fem against known answers, write docs/verification.md
	$(BIN)/python -m benchmarks verification

# Every tool runs, and the last line names those that fail.
lint: setup ## check style, format, types and the order of the packages
	@failed=; for tool in "ruff check" "ruff format --check" mypy lint-imports; do \
	    echo "lint: $$tool"; $(BIN)/$$tool || failed="$$failed, $$tool"; \
	done; [ -z "$$failed" ] || { echo "lint: failed: $${failed#, } (make format mends what ruff can)"; exit 1; }

format: setup ## mend style and format as far as ruff can
	$(BIN)/ruff check --fix --exit-zero
	$(BIN)/ruff format

coverage: setup-tests ## run all tests and report the branches that none takes: build/coverage
	rm -rf build/coverage
	OMP_NUM_THREADS=1 $(BIN)/coverage run -m pytest -m "not release" -n $(or $(WORKERS),$(shell nproc)) --dist loadfile $(ARGS)
	$(BIN)/coverage combine -q
	$(BIN)/coverage html -q -d build/coverage/html
	$(BIN)/coverage report --skip-covered | tail -40

bench: setup ## speed and accuracy against peers
	$(BIN)/python -m benchmarks $(ARGS)

# In an environment of its own, which does not become a part of what it lists; takes half a minute.
sbom: setup ## list what is installed, with licences, as CycloneDX: build/sbom.json
	python3 -m venv build/sbom
	build/sbom/bin/python -m pip -qq install cyclonedx-bom==7.5.0
	build/sbom/bin/cyclonedx-py environment $(BIN)/python --output-reproducible --pyproject pyproject.toml -o build/sbom.json

clean: ## remove .venv, caches and results
	rm -rf .venv out build *.egg-info .mypy_cache .pytest_cache .ruff_cache
	find . -name __pycache__ -prune -exec rm -rf {} +
