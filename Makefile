# One word does all of it, on a fresh machine too: make demo, make test.
# Needs Python 3.11 or later and no root. Everything is kept in .venv.

SHELL := /bin/bash
.SHELLFLAGS := -eu -o pipefail -c
# The suite starts many processes; without bytecode each of them compiles all anew.
unexport PYTHONDONTWRITEBYTECODE
.DELETE_ON_ERROR:
.DEFAULT_GOAL := help

PYTHON ?= $(firstword $(foreach name,python3.11 python3.12 python3.13 python3.14 python3,$(shell command -v $(name))) python3)
VENV := .venv
BIN := $(VENV)/bin
PEER := $(VENV)/bench-peer
JUDGES := $(VENV)/judges
API_JUDGE := $(VENV)/schemathesis
TYPE_JUDGE := $(VENV)/pyright
OPCUA_JUDGE := $(VENV)/node-opcua/node_modules/node-opcua
MILO_JUDGE := $(VENV)/milo
WHEELHOUSE := wheelhouse
POT := robolink/locale/robolink.pot
# The pip of Python 3.11 compares each wheel of each release with hundreds of tags, one by one: 18 s of
# CPU for what takes this one 8. Where the index lacks it, the old one does.
PIP := pip==26.3 --hash=sha256:f3b60b20ffaadd4415ed7957212a38ac63fa4c5fa375bd0f4a797777940fad13

.PHONY: help
help: ## Show what can be made.
	@sed -nE 's/^([a-z]+):.*## (.*)/make \1\t\2/p' Makefile | expand -t 16

.PHONY: demo
demo: $(VENV)/.installed ## Install robolink and show a nozzle change on a simulated robot.
	$(BIN)/robolink demo
	@echo "Twenty cells, and an agent that is killed twice: $(BIN)/robolink fleet demo"

.PHONY: test
test: check ## Install everything, check the sources and run the tests.
	$(BIN)/python -m pytest --processes 2

# What takes many minutes or asks a package index; docs/contributing.md says what stands for it
# in `make test`.
# Seeds of the adversary, and virtual hours a seed. What was run with the same sources is passed
# over, so a range can be gone on with; build/soak/results.jsonl keeps a line a seed. SEEDS=fresh
# draws COUNT seeds from the commit that were never run before, and adds them to
# tests/soak/seeds_run.txt. SHARE=1/2 and SHARE=2/2 run side by side.
SEEDS :=
COUNT := 1000
SHARE := 1/1
HOURS := 20
# MARKS="soak and not fault" leaves out what `make faults` runs.
MARKS := soak

.PHONY: soak
soak: $(VENV)/.installed-dev $(if $(SEEDS),,docs) ## Run what make test leaves out for its length; SEEDS=0-499 the adversary only.
ifeq ($(SEEDS),)
	$(BIN)/python -m pytest --processes 2 -m '$(MARKS)'
	$(BIN)/python -m tests.certificate.table
	$(BIN)/python -m tests.soak.mutant_table
else
	$(BIN)/python -m tests.soak.adversary --seeds $(SEEDS) --count $(COUNT) --share $(SHARE) \
		--hours $(HOURS)
endif

# ROWS="F01 F25" takes some of them.
ROWS :=
.PHONY: faults
faults: $(VENV)/.installed-dev ## Run the fault catalogue, F01 to F87, and print what it shows.
	@$(BIN)/python -m tests.faults.catalogue $(ROWS)

# Their files are called judge_*.py: a plain pytest, which takes test_*.py, leaves them out.
.PHONY: peers
peers: $(VENV)/.installed-dev $(JUDGES) $(API_JUDGE) $(TYPE_JUDGE) $(OPCUA_JUDGE) $(MILO_JUDGE) ## Let foreign programs judge buses, PLC program, control API and examples.
	@{ command -v mbpoll && command -v tshark && command -v node && command -v cc && pkg-config --exists libmodbus; } \
		>/dev/null || { \
		echo "Not all judges are here. On Debian and Ubuntu:" \
			"apt-get install mbpoll libmodbus-dev pkg-config gcc tshark nodejs" >&2; \
		exit 1; }
	PYTHONPATH=$(JUDGES) $(BIN)/python -m pytest --timeout 300 -o 'python_files=judge_*.py' tests/peers

# It needs pyserial and nothing else. Without it its judge is left out, and says so.
$(JUDGES): $(VENV)/.installed-dev
	$(BIN)/python -m pip install --quiet --no-deps --target $@ minimalmodbus==2.1.1 || true

# It needs other versions of pytest and hypothesis, so it has its own environment.
$(API_JUDGE): $(VENV)/.installed-dev
	$(BIN)/python -m venv $@
	$@/bin/python -m pip install --quiet schemathesis==4.32.5 || true

# The npm package holds the checker itself; without npm or a network its judge says so.
$(TYPE_JUDGE): $(VENV)/.installed-dev
	mkdir -p $@
	npm install --silent --no-fund --no-audit --prefix $@ pyright@1.1.414 || true

# Some 120 packages of JavaScript, which nothing but its judge reads; without them that judge fails.
$(OPCUA_JUDGE): $(VENV)/.installed-dev
	mkdir -p $(VENV)/node-opcua
	npm install --silent --no-fund --no-audit --prefix $(VENV)/node-opcua node-opcua@2.186.4 && touch $@ || true

# Eclipse Milo in Java; without it, or a JDK, it is left out, and the run says so. MILO_CLASSPATH=a.jar:b.jar
# names its archives where they are here already; Maven takes minutes to see that there is no network.
$(MILO_JUDGE): tests/peers/milo/pom.xml
	[ -n "$$MILO_CLASSPATH" ] || timeout 300 mvn --quiet --batch-mode --file $< \
		dependency:copy-dependencies -DoutputDirectory=$(abspath $@) || true

# Debian's chromium, or what `chromium` on PATH is. With NEED_CHROMIUM=1 a test that cannot run fails.
.PHONY: panel
panel: $(VENV)/.installed-browser ## Press the pages of the panel in a real browser; needs chromium and fonts-noto-cjk.
	$(BIN)/python -m pytest -n 0 tests/panel/browser

# NIGHT= hours; PARTS="docs peers" runs some. The parts and their shares: tools/nightly.py.
NIGHT ?= 8
PARTS :=
.PHONY: nightly
nightly: $(VENV)/.installed-dev ## Run all that make test leaves out, and print one table of how it ended.
	@NIGHT=$(NIGHT) $(BIN)/python tools/nightly.py $(PARTS)

# N=50000 takes a night: 25 rounds of 2,000 cells. DATABASE=postgresql starts a server of its own.
N ?= 200
KILLS := 6
DATABASE := sqlite
.PHONY: fleet
fleet: $(VENV)/.installed-dev ## Write an offset at N=200 simulated cells while the agent is killed, and count.
	$(BIN)/python -m tests.fleet.campaign --cells $(N) --kills $(KILLS) --database $(DATABASE)

.PHONY: windows
windows: $(VENV)/.installed-dev ## Run the wheel on a Windows CPython under wine, as far as that goes.
	@$(BIN)/python -m tests.windows

# Each in an environment of its own, made anew. RUNS="lowest-3.11 newest-3.13" takes some of them.
RUNS :=
.PHONY: versions
versions: $(VENV)/.installed-dev ## Run with the lowest versions of packages, and the newest on each Python.
	@$(BIN)/python -m tests.versions $(RUNS)

.PHONY: check
check: $(VENV)/.installed-dev ## Check style, types and who imports whom.
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/lint-imports

# ONLY="fleet solvers" runs some parts. NOISY=yes publishes from a busy machine, and the page says so.
ONLY :=
NOISY :=
.PHONY: bench
bench: $(VENV)/.installed-dev $(PEER) ## Measure against floors and peers, write docs/performance.md; ONLY=fleet prints one part.
	PYTHONPATH=$(PEER) $(BIN)/python -m benchmarks $(or $(ONLY),--publish $(if $(NOISY),--noisy))

# It asks for some ninety packages; what is measured needs none of them. So it stands beside the
# others, where only the benchmark sees it. Without it that one figure is left out.
$(PEER): $(VENV)/.installed-dev
	$(BIN)/python -m pip install --quiet --no-deps --target $@ \
		scikit-surgerycalibration==1.2.6 scikit-surgerycore==0.8.3 || true

# Installed only here: nothing else needs Sphinx. docs/decisions/0005-libraries-chosen.md
.PHONY: docs
docs: $(VENV)/.installed-docs ## Build the pages and the API into build/docs/html, links checked.
	$(BIN)/python docs/site/build.py

.PHONY: messages
messages: $(VENV)/.installed-dev ## Collect every sentence shown to a person, keep its translations.
	$(BIN)/python -m babel.messages.frontend --quiet extract --mapping=pyproject.toml \
		--keywords=tr --keywords=declared --no-default-keywords --no-location \
		--omit-header --sort-output --width=100 --output-file=$(POT) \
		robolink cli/robolink_cli simulators/robolink_simulators
	@$(BIN)/python tools/translations.py || true

# HOME_URL= and PAGES_URL= say where robolink is published: tools/package_page.py.
HOME_URL :=
PAGES_URL :=
export HOME_URL PAGES_URL
.PHONY: build
build: $(VENV)/.installed-dev ## Build wheel, source archive, bill of materials, licences: dist/.
	$(BIN)/python -m hatchling build -t sdist -t wheel
	$(BIN)/python tools/materials.py dist

.PHONY: lock
lock: $(VENV)/.installed-dev ## Name every package by version and hash: requirements*.lock.
	$(BIN)/python tools/lock.py

# Of every run-time dependency a wheel is taken, none is built: the offline PC has no compiler.
# Which one, requirements.lock says; `make wheelhouse FROM=ranges` takes the newest that fit.
FROM := requirements.lock
GATHER = $(BIN)/python -m pip download --quiet --only-binary=:all: --python-version=3.11 \
	--implementation=cp $(if $(filter ranges,$(FROM)),$(WHEELHOUSE)/robolink-*.whl,--no-deps \
	--require-hashes --requirement $(FROM))

.PHONY: wheelhouse
wheelhouse: $(VENV)/.installed-dev ## Gather all wheels for a PC without network: linux, win_amd64.
	rm -rf $(WHEELHOUSE)
	$(BIN)/python -m hatchling build -t wheel -d $(WHEELHOUSE)
	$(GATHER) --platform=manylinux2014_x86_64 --dest=$(WHEELHOUSE)/linux
	$(GATHER) --platform=win_amd64 --dest=$(WHEELHOUSE)/win_amd64
	cp $(WHEELHOUSE)/robolink-*.whl $(WHEELHOUSE)/linux
	cp $(WHEELHOUSE)/robolink-*.whl $(WHEELHOUSE)/win_amd64
	rm $(WHEELHOUSE)/robolink-*.whl

.PHONY: clean
clean: ## Remove everything that was made.
	rm -rf $(VENV) $(WHEELHOUSE) dist build .pytest_cache .mypy_cache .ruff_cache .hypothesis

# A stamp is written last, so that a set-up that was interrupted is made again.
# What is never imported need not be compiled: Python does the rest at the first import.
# With LOCKED, as in .ci/run, it is byte for byte what requirements-dev.lock names.
LOCKED ?=
$(VENV)/.installed-dev: pyproject.toml $(VENV)/.created
	$(if $(LOCKED),LOCKED=$(LOCKED) tools/install-locked $(BIN)/python,$(BIN)/python -m pip \
		install --quiet --no-compile --editable '.[dev]')
	touch $@ $(VENV)/.installed

$(VENV)/.installed-docs: $(VENV)/.installed-dev
	$(BIN)/python -m pip install --quiet --no-compile --editable '.[docs]'
	touch $@

$(VENV)/.installed-browser: $(VENV)/.installed-dev
	$(BIN)/python -m pip install --quiet --no-compile --editable '.[browser]'
	touch $@

$(VENV)/.installed: pyproject.toml $(VENV)/.created
	$(BIN)/python -m pip install --quiet --editable '.[panel,eye,fleet]'
	touch $@

$(VENV)/.created:
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
		echo "robolink needs Python 3.11 or later; $(PYTHON) is not. Name one: make PYTHON=/path/to/python3.11" >&2; \
		exit 1; }
	@$(PYTHON) -c 'import ensurepip, venv' 2>/dev/null || { \
		echo "$(PYTHON) cannot make virtual environments. On Debian and Ubuntu the package" \
			"python$$($(PYTHON) -c 'import sys; print("%d.%d" % sys.version_info[:2])')-venv is missing." >&2; \
		exit 1; }
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --no-compile --retries 0 --only-binary=:all: --require-hashes \
		--requirement <(echo "$(PIP)") 2>/dev/null || true
	touch $@
