# Everything installs what it needs: a clean Debian machine with Rust, gcc, make and Python 3 will do.

CARGO ?= cargo
PYTHON ?= python3
VENV := .venv
VENV_IBM := .venv-ibm
BIN := $(or $(CARGO_TARGET_DIR),target)/release/quavd
PACKAGES := cmake g++ make pkg-config sqlite3 libsqlite3-dev python3-venv systemd

TOOLS := target/tools

.PHONY: all build demo ibm-demo faults deb test-deb test-unit soak companions daemon-figures test test-rust test-python test-ibm lint doc \
	bench bench-table bench-peers bench-link bench-ibm fuzz examples gallery reference clean system browser

all: build

# Followed by the packages.
INSTALL = sudo=; [ "$$(id -u)" = 0 ] || sudo=sudo; $$sudo apt-get update -qq && \
	DEBIAN_FRONTEND=noninteractive $$sudo apt-get install -y -qq --no-install-recommends

# PROJ is built from source and wants cmake and sqlite3; the tests want a venv.
system:
	@for tool in cmake g++ pkg-config sqlite3 systemd-analyze; do command -v $$tool >/dev/null || missing=1; done; \
	test -e /usr/include/sqlite3.h || missing=1; \
	if [ -n "$$missing" ]; then $(INSTALL) $(PACKAGES); fi

# The tests load the reports in it.
browser:
	@command -v chromium >/dev/null || command -v google-chrome >/dev/null || { $(INSTALL) chromium; }

$(VENV)/.ready: sitl/requirements.txt sitl/requirements-alone.txt
	$(PYTHON) -c 'import ensurepip' 2>/dev/null || { $(INSTALL) python3-venv; }
	$(PYTHON) -m venv $(VENV)
	$(VENV)/bin/pip install --quiet --disable-pip-version-check -r sitl/requirements.txt
	$(VENV)/bin/pip install --quiet --disable-pip-version-check --no-deps -r sitl/requirements-alone.txt
	touch $@

# qiskit, for the tests of the circuits and for the stand-in of IBM's service.
$(VENV_IBM)/.ready: sitl/requirements-ibm.txt $(VENV)/.ready
	$(PYTHON) -m venv $(VENV_IBM)
	$(VENV_IBM)/bin/pip install --quiet --disable-pip-version-check -r sitl/requirements-ibm.txt
	touch $@

build: system
	$(CARGO) build --release --locked

# The main job: a fake vehicle with a mission through no-fly areas, re-planned, uploaded, verified.
demo: build $(VENV)/.ready
	$(VENV)/bin/python sitl/demo.py --quavd $(BIN) --scenario fence_examples/s1.plan --out out

# The fault campaign at length: prints a table for each part, and the seeds of any run that failed.
FAULT_RUNS ?= 2000
FAULT_SEED ?= 1
FAULT_WORKERS ?= 24
faults: build $(VENV)/.ready
	QUAV_PYTHON=$(CURDIR)/$(VENV)/bin/python QUAV_FAULT_RUNS=$(FAULT_RUNS) QUAV_FAULT_SEED=$(FAULT_SEED) \
		QUAV_FAULT_WORKERS=$(FAULT_WORKERS) $(CARGO) test --release --locked --test it campaign:: -- \
		--nocapture --test-threads 1

# A Debian package: program, unit, example configuration, man pages, completions.
deb: build $(TOOLS)/bin/cargo-deb
	rm -rf target/package
	$(BIN) generate target/package
	$(TOOLS)/bin/cargo-deb --no-build --strip --output target/debian/

$(TOOLS)/bin/cargo-deb:
	$(CARGO) install cargo-deb --locked --root $(TOOLS)

# Installs, runs and purges it on this machine, which has to be one that can be thrown away.
test-deb: deb
	systemd/test-deb target/debian/quavd_*.deb

# The unit under a systemd of its own, in namespaces. As root.
test-unit: build
	systemd/test-unit $(BIN)

# The daemon for an hour with everything that can happen to it; SOAK=MINUTES for another time.
SOAK ?= 60
soak: build $(VENV)/.ready
	$(VENV)/bin/python sitl/soak.py --quavd $(BIN) --minutes $(SOAK)

# quavd, MAVSDK and MAVProxy side by side on one vehicle. Downloads half a gigabyte at first.
companions: build
	$(PYTHON) -m venv target/companions
	target/companions/bin/pip install --quiet --disable-pip-version-check -r sitl/requirements-companions.txt
	target/companions/bin/python sitl/companions.py --quavd $(BIN)

# Idle cost, and the time from a change on the vehicle to the verified upload.
daemon-figures: build $(VENV)/.ready
	$(VENV)/bin/python sitl/figures.py --quavd $(BIN)

test: test-rust test-python test-ibm

# One runner where there is one; plain cargo test does the same. Most tests wait for a fake vehicle most of
# the time: two of them for each processor.
test-rust: system browser $(VENV)/.ready $(VENV_IBM)/.ready
	@if $(CARGO) nextest --version >/dev/null 2>&1; then \
		QUAV_PYTHON=$(CURDIR)/$(VENV)/bin/python QUAV_IBM_PYTHON=$(CURDIR)/$(VENV_IBM)/bin/python $(CARGO) nextest run --release --locked \
			--test-threads $$(($$(nproc) * 2)); \
	else \
		QUAV_PYTHON=$(CURDIR)/$(VENV)/bin/python QUAV_IBM_PYTHON=$(CURDIR)/$(VENV_IBM)/bin/python $(CARGO) test --release --locked; \
	fi

test-python: $(VENV)/.ready
	cd sitl && MAVLINK20=1 ../$(VENV)/bin/python -m unittest

# What needs qiskit is in a folder of its own, which the unittest above does not look into. The program
# is the one of test-rust: without tests beside it, it has dependencies with other features, built anew.
test-ibm: system $(VENV_IBM)/.ready
	$(CARGO) build --release --locked --bins --tests
	cd sitl && QUAVD=$(abspath $(BIN)) ../$(VENV_IBM)/bin/python -m unittest discover -s ibm

# The six scenarios on a stand-in of ibm_kyiv with its recorded errors, and a training on it. Some minutes.
ibm-demo: build $(VENV_IBM)/.ready
	$(VENV_IBM)/bin/python sitl/ibm_demo.py --quavd $(BIN) --out out

lint: system
	$(CARGO) fmt --check
	$(CARGO) clippy --release --locked --all-targets -- -D warnings

# There are no examples; asked for, they give dependencies the features that lint has checked them with.
doc: system
	RUSTDOCFLAGS="-D warnings" $(CARGO) doc --release --locked --no-deps --lib --examples

# Fuzzing: RUNS executions of each target from the corpora in tests/fuzz.
RUNS ?= 100000
fuzz: system
	tests/fuzz/run $(RUNS)

bench: system
	$(CARGO) bench --locked --bench qaoa

# Times and peak memory of engines and whole plans, one row each.
bench-table: system
	$(CARGO) bench --locked --bench table

# quavd's engines beside PennyLane's, which takes minutes; STEPS=3 shortens its training.
bench-peers: system $(VENV)-peers/.ready
	QUAVD_PEERS_PYTHON=$(CURDIR)/$(VENV)-peers/bin/python $(CARGO) bench --locked --bench peers

$(VENV)-peers/.ready: benches/requirements.txt
	$(PYTHON) -m venv $(VENV)-peers
	$(VENV)-peers/bin/pip install --quiet --disable-pip-version-check -r benches/requirements.txt
	touch $@

# Transfers on a 57,600 baud line and on one that loses 30 % each way.
bench-link: system $(VENV)/.ready
	QUAV_PYTHON=$(CURDIR)/$(VENV)/bin/python $(CARGO) bench --locked --bench link

# The circuit and the line of qubits on IBM's devices, beside qiskit's.
bench-ibm: system $(VENV_IBM)/.ready
	QUAV_IBM_PYTHON=$(CURDIR)/$(VENV_IBM)/bin/python \
		$(CARGO) test --release --locked --test it -- --ignored --nocapture ibm_circuits::figures

# The pictures in fence_examples/README.md.
examples: build
	@mkdir -p fence_examples/pictures
	@for plan in fence_examples/*.plan; do \
		name=$$(basename $$plan .plan); \
		$(BIN) --quiet plan $$plan --out fence_examples/pictures/$$name.svg >/dev/null; \
		code=$$?; [ $$code = 0 ] || [ $$code = 3 ] || exit $$code; \
	done

# docs/configuration.md from the declarations in src/config.
reference: system
	QUAV_WRITE_REFERENCE=1 $(CARGO) test --release --locked --test it -- the_configuration_reference

# A page of all examples with their reports: out/gallery/index.html.
gallery: build
	docs/gallery.sh $(BIN) out/gallery

clean:
	$(CARGO) clean
	rm -rf $(VENV) $(VENV)-peers $(VENV_IBM) out
