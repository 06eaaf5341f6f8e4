"""Clearance of the robot from its surroundings; simulation only."""

from pydrake.common.value import Value
from pydrake.geometry import GeometryId, QueryObject, SignedDistancePair
from pydrake.systems.framework import BasicVector, Context, LeafSystem


class ClearanceMonitor(LeafSystem):
    """Measures the least distance between the robot and its surroundings.

    .. pydrake_system::

        name: ClearanceMonitor
        input_ports:
        - query_object
        output_ports:
        - clearance

    Ports:
        query_object: QueryObject of the scene graph.
        clearance: (1,) m, from the robot to the surroundings; negative = penetration,
            also of the robot into itself; `horizon` = nothing is nearer.
    """

    def __init__(
        self,
        *,
        robot: frozenset[GeometryId],
        surroundings: frozenset[GeometryId],
        horizon: float = 0.3,
    ) -> None:
        """Creates the monitor.

        Args:
            robot: Collision geometries of the robot's moving bodies.
            surroundings: Collision geometries from which it keeps clear.
            horizon: Distances beyond this are not computed, m.

        Raises:
            ValueError: There is no geometry or the horizon is not positive.
        """
        super().__init__()
        if not robot or not surroundings:
            raise ValueError("robot and surroundings must each name a geometry.")
        if not horizon > 0.0:
            raise ValueError(f"horizon must be > 0 m, got {horizon!r}.")
        self._robot = robot
        self._surroundings = surroundings
        self._horizon = horizon
        # Inputs.
        self._query_port = self.DeclareAbstractInputPort(
            "query_object", Value(QueryObject())
        )
        # Outputs.
        self.DeclareVectorOutputPort("clearance", 1, self._CalcClearance)

    def _CalcClearance(self, context: Context, output: BasicVector) -> None:
        query = self._query_port.Eval(context)
        pairs = query.ComputeSignedDistancePairwiseClosestPoints(self._horizon)
        near = (pair.distance for pair in pairs if self._IsRelevant(pair))
        output.SetAtIndex(0, min(near, default=self._horizon))

    def _IsRelevant(self, pair: SignedDistancePair) -> bool:
        ids = {pair.id_A, pair.id_B}
        if ids <= self._robot:
            # The robot's own parts are close by design, but must not touch.
            return pair.distance < 0.0
        return bool(ids & self._robot) and bool(ids & self._surroundings)
