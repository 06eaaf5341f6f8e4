"""The drives' position loops on the arm's plant, one for all simulated bodies."""

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.systems.controllers import InverseDynamicsController
from pydrake.systems.framework import DiagramBuilder, InputPort, OutputPort
from pydrake.systems.primitives import (
    Demultiplexer,
    DiscreteDerivative,
    PassThrough,
    SharedPointerSystem,
)

from painter.config import Scenario
from painter.planning.arm.kinematics import NQ
from painter.robot.arm_model import MakeArmPlant

# Time over which drives differentiate the velocity setpoint for feed-forward, s.
FEED_FORWARD_PERIOD = 0.004


def AddJointLoop(
    builder: DiagramBuilder,
    plant: MultibodyPlant,
    scenario: Scenario,
    estimated: OutputPort,
) -> InputPort:
    """Adds PID with inverse-dynamics feed-forward, and connects it to the arm.

    Args:
        builder: Holds `plant`.
        plant: With the model instance "arm".
        scenario: Gives the gains.
        estimated: (10,) measured q, v of the arm; rad, rad/s.

    Returns:
        The input for the desired state, (10,) q, v; rad, rad/s.
    """
    arm = plant.GetModelInstanceByName("arm")
    model = builder.AddNamedSystem(
        "controller_plant", SharedPointerSystem(MakeArmPlant(scenario.directives))
    ).get()
    gains = scenario.arm.gains
    controller = builder.AddNamedSystem(
        "joint_pid",
        InverseDynamicsController(
            robot=model,
            kp=np.full(NQ, gains.kp),
            ki=np.full(NQ, gains.ki),
            kd=np.full(NQ, gains.kd),
            has_reference_acceleration=True,
        ),
    )
    desired = builder.AddNamedSystem("desired_state", PassThrough(2 * NQ))
    split = builder.AddNamedSystem("desired_split", Demultiplexer(2 * NQ, NQ))
    acceleration = builder.AddNamedSystem(
        "feed_forward", DiscreteDerivative(NQ, FEED_FORWARD_PERIOD)
    )
    builder.Connect(estimated, controller.get_input_port_estimated_state())
    builder.Connect(
        desired.get_output_port(), controller.get_input_port_desired_state()
    )
    builder.Connect(desired.get_output_port(), split.get_input_port())
    builder.Connect(split.get_output_port(1), acceleration.get_input_port())
    builder.Connect(
        acceleration.get_output_port(),
        controller.get_input_port_desired_acceleration(),
    )
    builder.Connect(
        controller.get_output_port_control(), plant.get_actuation_input_port(arm)
    )
    return desired.get_input_port()
