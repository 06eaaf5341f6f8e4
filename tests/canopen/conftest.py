"""A master and simulated drives on one wire, in simulated time: nothing waits.

With PAINTER_CAN=vcan0 every port of a wire is a socket on that interface, and each
frame goes through the kernel (`make test-socketcan`).
"""

import os
from collections.abc import Callable

import numpy as np
import pytest

from painter.canopen.config.bus_config import BusConfig
from painter.canopen.config.bus_file import load_bus
from painter.canopen.master.arm_bus import ArmBus
from painter.canopen.master.feedback import BusState
from painter.canopen.master.setpoints import Setpoint
from painter.canopen.sim.rack import Rack
from painter.canopen.sim.wire import Wire
from painter.canopen.wire.transports import PythonCanTransport
from painter.resources import models_path

CHANNEL = os.environ.get("PAINTER_CAN")
_DELIVERY_TIME = 5.0  # s; far longer than any kernel takes.


@pytest.fixture(autouse=True)
def on_the_interface(monkeypatch):
    """Puts sockets of the interface between the ports of each wire, if there is one."""
    if CHANNEL is None:
        yield
        return
    opened: list[PythonCanTransport] = []
    attach = Wire.attach

    def attach_socket(wire, receiver):
        opened.append(PythonCanTransport("socketcan", CHANNEL, 1_000_000))
        vars(wire).setdefault("sockets", []).append(opened[-1])
        return attach(wire, receiver)

    def deliver(wire, frame, sender, end):
        sockets = wire.sockets
        sockets[sender].send(frame)
        for port, receive in enumerate(wire.receivers):
            if port != sender:
                found = sockets[port].receive(_DELIVERY_TIME)
                assert found == [frame]
                receive(found[0], end)

    monkeypatch.setattr(Wire, "attach", attach_socket)
    monkeypatch.setattr(Wire, "deliver", deliver)
    yield
    for transport in opened:
        transport.close()


class Lab:
    """Steps rack and master; setpoints are pushed 40 ms ahead while `path` is set."""

    def __init__(self, bus: BusConfig | None = None) -> None:
        self.bus = bus or load_bus(models_path("bus", "painter.bus.yaml"))
        self.rack = Rack(self.bus)
        self.master = ArmBus(self.bus, self.rack.transport)
        self.cycles = 0
        self.path: Callable[[float], tuple[np.ndarray, np.ndarray]] | None = None
        self.trigger = 0.0

    @property
    def now(self) -> float:
        return self.cycles * self.bus.cycle

    def step(self) -> None:
        self.rack.advance(self.now)
        if self.path is not None:
            t = self.now + 0.04
            q, v = self.path(t)
            self.master.push([Setpoint(t, q, v, self.trigger)])
        self.master.cycle(self.now)
        for i in range(1, 5):
            self.rack.advance(self.now + i * 1e-3)
            self.master.poll(self.now + i * 1e-3)
        self.cycles += 1

    def run(self, seconds: float) -> None:
        for _ in range(round(seconds / self.bus.cycle)):
            self.step()

    def until(self, condition: Callable[[], bool], seconds: float = 20.0) -> None:
        for _ in range(round(seconds / self.bus.cycle)):
            if condition():
                return
            self.step()
        raise AssertionError(f"not in {seconds} s: {self.master.feedback()}")

    def bring_up(self) -> "Lab":
        self.master.start()
        self.until(lambda: self.master.state != BusState.STARTING)
        assert self.master.state == BusState.ENABLED, self.master.reason
        return self

    def sway(self, amplitude: float = 0.2, period: float = 2.0) -> "Lab":
        """All joints swing as 1 - cos, from where they are."""
        start, q0, w = self.now, self.master.feedback().q_commanded, 2 * np.pi / period

        def path(t):
            s = w * max(t - start - 0.04, 0.0)
            q = q0 + amplitude * (1 - np.cos(s))
            return q, np.full(5, amplitude * w * np.sin(s))

        self.path = path
        return self


@pytest.fixture
def make_lab() -> type[Lab]:
    return Lab


@pytest.fixture
def lab() -> Lab:
    """All drives enabled, at rest."""
    return Lab().bring_up()


@pytest.fixture
def painting() -> Lab:
    """Moving and spraying, every joint at 0.63 rad/s at most."""
    lab = Lab().bring_up().sway()
    lab.trigger = 0.8
    lab.run(0.5)
    assert lab.rack.io.outputs == 1
    return lab
