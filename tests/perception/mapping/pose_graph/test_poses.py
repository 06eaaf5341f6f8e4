import numpy as np
from pydrake.math import RigidTransform, RollPitchYaw

from perception.mapping.pose_graph.poses import Poses, skew

X_1 = RigidTransform(RollPitchYaw(0.3, -0.2, 0.5), [1.0, 2.0, -0.5])
X_2 = RigidTransform(RollPitchYaw(-0.1, 0.4, 0.2), [-0.3, 0.1, 0.8])


def test_products_and_inverses_are_those_of_rigid_transforms():
    product = (Poses.of([X_1, X_2]) @ Poses.of([X_2, X_1])).list()
    assert product[0].IsNearlyEqualTo(X_1 @ X_2, 1e-12)
    assert product[1].IsNearlyEqualTo(X_2 @ X_1, 1e-12)
    assert Poses.of([X_1]).inverse().list()[0].IsNearlyEqualTo(X_1.inverse(), 1e-12)


def test_a_step_leads_back_to_where_it_came_from():
    first, second = Poses.of([X_1, X_2]), Poses.of([X_2, X_1])
    reached = first.moved(first.steps_to(second))
    np.testing.assert_allclose(reached.R, second.R, atol=1e-12)
    np.testing.assert_allclose(reached.p, second.p, atol=1e-12)


def test_skew_is_the_cross_product():
    a, b = np.array([[1.0, 2.0, 3.0]]), np.array([-1.0, 0.5, 2.0])
    np.testing.assert_allclose((skew(a) @ b)[0], np.cross(a[0], b))
