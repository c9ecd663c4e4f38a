# Every target makes the virtual environment it needs by itself.
PYTHON ?= python3
VENV   ?= .venv
BIN    := $(VENV)/bin
export PYTHONUNBUFFERED = 1
export OPENBLAS_NUM_THREADS = 1
# Else each of the hundreds of programs that the tests start would compile every source it imports anew: .4 s of each rtctl.
unexport PYTHONDONTWRITEBYTECODE

.PHONY: locks run check test test-volume test-system lint bench soak fuzz campaign mutants mutation coverage setup setup-bench docs model recordings clean
setup: $(VENV)/.ready-dev
setup-bench: $(VENV)/.ready-bench

$(VENV)/bin/python:
	@bash .ci/make-venv "$(PYTHON)" "$(VENV)"

# Everything that is fetched has a hash; this package itself, for which there is none, is built from what is there by then.
PIP := $(BIN)/python -m pip install --quiet --disable-pip-version-check
$(VENV)/.ready: pyproject.toml locks/run.txt | $(VENV)/bin/python
	$(PIP) --require-hashes -r locks/run.txt
	$(PIP) --no-deps --no-build-isolation -e .
	@touch $@

$(VENV)/.ready-dev: $(VENV)/.ready locks/dev.txt
	$(PIP) --require-hashes -r locks/dev.txt
	@touch $@

$(VENV)/.ready-bench: $(VENV)/.ready-dev locks/bench.txt
	$(PIP) --require-hashes -r locks/bench.txt
	@touch $@

# The versions of constraints.txt with the hashes of all their files, for every Python and machine. Needs uv.
LOCK := uv pip compile --quiet --universal --python-version 3.11 --generate-hashes --no-header --no-annotate \
  --no-emit-index-url -c constraints.txt pyproject.toml locks/build.in
locks:
	$(LOCK) -o locks/run.txt
	$(LOCK) --extra dev -o locks/dev.txt
	$(LOCK) --extra dev --extra bench -o locks/bench.txt

run: $(VENV)/.ready
	$(BIN)/rtctl demo

# The inner loop: format, lint, types, import contracts, and the tests that are done in seconds.
check: $(VENV)/.ready-dev
	$(BIN)/python tests/run_tier.py check

# Everything a user would run; tests/tiers.py says what runs beside what.
test: $(VENV)/.ready-dev
	$(BIN)/python tests/run_tier.py test

# The same questions asked many more times; takes only processor time that nobody else wants.
test-volume: $(VENV)/.ready-dev
	$(BIN)/python tests/run_tier.py volume

# Against other people's programs; what is missing on this machine is skipped, with its reason. And what meets a clock, asked
# more often than `make test` does.
SYSTEM ?= tests/system tests/attacks tests/integration
test-system: $(VENV)/.ready-dev
	$(BIN)/python -m pytest -m system -rs $(SYSTEM)

lint: $(VENV)/.ready-dev
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/mypy
	$(BIN)/lint-imports --no-cache

# Ten times the campaign of `make test-volume`, every passive rig for 30 s, linear rigs at the edge of their proof, hands that hold still.
campaign: $(VENV)/.ready
	$(BIN)/rtctl campaign --rigs 10000 --ticks 10000
	$(BIN)/rtctl campaign --rigs 1000 --ticks 30000 --passive
	$(BIN)/rtctl campaign --margins --rigs 10000
	$(BIN)/rtctl campaign --still --rigs 20000
	$(BIN)/rtctl campaign --admittance --rigs 500

# Each seeded bug, in a copy of the tree, must make a test fail; a few minutes on two cores.
mutants: $(VENV)/.ready-dev
	NUMBA_DISABLE_JIT=1 $(BIN)/python tests/mutants/run.py

# Every small change of gate, states, faults, detectors, arming, window: at least 95 % must make a test fail.
mutation: $(VENV)/.ready-dev
	NUMBA_DISABLE_JIT=1 $(BIN)/python tests/mutants/mutation.py

# Branches of the safety functions and of all decoders, as plain Python: 100 %.
coverage: export NUMBA_DISABLE_JIT = 1
coverage: $(VENV)/.ready-dev
	$(BIN)/coverage run -m pytest -W ignore::RuntimeWarning tests/unit/control/test_state_functions.py \
	  tests/unit/control/test_detector_functions.py tests/unit/control/test_pulse_functions.py \
	  tests/unit/control/test_gate.py tests/unit/control/test_states.py tests/unit/control/test_detectors.py \
	  tests/unit/control/test_arming.py tests/unit/control/test_sample.py tests/unit/control/test_intermediate.py tests/unit/control/test_remote_proxy.py tests/unit/control/test_environments.py tests/unit/control/test_take_back.py \
	  tests/unit/control/test_device_velocity.py tests/unit/test_documents.py \
	  tests/properties/test_control_gate.py tests/properties/test_encoder.py \
	  tests/unit/hw/test_serial_frame.py tests/unit/hw/test_serial_frame_damage.py tests/unit/hw/test_serial_link.py tests/unit/hw/test_serial_commands.py tests/unit/hw/test_serial_described.py tests/unit/hw/test_serial_described_commands.py tests/unit/hw/test_serial_asked.py \
	  tests/unit/hw/test_force_codecs.py tests/unit/hw/test_moments_of_boards.py \
	  tests/unit/hw/test_can_axes.py tests/unit/hw/test_can_cia402_axis.py tests/unit/hw/test_can_board.py tests/unit/hw/test_can_board_lets_go.py tests/unit/hw/test_can_select.py tests/unit/hw/test_can_maps.py tests/unit/hw/test_can_codecs.py tests/unit/hw/test_can_fields.py \
  tests/unit/hw/test_can_armed.py tests/unit/hw/test_can_odrive_firmware.py tests/unit/hw/test_can_steady.py tests/unit/hw/test_can_left_to_python.py \
	  tests/unit/host/test_message_decoder.py
	$(BIN)/coverage report

bench: $(VENV)/.ready-bench
	$(BIN)/rtctl bench

# One hour at 1 kHz with subscribers that come and go, and floods: memory, descriptors, missed ticks.
soak: $(VENV)/.ready
	$(BIN)/rtctl bench soak --minutes 60

# Ten million inputs to the command path and to each serial decoder; some minutes on two cores. make test feeds them
# fewer. The serial decoders run with bounds checks, in a cache of their own: Numba does not tell the two apart.
fuzz: $(VENV)/.ready-dev
	$(BIN)/python tests/fuzz/command_fuzzer.py 10000000
	$(BIN)/python tests/fuzz/force_fuzzer.py 10000000
	$(BIN)/python tests/fuzz/can_fuzzer.py 10000000
	NUMBA_BOUNDSCHECK=1 RTCTL_CACHE_DIR=build/bounds-checked PYTHONPATH=. $(BIN)/python tests/fuzz/serial_fuzzer.py 10000000

docs: $(VENV)/.ready-dev
	$(BIN)/python -m tests.documents $(addprefix docs/, tick.md safety.md protocol.md config.md api.md faults.md theory.md identify.md ladder.md)

# The friction model of the mock rig: measured on the mock through its sensors, then learned.
model: $(VENV)/.ready
	$(BIN)/python -m rtctl.simulation.mock_points configs/friction/mock_points.csv
	$(BIN)/rtctl fit configs/friction/mock_points.csv --rig mock --epsilon 0.002 --out configs/friction/mock.json

# What the law gives, written down; `make test` holds the law to it.
recordings: $(VENV)/.ready-dev
	$(BIN)/python tests/replay/make_recordings.py

clean:
	rm -rf $(VENV) build dist out
