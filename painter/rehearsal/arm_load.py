"""The arm's plant as the load of simulated drives."""

import numpy as np
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.analysis import Simulator
from pydrake.systems.framework import DiagramBuilder

from painter.canopen.config.units import axes_from_joints, joints_from_axes
from painter.config import Scenario
from painter.diagrams.joint_loop import AddJointLoop
from painter.planning.arm.kinematics import NQ
from painter.robot.arm_model import AddRobot
from perception.ground import FloatArray


class ArmLoad:
    """The arm on the motors, with the position loops that the drives close on it.

    Plant and loops are the simulated station's: any difference between a simulated
    cycle and one over the bus comes from the bus. It is a `painter.canopen.sim` load:
    axes are the motors' after the gears, the wrist's differential included.
    """

    def __init__(self, scenario: Scenario) -> None:
        """Makes the arm, at rest in its home pose.

        Args:
            scenario: Gives robot, gains and home pose.
        """
        builder = DiagramBuilder()
        plant = builder.AddNamedSystem(
            "plant", MultibodyPlant(scenario.plant_config.time_step)
        )
        AddRobot(Parser(plant), scenario.directives)
        plant.Finalize()
        arm = plant.GetModelInstanceByName("arm")
        home = np.deg2rad(scenario.motion.home_deg)
        plant.SetDefaultPositions(arm, home)
        state_port = plant.get_state_output_port(arm)
        desired = AddJointLoop(builder, plant, scenario, state_port)
        builder.ExportInput(desired, "desired_state")
        builder.ExportOutput(state_port, "state")
        diagram = builder.Build()
        self._simulator = Simulator(diagram)
        self._context = self._simulator.get_mutable_context()
        self._state_port = diagram.GetOutputPort("state")
        self._target = np.concatenate([home, np.zeros(NQ)])
        self._desired = diagram.GetInputPort("desired_state").FixValue(
            self._context, self._target
        )
        self._simulator.Initialize()
        self._steps = 0

    @property
    def state(self) -> FloatArray:
        """True q and v of the joints, (10,); rad, rad/s."""
        return np.array(self._state_port.Eval(self._context))

    def axes(self) -> tuple[FloatArray, FloatArray]:
        """See `painter.canopen.sim.load.Load`."""
        state = self.state
        return axes_from_joints(state[:NQ]), axes_from_joints(state[NQ:])

    def step(self, demand: FloatArray, velocity: FloatArray, dt: float) -> None:
        """See `painter.canopen.sim.load.Load`."""
        # The demand is for the step's end, but the loop closes at its beginning: it
        # compares the state there with the demand of the last step.
        self._desired.GetMutableData().get_mutable_value().SetFromVector(self._target)
        self._target = np.concatenate(
            [joints_from_axes(demand), joints_from_axes(velocity)]
        )
        self._steps += 1
        # Not a sum of dt: the plant steps at whole multiples of its period.
        self._simulator.AdvanceTo(self._steps * dt)
