"""The simulated body: plant, drives, depth camera and paint film."""

import numpy as np
from pydrake.geometry import Meshcat, MeshcatVisualizer
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import AddMultibodyPlant, MultibodyPlant
from pydrake.systems.framework import Diagram, DiagramBuilder

from painter.config import Scenario
from painter.diagrams.joint_loop import AddJointLoop
from painter.diagrams.surroundings import AddScene, AddSurroundings
from painter.robot.arm_model import AddRobot
from painter.systems.simulated.joint_encoder import JointEncoder
from painter.systems.simulated.paint_film import FilmState
from painter.systems.simulated.simulated_drives import SimulatedDrives


def MakeSimStation(
    scenario: Scenario,
    *,
    film: FilmState | None = None,
    meshcat: Meshcat | None = None,
) -> Diagram:
    """Makes the simulated station of a scenario.

    The arm's base is at its nominal pose in W. Errors of its placement move the scene
    instead, which is equivalent for the robot.

    Args:
        scenario: Robot, scene, camera and gun.
        film: Film that is on the wall already; None = none.
        meshcat: Where to show robot and scene, or None.

    Returns:
        A diagram with the ports of `painter.diagrams.station` and these `cheat.*`
        outputs: `state` (10,) true q, v; `X_WG` true gun pose; `film` FilmState;
        `clearance` (1,) m, from the scene, and `floor_clearance` from floor and frame;
        `query_object`.
    """
    builder = DiagramBuilder()
    plant, scene_graph = AddMultibodyPlant(scenario.plant_config, builder)
    AddRobot(Parser(plant), scenario.directives)
    AddScene(plant, scenario)
    plant.Finalize()
    arm = plant.GetModelInstanceByName("arm")
    plant.SetDefaultPositions(arm, np.deg2rad(scenario.motion.home_deg))
    _AddDrives(builder, plant, scenario)
    AddSurroundings(
        builder,
        plant,
        scene_graph,
        scenario,
        state=plant.get_state_output_port(arm),
        film=film,
    )
    builder.ExportOutput(plant.get_state_output_port(arm), "cheat.state")
    if meshcat is not None:
        MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
    diagram = builder.Build()
    diagram.set_name("station")
    return diagram


def _AddDrives(
    builder: DiagramBuilder, plant: MultibodyPlant, scenario: Scenario
) -> None:
    """Adds encoders, the drives' joint loops and their status."""
    arm = plant.GetModelInstanceByName("arm")
    encoder = builder.AddNamedSystem(
        "joint_encoder", JointEncoder(bits=scenario.arm.encoder_bits)
    )
    faults = [(fault.time, fault.joint, fault.code) for fault in scenario.arm.faults]
    drives = builder.AddNamedSystem("drives", SimulatedDrives(faults=faults))
    builder.Connect(plant.get_state_output_port(arm), encoder.GetInputPort("state"))
    estimated = encoder.GetOutputPort("state_estimated")
    builder.Connect(estimated, drives.GetInputPort("state_estimated"))
    desired = AddJointLoop(builder, plant, scenario, estimated)
    builder.ExportInput(desired, "arm.desired_state")
    builder.ConnectInput("arm.desired_state", drives.GetInputPort("desired_state"))
    builder.ExportOutput(estimated, "arm.state_estimated")
    builder.ExportOutput(drives.GetOutputPort("status"), "arm.status")
