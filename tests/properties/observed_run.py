"""A run that others watch: the same rig with and without observers, on any wall clock."""

import threading

import numpy as np
import zmq

from hw import registry
from rtctl.check import law_plan as plan
from rtctl.host.exchange.rig_description import describe
from rtctl.host.exchange.streams import Telemetry
from rtctl.rig_file import config
from rtctl.rt.clock import VirtualClock
from rtctl.rt.loop import Stop, run_loop, warm_up
from rtctl.rt.shared_memory import CommandWriter, Memory, RingReader
from rtctl.simulation.shipped_files import shipped_config
from rtctl.wire.endpoints import RuntimeDirectory


class Scripted(VirtualClock):
    """Gives the commands of a run at fixed ticks."""

    def __init__(self, header, writer):
        super().__init__(header)
        self.writer, self.wakeups = writer, 0

    def sleep_until(self, deadline_ns):
        command = self.writer.command
        changes = {
            900: ("arm_count", 1),
            1600: ("environment_center_rad", 0.05),
            2600: ("stop_count", 1),
            2800: ("shutdown_count", 1),
        }
        if self.wakeups in changes:
            name, value = changes[self.wakeups]
            command[name] = value
            self.writer.send()
        self.wakeups += 1
        return super().sleep_until(deadline_ns)


def observed_run(folder, subscribers, batch_rows):
    """A run of the real loop on a virtual clock, telemetry beside it; its ticks without the host's times."""
    loaded = config.load(shipped_config("mock.toml"))
    made = plan.build(loaded)
    memory = Memory.create(1, made.ring_rows, made.period_ns)
    memory.params[:], memory.model[:] = made.params, made.model
    writer, reader = CommandWriter(memory), RingReader(memory, from_start=True)
    writer.command[:] = made.command
    writer.send()
    backend = registry.create("mock", loaded.options, loaded.config.hardware())
    backend.open()
    warm_up(memory, backend)
    clock = Scripted(memory.header, writer)
    loop = threading.Thread(target=run_loop, args=(backend, memory, clock, Stop()))
    with RuntimeDirectory.acquire("mock", folder) as runtime, zmq.Context() as context:
        telemetry = Telemetry(context, runtime.endpoints, describe(loaded))
        sockets = [context.socket(zmq.SUB) for _ in range(subscribers)]
        for socket in sockets:
            socket.setsockopt(zmq.RCVHWM, 1)
            socket.setsockopt(zmq.LINGER, 0)
            socket.subscribe(b"")
            socket.connect(runtime.endpoints.telemetry)
        rows = []
        loop.start()
        while loop.is_alive() or memory.header[0]["head"] > reader.next:
            rows.append(reader.read(batch_rows))
            telemetry.publish(rows[-1], reader.overwritten)
            for socket in sockets[1:]:  # the first one never reads
                while socket.poll(0):
                    socket.recv_multipart()
        loop.join()
        for socket in sockets:
            socket.close()
        telemetry.close()
    memory.close()
    ticks = np.concatenate(rows)
    names = [name for name in ticks.dtype.names if not name.endswith("_ns") and name != "seal"]
    return ticks["state"], b"".join(np.ascontiguousarray(ticks[name]).tobytes() for name in names)
