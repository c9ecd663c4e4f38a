"""A motor board over UDP and a force sensor on a pty as one rig, each in its own time."""

import threading
import time

import example_package
import numpy as np
import pytest
from force_devices import Rokubi, force_of

from hw.interface import LinkFault
from hw.rig import compose
from rtctl.rig_file.config import load
from rtctl.rt.replug import Replug
from rtctl.tick import new_ticks

MAX_AGE_TICKS = 2


class Playing:
    """Both devices, each in its own time: the board twice a tick, the sensor every second tick."""

    def __init__(self):
        self.board, self.sensor = example_package.board(), Rokubi()
        self.sent = {0: 0}
        self._stop = threading.Event()
        self._threads = [threading.Thread(target=play) for play in (self._play_board, self._play_sensor)]

    def _play_board(self):
        while not self._stop.wait(0.0005):
            self.board.listen(time.monotonic())
            self.board.step()

    def _play_sensor(self):
        k = 0
        while not self._stop.wait(0.002):
            k += 1
            try:
                self.sensor.write(self.sensor.frame(k))
            except BlockingIOError:
                continue
            except OSError:
                continue  # unplugged

    def plug_in_again(self, port):
        """The sensor comes back under the same name; its device file is another one."""
        self.sensor = Rokubi()
        port.unlink()
        port.symlink_to(self.sensor.path)

    def __enter__(self):
        for thread in self._threads:
            thread.start()
        return self

    def __exit__(self, *_exc):
        self._stop.set()
        for thread in self._threads:
            thread.join()
        self.sensor.close()


def rig_file(folder, playing):
    text = (example_package.FOLDER / "rig.toml").read_text()
    port = playing.board.socket.getsockname()[1]
    text = text.replace("port = 9100", f"port = {port}\nlost_after_s = 1.0")
    text = text.replace(
        'name = "board"', 'name = "board"\nchannels = ["position", "current", "estop", "torque"]'
    )
    text = text.replace("[axis.force]", "")
    path = folder / "rig.toml"
    path.write_text(
        text.replace("velocity_limit_rad_s = 6.0", "velocity_limit_rad_s = 6.0\nforce.limit_n = 10000.0")
        + f'\n[[device]]\nkind = "rokubi"\nname = "finger"\nrate_hz = 500\nbudget_us = 300\n'
        f'[device.options]\nport = "{playing.sensor.path}"\n'
    )
    return path


@pytest.fixture
def site(tmp_path):
    with example_package.installed(tmp_path / "site"):
        yield
    example_package.close_all()


class Cycles:
    """The loop's reading and writing, in this process: a shared machine may hold up a daemon until it is
    killed.
    """

    def __init__(self, backend):
        self.backend, self.tick, self.slot, self.rows = backend, new_ticks(), 0, []
        self._due = time.monotonic()

    def run(self, n):
        for _ in range(n):
            self.tick["tick"] = self.slot
            self.backend.read(self.tick)
            self.backend.write(self.tick)
            self.rows.append(self.tick.copy())
            self.slot += 1
            self._due = max(self._due + 0.001, time.monotonic() - 0.01)
            time.sleep(max(self._due - time.monotonic(), 0.0))

    def until(self, wanted):
        deadline = time.monotonic() + 60
        while not wanted():
            assert time.monotonic() < deadline
            self.run(1)


def test_no_force_is_shown_as_fresh_that_is_older_than_its_device_may_be(site, tmp_path):
    with Playing() as playing:
        loaded = load(rig_file(tmp_path, playing))
        assert [member.max_age_ticks for member in loaded.members()] == [0, MAX_AGE_TICKS]
        backend = compose(loaded.members(), loaded.config.hardware())
        backend.open()
        cycles = Cycles(backend)
        cycles.run(1000)
        cycles.until(lambda: cycles.tick["sample_count"][0] > 100)
        backend.close()
    ticks = np.concatenate(cycles.rows)
    fresh = np.flatnonzero(np.diff(ticks["sample_count"]) > 0) + 1
    k = np.rint(ticks["force_n"][:, 0] / 0.5).astype(int)
    np.testing.assert_allclose(ticks["force_n"][fresh], [force_of(one) for one in k[fresh]], rtol=1e-6)
    assert (np.diff(k[fresh]) >= 0).all(), "never an older force after a newer one"
    changed = np.concatenate([[True], np.diff(k) != 0])
    newest = np.maximum.accumulate(np.where(changed, np.arange(len(k)), 0))
    assert (np.arange(len(k)) - newest)[fresh].max() <= MAX_AGE_TICKS


def test_an_unplugged_sensor_is_named_and_after_plugging_it_in_again_all_is_fresh_anew(site, tmp_path):
    said = []
    with Playing() as playing:
        port = tmp_path / "finger"
        port.symlink_to(playing.sensor.path)
        path = rig_file(tmp_path, playing)
        path.write_text(path.read_text().replace(playing.sensor.path, str(port)))
        loaded = load(path)
        backend = Replug(compose(loaded.members(), loaded.config.hardware()), said.append)
        backend.open()
        cycles = Cycles(backend)
        cycles.until(lambda: cycles.tick["sample_count"][0] > 20)
        playing.sensor.unplug()
        cycles.until(lambda: said)
        assert said[0].startswith("lost: device[1] 'finger': ")
        assert int(cycles.tick["link_faults"][0]) & LinkFault.LOST
        before = int(cycles.tick["sample_count"][0])
        cycles.run(10)
        assert cycles.tick["sample_count"][0] == before
        playing.plug_in_again(port)
        cycles.until(lambda: cycles.tick["sample_count"][0] > before + 20)
        assert said[-1] == "found again"
        backend.close()
