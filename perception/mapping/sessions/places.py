"""Localises a session in a map by appearance, and joins the two."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from pydrake.math import RigidTransform
from scipy import sparse

from perception.errors import PerceptionError
from perception.mapping.keyframes.keyframe import Keyframe
from perception.mapping.keyframes.view import Features
from perception.mapping.pose_graph.constraints import constraint_by_appearance
from perception.mapping.pose_graph.keyframe_graph import KeyframeGraph
from perception.mapping.pose_graph.poses import angle_deg

_TABLES = 12
_BITS = 11
"""Each table makes one word of this many of a descriptor's 256 bits: two descriptors
that differ in a twentieth of their bits still share half of their words."""
_SEED = 5
_CANDIDATES = 3
"""Likeliest keyframes of the map that are matched to a new one."""
_NEAR = 0.02
"""Two keyframes agree if they place the camera within this, m, and `_NEAR_DEG`."""
_NEAR_DEG = 1.0
_AGREEING = 3
"""Fewest keyframes that must agree."""
_SHARE = 0.6
"""Least share of the recognised keyframes that must agree."""


class NotLocalisedError(PerceptionError):
    """A session cannot be localised in a map; the message gives the reason."""


@dataclass(frozen=True)
class Localisation:
    """Pose of a session in a map.

    Attributes:
        X_MW: Pose of the session's world W in the map's, M.
        agreeing: Keyframes that agree on it.
        found: Keyframes that were recognised.
    """

    X_MW: RigidTransform
    agreeing: int
    found: int


class Places:
    """Keyframes as bags of words, weighted by inverse document frequency.

    Words are bits of the descriptors: a vocabulary by locality-sensitive hashing, which
    needs no training.

    Source: Sivic and Zisserman, "Video Google", 2003 (tf-idf); Indyk and Motwani,
    "Approximate nearest neighbors", 1998 (bit sampling).
    """

    def __init__(self, keyframes: Sequence[Keyframe]) -> None:
        """Counts the words of the keyframes to be recognised."""
        rng = np.random.default_rng(_SEED)
        self._bits = np.stack([rng.permutation(256)[:_BITS] for _ in range(_TABLES)])
        counts = sparse.vstack(
            [self._count(keyframe.features) for keyframe in keyframes], format="csr"
        )
        seen = np.asarray((counts > 0).sum(axis=0)).ravel()
        self._rarity = np.log((1.0 + len(keyframes)) / (1.0 + seen))
        self._bags = self._weighted(counts)

    def likely(self, features: Features, count: int) -> list[int]:
        """Returns the numbers of the most similar keyframes, best first."""
        bag = self._weighted(self._count(features))
        scores = (self._bags @ bag.T).toarray().ravel()
        best = np.argsort(-scores, kind="stable")[:count]
        return [int(k) for k in best if scores[k] > 0.0]

    def _count(self, features: Features) -> sparse.csr_matrix:
        bits = np.unpackbits(features.descriptors, axis=1)
        powers = 1 << np.arange(_BITS)
        words: npt.NDArray[np.int64] = bits[:, self._bits] @ powers
        columns = (words + (np.arange(_TABLES) << _BITS)).ravel()
        counts = np.bincount(columns, minlength=_TABLES << _BITS).astype(float)
        return sparse.csr_matrix(counts)

    def _weighted(self, counts: sparse.csr_matrix) -> sparse.csr_matrix:
        bags = counts.multiply(self._rarity).tocsr()
        length = np.sqrt(bags.multiply(bags).sum(axis=1)).A1
        return sparse.diags(1.0 / np.maximum(length, 1e-12)) @ bags


def localise(known: KeyframeGraph, session: KeyframeGraph) -> Localisation:
    """Finds the pose of a session in a map; the map does not change.

    Each keyframe is matched to the likeliest ones of the map and placed by PnP. The
    answer is accepted only if enough of them agree.

    Args:
        known: The map.
        session: Keyframes with poses in the session's own world.

    Raises:
        NotLocalisedError: Too few keyframes are recognised or they do not agree.
    """
    guesses: list[tuple[RigidTransform, RigidTransform]] = []
    places = Places(known.keyframes)
    for number, keyframe in enumerate(session.keyframes):
        X_WC = session.poses[number]
        for k in places.likely(keyframe.features, _CANDIDATES):
            constraint, _ = constraint_by_appearance(
                known.keyframes[k].features,
                keyframe.features,
                known.intrinsics,
                known.config,
                (k, number),
            )
            if constraint is not None:
                X_MW = known.poses[k] @ constraint.X_ij @ X_WC.inverse()
                guesses.append((X_MW, X_WC))
                break
    support = [sum(_agree(guess, other) for other in guesses) for guess in guesses]
    most = max(support, default=0)
    if most < max(_AGREEING, _SHARE * len(guesses)):
        raise NotLocalisedError(
            f"{len(guesses)} of {len(session.keyframes)} keyframes are recognised in "
            f"the map, and {most} agree; at least {_AGREEING} and {_SHARE:.0%} must. "
            "The session is not joined.",
            code="PNT-MAP-004",
        )
    best = guesses[support.index(most)][0]
    return Localisation(X_MW=best, agreeing=most, found=len(guesses))


def joined(
    known: KeyframeGraph, session: KeyframeGraph, X_MW: RigidTransform
) -> KeyframeGraph:
    """Returns the map with a session's keyframes added and registered.

    Args:
        known: The map.
        session: Keyframes with poses in the session's own world.
        X_MW: Pose of that world in the map's.
    """
    for number, keyframe in enumerate(session.keyframes):
        X_WN = None if keyframe.X_WN is None else X_MW @ keyframe.X_WN
        known = known.extended(
            keyframe.replace(X_WN=X_WN), X_MW @ session.poses[number]
        )
    return known


def _agree(
    guess: tuple[RigidTransform, RigidTransform],
    other: tuple[RigidTransform, RigidTransform],
) -> bool:
    """Tells whether two guesses give the first one's camera the same pose."""
    (X_MW, X_WC), (X_MW2, _) = guess, other
    apart = (X_MW @ X_WC).inverse() @ (X_MW2 @ X_WC)
    return bool(
        np.linalg.norm(apart.translation()) < _NEAR
        and angle_deg(apart.rotation()) < _NEAR_DEG
    )
