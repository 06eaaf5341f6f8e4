"""Torques of a controlled stop at every instant of a run, beside the drives' limits.

`python -m benchmarks.findings.stop_torque RUN`, with a folder of `painter simulate` or
`painter deploy`. At each instant the bus's stop ramp is begun from the measured joint
speeds; what it takes is worked out with the arm's model and divided by the effort
limits.
"""

import argparse
from pathlib import Path

import numpy as np

from painter.canopen.config.bus_file import load_bus
from painter.canopen.config.units import JOINTS
from painter.canopen.master.setpoints import StopRamp
from painter.config import load_scenario
from painter.resources import models_path
from painter.robot.arm_model import MakeArmPlant
from painter.run.folder.folder import SCENARIO, RunFolder
from perception.ground import FloatArray

EVERY = 10


def main() -> None:
    """Prints the greatest share of each joint, at a stop and in the run itself."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("run", type=Path, help="run folder")
    folder = RunFolder.open(parser.parse_args().run)
    executed = folder.executed()
    assert executed is not None
    limits = load_bus(models_path("bus", "painter.bus.yaml")).joint_limits()
    scenario = load_scenario(str(folder.path / SCENARIO))
    plant = MakeArmPlant(scenario.directives)
    context = plant.CreateDefaultContext()
    effort = np.array(
        [
            plant.get_joint_actuator(index).effort_limit()
            for index in plant.GetJointActuatorIndices()
        ]
    )

    def torque(q: FloatArray, v: FloatArray, a: FloatArray) -> FloatArray:
        plant.SetPositions(context, q)
        plant.SetVelocities(context, v)
        inertial = plant.CalcMassMatrix(context) @ a + plant.CalcBiasTerm(context)
        return np.abs(inertial - plant.CalcGravityGeneralizedForces(context)) / effort

    planned, stopping, longest = np.zeros(5), np.zeros(5), 0.0
    accelerations = np.gradient(executed.v, executed.time, axis=0)
    for q, v, a in zip(
        executed.q[::EVERY], executed.v[::EVERY], accelerations[::EVERY], strict=True
    ):
        planned = np.maximum(planned, torque(q, v, a))
        duration = StopRamp(0.0, q, v, limits).duration
        if duration > 0.0:
            stopping = np.maximum(stopping, torque(q, v, -v / duration))
            longest = max(longest, duration)
    print("share of the effort limit  " + "  ".join(f"{name:>14}" for name in JOINTS))
    for name, share in (("in the run", planned), ("in a stop", stopping)):
        print(f"{name:25}  " + "  ".join(f"{100 * s:12.0f} %" for s in share))
    print(f"longest stop {1e3 * longest:.0f} ms")


if __name__ == "__main__":
    main()
