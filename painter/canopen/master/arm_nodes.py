"""Clients of all nodes of a bus file, and the joint state they measure."""

from collections.abc import Callable

import numpy as np

from painter.canopen.config.bus_config import BusConfig
from painter.canopen.config.units import AXES, joints_from_axes
from painter.canopen.master.drive_client import DriveClient
from painter.canopen.master.io_client import IoClient
from painter.canopen.master.node_client import NodeClient
from painter.canopen.protocol.frames import Frame
from perception.ground import FloatArray


class ArmNodes:
    """The drives and the I/O node.

    Attributes:
        drives: In the order of `units.AXES`.
        io: The I/O node.
        all: Drives, then the I/O node.
    """

    def __init__(self, bus: BusConfig, send: Callable[[Frame], None]) -> None:
        """Creates the clients; nothing is sent yet.

        Args:
            bus: The bus file.
            send: Sends a frame.

        Raises:
            InputError: The EDS of a drive does not allow its configuration.
        """
        self.drives = [
            DriveClient(axis, bus, limits, send)
            for axis, limits in zip(AXES, bus.drive_limits(), strict=True)
        ]
        self.io = IoClient(bus, send)
        self.all: list[NodeClient] = [*self.drives, self.io]
        self._by_id = {node.node_id: node for node in self.all}

    def find(self, cob_id: int) -> NodeClient | None:
        """Returns the node in a COB-ID of the pre-defined connection set, or None."""
        return self._by_id.get(cob_id & 0x7F)

    def joint_state(self) -> tuple[FloatArray, FloatArray]:
        """Returns measured joint positions, (5,) rad, and speeds, (5,) rad/s."""
        axes = np.array([d.units.angle(d.position) for d in self.drives])
        speeds = np.array([d.units.speed(d.velocity) for d in self.drives])
        return joints_from_axes(axes), joints_from_axes(speeds)
