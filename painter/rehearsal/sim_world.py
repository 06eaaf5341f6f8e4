"""Scene, camera and paint film around an arm that simulated drives move."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from pydrake.geometry import SceneGraph
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.primitives import Demultiplexer, LogVectorOutput, PassThrough
from pydrake.systems.rendering import MultibodyPositionToGeometryPose

from painter.config import Scenario
from painter.diagrams.surroundings import AddScene, AddSurroundings
from painter.planning.arm.kinematics import NQ
from painter.robot.arm_model import AddRobot
from painter.systems.simulated.paint_film import FilmState
from perception.ground import FloatArray

CLEARANCE_PERIOD = 0.05


@dataclass(frozen=True, eq=False)
class WorldPicture:
    """A picture of the simulated camera.

    Attributes:
        depth_mm: (H, W) uint16, mm, 0 = no return.
        time: When it was taken, by the world's clock, s.
    """

    depth_mm: npt.NDArray[np.uint16]
    time: float


class SimWorld:
    """Camera, paint film and clearances of an arm with prescribed motion.

    It is the simulated station without drives and plant: samples of the arm's true
    state take the plant's place.
    """

    def __init__(self, scenario: Scenario, *, film: FilmState | None = None) -> None:
        """Makes the world at time 0, with the arm in its home pose.

        Args:
            scenario: Robot, scene, camera and gun.
            film: Film that is on the wall already; None = none.
        """
        builder = DiagramBuilder()
        scene_graph = builder.AddNamedSystem("scene_graph", SceneGraph())
        plant = MultibodyPlant(0.0)
        plant.RegisterAsSourceForSceneGraph(scene_graph)
        AddRobot(Parser(plant), scenario.directives)
        AddScene(plant, scenario)
        plant.Finalize()
        state = builder.AddNamedSystem("state", PassThrough(2 * NQ))
        split = builder.AddNamedSystem("state_split", Demultiplexer(2 * NQ, NQ))
        pose = builder.AddNamedSystem(
            "geometry_pose", MultibodyPositionToGeometryPose(plant)
        )
        builder.Connect(state.get_output_port(), split.get_input_port())
        builder.Connect(split.get_output_port(0), pose.get_input_port())
        builder.Connect(
            pose.get_output_port(),
            scene_graph.get_source_pose_port(plant.get_source_id()),
        )
        builder.ExportInput(state.get_input_port(), "state")
        AddSurroundings(
            builder,
            plant,
            scene_graph,
            scenario,
            state=state.get_output_port(),
            film=film,
        )
        self._world = builder.Build()
        outer = DiagramBuilder()
        outer.AddNamedSystem("world", self._world)
        self._logs = {
            name: LogVectorOutput(
                self._world.GetOutputPort(f"cheat.{name}"), outer, CLEARANCE_PERIOD
            )
            for name in ("clearance", "floor_clearance")
        }
        for name in ("state", "gun.trigger"):
            outer.ExportInput(self._world.GetInputPort(name), name)
        self._plant = plant  # Kept alive: `geometry_pose` computes with it.
        self._root = outer.Build()
        self._simulator = Simulator(self._root)
        self._context = self._simulator.get_mutable_context()
        home = np.deg2rad(scenario.motion.home_deg)
        self._set(np.concatenate([home, np.zeros(NQ)]), 0.0)
        self._simulator.Initialize()
        self._picture_time = -1.0

    @property
    def time(self) -> float:
        """Present time of the world, s."""
        return float(self._context.get_time())

    @property
    def film(self) -> FilmState:
        """The film on the wall."""
        film: FilmState = self._evaluate("cheat.film")
        return film

    def advance(self, time: float, state: FloatArray, trigger: float) -> None:
        """Advances to a time at which the arm has a given state.

        Args:
            time: Later than before, s.
            state: (10,) true q, v; rad, rad/s.
            trigger: Opening of the gun's valve, 0 to 1.
        """
        # Events due at the present time still use its state: set the new one after.
        self._simulator.AdvanceTo(time)
        self._set(state, trigger)

    def picture(self) -> WorldPicture | None:
        """Returns the newest picture, each once, or None."""
        time = float(self._evaluate("wall_camera.image_time")[0])
        if time <= self._picture_time:
            return None
        self._picture_time = time
        depth = self._evaluate("wall_camera.depth_image").data[:, :, 0].copy()
        return WorldPicture(depth, time)

    def color(self) -> npt.NDArray[np.uint8]:
        """Returns the present colour picture, (H, W, 3) RGB."""
        return self._evaluate("wall_camera.color_image").data[:, :, :3].copy()

    def clearances(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Returns (k,) times, s, and distances from the scene and from the floor, m."""
        logs = {name: sink.FindLog(self._context) for name, sink in self._logs.items()}
        return (
            logs["clearance"].sample_times().copy(),
            logs["clearance"].data()[0].copy(),
            logs["floor_clearance"].data()[0].copy(),
        )

    def _set(self, state: FloatArray, trigger: float) -> None:
        self._root.GetInputPort("state").FixValue(self._context, state)
        self._root.GetInputPort("gun.trigger").FixValue(self._context, [trigger])

    def _evaluate(self, port: str):  # type: ignore[no-untyped-def]
        own = self._world.GetMyContextFromRoot(self._context)
        return self._world.GetOutputPort(port).Eval(own)
