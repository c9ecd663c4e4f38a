"""rtctl's contract of a backend, on this one: `pytest` here, with rtctl and this package installed."""

from rtctl_udp_board.simulator import Board

from rtctl.backend_contract import Case, Contract, Device, Received

pytest_plugins = ("rtctl.backend_contract.plugin",)
boards = []


def options(folder, which):
    """Start a board; the options that lead to it."""
    del folder, which
    boards.append(Board())
    host, port = boards[-1].socket.getsockname()
    return {"host": host, "port": port, "lost_after_s": 1.0}


class Played(Device):
    """The board of these options, in step with the test."""

    def __init__(self, backend, options, n_axes):
        super().__init__(backend, options, n_axes)
        self.board = next(one for one in boards if one.socket.getsockname()[1] == options["port"])
        self.shows = False

    def step(self):
        self.board.listen(0.0)
        self.board.send() if self.shows else self.board.step()

    def show(self, channel, values):
        self.shows = True
        if channel == "force":
            self.board.force_n = tuple(values)
        else:
            setattr(self.board, {"position": "angle_rad", "current": "current_a"}[channel], values[0])
        return True

    def received(self):
        return Received([self.board.torque_nm], self.board.enabled)

    def close(self):
        boards.remove(self.board)
        self.board.close()


class TestUdpBoard(Contract):
    cases = {"one axis": Case("udp-board", options, Played)}
