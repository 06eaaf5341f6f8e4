"""The simulated world beside simulated drives, in a process of its own.

Drives must never wait for rendering: they put the arm's true state into shared memory,
and camera, film and clearances follow in this process as fast as they can.
"""

import contextlib
import multiprocessing
import signal
import tempfile
import time
from dataclasses import dataclass
from multiprocessing.connection import Connection

import numpy as np

from painter.camera.frame_socket import FrameServer
from painter.canopen.process.realtime import set_niceness
from painter.canopen.process.sample_ring import SampleRing
from painter.config import Scenario, dump_scenario, load_scenario
from painter.errors import PainterError
from painter.planning.arm.kinematics import NQ
from painter.rehearsal.sim_world import SimWorld
from painter.systems.simulated.paint_film import FilmState
from perception.ground import FloatArray

# Time between samples of the arm's true state, s.
PERIOD = 0.01
# Depth pictures per colour picture, which only the report shows.
_COLOR_EVERY = 5
# Period of black pictures while the lens is covered because the gun sprays, s.
_BLACK_PERIOD = 0.25
_PATIENCE = 120.0
_NICENESS = -15


@dataclass(frozen=True, eq=False)
class WorldTruth:
    """Truth of the world at the end of a cycle.

    Attributes:
        film: On the wall.
        stamps: (k,) s by the run's clock, of the clearances.
        clearance: (k,) m, from the scene.
        floor_clearance: (k,) m, from the floor and the robot's own frame.
        lost: Samples overwritten before they were read; the film lacks them.
    """

    film: FilmState
    stamps: FloatArray
    clearance: FloatArray
    floor_clearance: FloatArray
    lost: int


class WorldProcess:
    """The world process, as the drives use it."""

    def __init__(self, scenario: Scenario, *, camera: str) -> None:
        """Starts the process and waits until the world is ready.

        Args:
            scenario: Robot, scene, camera and gun.
            camera: Path of the socket that serves the pictures.

        Raises:
            PainterError: The world cannot be made; says why.
        """
        self._ring = SampleRing()
        context = multiprocessing.get_context("spawn")
        self._pipe, theirs = context.Pipe()
        self._process = context.Process(
            target=_run,
            args=(dump_scenario(scenario), self._ring.name, camera, theirs),
            name="painter world",
        )
        self._process.start()
        theirs.close()
        self._receive()

    def put(self, when: float, state: FloatArray, trigger: float) -> None:
        """Adds a sample of the arm; to be called every `PERIOD`.

        Args:
            when: By the run's clock, s.
            state: (10,) true q, v; rad, rad/s.
            trigger: Opening of the gun's valve, 0 to 1.
        """
        self._ring.put(when, state[:NQ], state[NQ:], trigger)

    def finish(self) -> WorldTruth:
        """Waits until all samples are processed, and ends the process.

        Raises:
            PainterError: The world ended early; says why.
        """
        self._pipe.send("end")
        truth = self._receive()
        assert isinstance(truth, WorldTruth)
        return truth

    def close(self) -> None:
        """Ends the process, by force if need be."""
        self._pipe.close()
        self._process.join(5.0)
        if self._process.is_alive():
            self._process.kill()
            self._process.join()
        self._ring.close()

    def _receive(self) -> object:
        try:
            if not self._pipe.poll(_PATIENCE):
                raise PainterError(
                    f"the simulated world has not answered for {_PATIENCE:g} s.",
                    code="PNT-REHEARSAL-003",
                )
            answer = self._pipe.recv()
        except (EOFError, OSError):
            raise PainterError(
                "the simulated world has ended.", code="PNT-REHEARSAL-004"
            ) from None
        if isinstance(answer, str) and answer:
            raise PainterError(answer, code="PNT-REHEARSAL-005")
        return answer


class _Follower:
    """Makes a world follow the arm's samples, and serves its pictures."""

    def __init__(self, world: SimWorld, server: FrameServer) -> None:
        self._world = world
        self._server = server
        self._stamps: list[float] = [0.0]
        self._pictures = 0
        self._shape = (0, 0)
        self._black_at = 0.0
        self.lost = 0

    def take(self, when: float, state: FloatArray, trigger: float) -> None:
        """Advances by one sample."""
        self._stamps.append(when)
        now = (len(self._stamps) - 1) * PERIOD
        self._world.advance(now, state, trigger)
        picture = self._world.picture()
        if picture is not None:
            color = None
            if self._pictures % _COLOR_EVERY == 0:
                color = self._world.color()
            self._pictures += 1
            stamp = self._stamps[round(picture.time / PERIOD)]
            self._black_at = now + _BLACK_PERIOD
            if stamp > 0.0:
                self._server.send(picture.depth_mm, color, stamp)
            self._shape = picture.depth_mm.shape
        elif self._pictures and now >= self._black_at:
            self._black_at = now + _BLACK_PERIOD
            self._server.send(np.zeros(self._shape, np.uint16), None, when)

    def truth(self) -> WorldTruth:
        """Returns the present truth."""
        time_w, clearance, floor = self._world.clearances()
        stamps = np.array(self._stamps)[np.rint(time_w / PERIOD).astype(int)]
        return WorldTruth(self._world.film, stamps, clearance, floor, self.lost)


def _read(text: str) -> Scenario:
    """Reads a scenario from its text: Drake's settings in it do not pickle."""
    with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
        file.write(text)
        file.flush()
        return load_scenario(file.name)


def _run(scenario: str, ring_name: str, camera: str, pipe: Connection) -> None:
    """Runs the world's process; the parent handles Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    set_niceness(_NICENESS)  # A real camera waits for no program.
    ring = SampleRing(name=ring_name)
    server = None
    try:
        server = FrameServer(camera)
        follower = _Follower(SimWorld(_read(scenario)), server)
        pipe.send("")
        last, is_ending = 0.0, False
        while True:
            samples = ring.since(last)
            for i, when in enumerate(samples.time):
                state = np.concatenate([samples.q[i], samples.v[i]])
                if last and when - last > 1.5 * PERIOD:
                    follower.lost += round((when - last) / PERIOD) - 1
                follower.take(float(when), state, float(samples.trigger[i]))
                last = float(when)
            if is_ending and not samples.time.size:
                pipe.send(follower.truth())
                return
            is_ending = is_ending or (pipe.poll() and pipe.recv() == "end")
            time.sleep(0.2 * PERIOD)
    except (EOFError, OSError):
        return  # The drives are gone.
    except PainterError as error:
        with contextlib.suppress(OSError):
            pipe.send(str(error))
    finally:
        if server is not None:
            server.close()
        ring.close()
