"""The arm and the world around it for `painter drives --scenario`."""

from pathlib import Path

import numpy as np

from painter.canopen.sim.rack import STEP
from painter.canopen.sim.server import RackServer
from painter.config import Scenario
from painter.cycle.write_run import write_collisions, write_truth
from painter.errors import InputError, PainterError
from painter.rehearsal.arm_load import ArmLoad
from painter.rehearsal.world_process import PERIOD, WorldProcess
from painter.run.figures.time_figures import STARTED, named
from painter.run.folder.folder import SEGMENTATION, RunFolder
from painter.run.page.report import write_report

_STEPS = round(PERIOD / STEP)


class HilBench:
    """Arm, world and camera of simulated drives.

    Attributes:
        load: The arm on the motors.
    """

    def __init__(self, job: Scenario, *, camera: str) -> None:
        """Makes arm and world.

        Args:
            job: Robot and scene.
            camera: Path of the socket that serves the pictures.

        Raises:
            PainterError: The world cannot be made.
        """
        self._job = job
        self.load = ArmLoad(job)
        self._world = WorldProcess(job, camera=camera)
        self._count = 0

    def attach(self, server: RackServer) -> None:
        """Makes the world follow the drives of a server from now on."""
        config, io = server.rack.bus.io, server.rack.io

        def step() -> None:
            self._count += 1
            if self._count % _STEPS:
                return
            is_open = io.outputs >> config.valve_bit & 1
            trigger = io.flow / config.flow_full_scale if is_open else 0.0
            self._world.put(server.clock_time(), self.load.state, trigger)

        server.rack.stepped = step

    def finish(self, run: Path | None) -> None:
        """Ends the world and adds its truth to a run.

        Args:
            run: Folder of a finished run of `painter deploy`, or None.

        Raises:
            InputError: There is no such run, or it has no segmentation.
            PainterError: The world ended early, or its film has gaps.
        """
        try:
            truth = self._world.finish()
        finally:
            self._world.close()
        if run is None:
            return
        folder = RunFolder.open(run)
        segmentation = folder.segmentation()
        if segmentation is None:
            raise InputError(
                f"{run / SEGMENTATION}: no such file; truth was not added.",
                code="PNT-REHEARSAL-001",
            )
        if truth.lost:
            raise PainterError(
                f"the world missed {truth.lost} samples of the arm; no film was added.",
                code="PNT-REHEARSAL-002",
            )
        write_truth(folder, self._job, segmentation, truth.film)
        started = named(folder.events(), STARTED)
        began = float(started[0].get("bus_time_s", np.inf)) if started else np.inf
        during = truth.stamps >= began
        write_collisions(
            folder,
            self._job,
            truth.stamps[during] - began,
            truth.clearance[during],
            truth.floor_clearance[during],
        )
        write_report(folder)
