"""The law gives again what it gave when the reference recordings were made, bit for bit."""

import platform
import re
from pathlib import Path

import numba
import numpy as np
import pytest
from make_recordings import FOLDER, MOST_BYTES, digest
from scenarios import SCENARIOS

from rtctl.recording.law_runner import LAW_FIELDS, CommandBook, LawRunner, as_words, field_words
from rtctl.recording.reader import RecordingReader
from rtctl.recording.replay import Replay

REMEDY = (
    "If that is meant: run `make recordings`, and say in CHANGELOG.md, under 'Behaviour at the handle', "
    "what a hand will notice."
)
CHANGELOG = Path(__file__).parents[2] / "CHANGELOG.md"
FILES = sorted(FOLDER.glob("*.mcap"))


def test_every_scenario_has_its_small_recording():
    assert {path.stem for path in FILES} == set(SCENARIOS), "run `make recordings`"
    assert all(path.stat().st_size < MOST_BYTES for path in FILES)


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_the_law_gives_again_what_was_recorded(path):
    reader = RecordingReader([path])
    missing = sorted(set(reader.missing_fields()) & set(LAW_FIELDS))
    assert not missing, (
        f"{path.name} was recorded before the tick had {', '.join(missing)}: run `make recordings`"
    )
    same_compiler = reader.about["numba"] == numba.__version__ and platform.machine() == "x86_64"
    if same_compiler:
        verdict = Replay(reader).check()
        assert verdict.ticks > 300
        assert not verdict.stopped
        assert verdict.first is None, (
            f"{path.name}: the law now gives something else: {verdict.first}. {REMEDY}"
        )
        return
    replay = Replay(reader)  # another compiler or processor may round the last bit differently
    for rows, again in replay.run():
        for name in LAW_FIELDS:
            close = np.isclose(again[name], rows[name], rtol=1e-6, atol=1e-9, equal_nan=True)
            assert close.all(), f"{path.name}: {name} differs by more than rounding. {REMEDY}"


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_the_law_asks_nothing_of_what_the_tick_before_has_left_in_its_row(path):
    """So its state alone says how it goes on: half seconds of a recording are replayed beside each other."""
    reader = RecordingReader([path])
    recorded = reader.read()
    law, book = LawRunner(reader.law(), reader.n_axes), CommandBook(reader.n_axes)
    book.learn(recorded.commands)
    which, known = book.find(recorded.rows["command_seq"])
    rng, rows = np.random.default_rng(0), recorded.rows[: min(known, 300)]
    left = rng.integers(0, 1 << 64, (len(rows), *law.tick_words.shape), np.uint64)
    for k in range(len(rows)):
        plain = law.state.copy()
        expected = as_words(law.run(rows[k : k + 1], book.commands, which[k : k + 1])[0]).copy()
        law.state[:], law.tick_words[:] = plain, left[k]
        found = as_words(law.run(rows[k : k + 1], book.commands, which[k : k + 1])[0])
        written = field_words(reader.n_axes, LAW_FIELDS)
        assert (found[:, written] == expected[:, written]).all(), rows["tick"][k]


def test_the_changelog_acknowledges_what_the_law_gives():
    section = CHANGELOG.read_text().split("### Behaviour at the handle")[1].split("\n## ")[0]
    told = re.findall(r"\(recordings ([0-9a-f]{10})\)", section)
    now = digest(FOLDER)
    assert now in told, (
        f"the reference recordings give {now}, which no line acknowledges. {REMEDY} End it with: "
        f"(recordings {now})"
    )
