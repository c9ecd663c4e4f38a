"""A motor board over UDP and a force sensor on a pty as one rig, through the daemon's own processes."""

import threading
import time

import example_package
import numpy as np
import pytest
from force_devices import Rokubi, force_of

from rtctl.config import load
from rtctl.host.supervisor import Host

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


class Keep:
    """Collects the ticks of a run; does something once there are enough."""

    def __init__(self, after=10**9, then=lambda: None):
        self.rows, self.count, self.after, self.then = [], 0, after, then

    def __call__(self, host, rows):
        self.rows.append(rows[["tick", "sample_count", "force_n", "link_faults"]].copy())
        before, self.count = self.count, self.count + len(rows)
        if before < self.after <= self.count:
            self.then()

    def ticks(self):
        return np.concatenate(self.rows)


def test_no_force_is_shown_as_fresh_that_is_older_than_its_device_may_be(site, tmp_path):
    keep = Keep()
    with Playing() as playing:
        loaded = load(rig_file(tmp_path, playing))
        assert [member.max_age_ticks for member in loaded.members()] == [0, MAX_AGE_TICKS]
        with Host(loaded, observers=[keep], runtime_dir=str(tmp_path / "run")) as host:
            host.run(1.5)
    ticks = keep.ticks()
    fresh = np.flatnonzero(np.diff(ticks["sample_count"]) > 0) + 1
    assert len(fresh) > 50
    k = np.rint(ticks["force_n"][:, 0] / 0.5).astype(int)
    np.testing.assert_allclose(ticks["force_n"][fresh], [force_of(one) for one in k[fresh]], rtol=1e-6)
    assert (np.diff(k[fresh]) >= 0).all(), "never an older force after a newer one"
    changed = np.concatenate([[True], np.diff(k) != 0])
    newest = np.maximum.accumulate(np.where(changed, np.arange(len(k)), 0))
    assert (np.arange(len(k)) - newest)[fresh].max() <= MAX_AGE_TICKS


def test_unplugging_the_sensor_is_a_fault_that_names_it_and_plugging_it_in_again_heals_it(site, tmp_path):
    heard = []
    with Playing() as playing:
        port = tmp_path / "finger"
        port.symlink_to(playing.sensor.path)
        path = rig_file(tmp_path, playing)
        path.write_text(path.read_text().replace(playing.sensor.path, str(port)))

        def _unplug():
            playing.sensor.unplug()

        def _watch(host, rows):
            text = " ".join(heard)
            if "lost: device[1] 'finger'" in text and not port.resolve().exists():
                playing.plug_in_again(port)
            if "found again" in text:
                host.finish()

        host = Host(
            load(path),
            observers=[Keep(after=200, then=_unplug), _watch],
            runtime_dir=str(tmp_path / "run"),
            announce=heard.append,
        )
        with host:
            summary = host.run(60.0)
    text = " ".join(heard)
    assert "lost: device[1] 'finger'" in text
    assert "found again" in text
    assert "LINK_LOST" in summary["faults"]
    assert summary["state"] in ("SHUTDOWN", "FAULT")
