"""Finds where a session lies in a map by what its pictures show, and joins them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from pydrake.math import RigidTransform
from scipy import sparse

from perception.errors import PerceptionError
from perception.mapping.keyframes.keyframe import Keyframe
from perception.mapping.keyframes.view import Features
from perception.mapping.pose_graph.keyframe_graph import KeyframeGraph
from perception.mapping.pose_graph.links import constraint_by_appearance
from perception.mapping.pose_graph.poses import angle_deg

_TABLES = 12
_BITS = 11
"""A descriptor is as many words as there are tables, each this many of its 256 bits:
two that differ in a twentieth of their bits still share half of their words."""
_SEED = 5
_CANDIDATES = 3
"""Keyframes of the map that are matched to a new one, the likeliest."""
_NEAR = 0.02
"""Two keyframes agree on where the session lies within this, m, at their place,"""
_NEAR_DEG = 1.0
_AGREEING = 3
"""and so many have to, at least,"""
_SHARE = 0.6
"""and this share of those that found a place at all: else there is no jump."""


class NotLocalisedError(PerceptionError):
    """A session's place in a map cannot be told; the message says why."""


@dataclass(frozen=True)
class Localisation:
    """Where a session lies.

    Attributes:
        X_MN: Pose of the session's world N in the map's, M.
        agreeing: Keyframes that say so.
        found: Keyframes that found any place.
    """

    X_MN: RigidTransform
    agreeing: int
    found: int


class Places:
    """Keyframes as bags of words, weighted by how seldom a word is.

    The words are bits of the descriptors, so that there is nothing to be learned: a
    vocabulary by locality-sensitive hashing.

    Source: Sivic and Zisserman, "Video Google", 2003 (tf-idf); Indyk and Motwani,
    "Approximate nearest neighbors", 1998 (bit sampling).
    """

    def __init__(self, keyframes: Sequence[Keyframe]) -> None:
        """Counts the words of the keyframes that are to be found again."""
        rng = np.random.default_rng(_SEED)
        self._bits = np.stack([rng.permutation(256)[:_BITS] for _ in range(_TABLES)])
        counts = sparse.vstack(
            [self._count(keyframe.features) for keyframe in keyframes], format="csr"
        )
        seen = np.asarray((counts > 0).sum(axis=0)).ravel()
        self._rarity = np.log((1.0 + len(keyframes)) / (1.0 + seen))
        self._bags = self._weighted(counts)

    def likely(self, features: Features, count: int) -> list[int]:
        """Returns the numbers of the keyframes that look most alike, best first."""
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
    """Finds where a session lies in a map, which stays as it is.

    Each keyframe is matched to the likeliest ones of the map and placed by PnP; only
    where enough of them agree is the answer believed.

    Args:
        known: The map.
        session: Keyframes with poses in the session's own world.

    Raises:
        NotLocalisedError: Too few keyframes are recognised or they do not agree.
    """
    guesses: list[tuple[RigidTransform, RigidTransform]] = []
    places = Places(known.keyframes)
    for number, keyframe in enumerate(session.keyframes):
        X_NC = session.poses[number]
        for k in places.likely(keyframe.features, _CANDIDATES):
            link, _ = constraint_by_appearance(
                known.keyframes[k].features,
                keyframe.features,
                known.intrinsics,
                known.config,
                (k, number),
            )
            if link is not None:
                X_MN = known.poses[k] @ link.X_ij @ X_NC.inverse()
                guesses.append((X_MN, X_NC))
                break
    support = [sum(_agree(guess, other) for other in guesses) for guess in guesses]
    most = max(support, default=0)
    if most < max(_AGREEING, _SHARE * len(guesses)):
        raise NotLocalisedError(
            f"the map shows where {len(guesses)} of {len(session.keyframes)} keyframes "
            f"were taken, and {most} of them agree; {_AGREEING} and {_SHARE:.0%} are "
            "needed. The session stays apart.",
            code="PNT-MAP-004",
        )
    best = guesses[support.index(most)][0]
    return Localisation(X_MN=best, agreeing=most, found=len(guesses))


def joined(
    known: KeyframeGraph, session: KeyframeGraph, X_MN: RigidTransform
) -> KeyframeGraph:
    """Returns the map with a session's keyframes in it, linked to both.

    Args:
        known: The map.
        session: Keyframes with poses in the session's own world.
        X_MN: Pose of that world in the map's.
    """
    for number, keyframe in enumerate(session.keyframes):
        X_arm = None if keyframe.X_arm is None else X_MN @ keyframe.X_arm
        known = known.extended(
            keyframe.replace(X_arm=X_arm), X_MN @ session.poses[number]
        )
    return known


def _agree(
    guess: tuple[RigidTransform, RigidTransform],
    other: tuple[RigidTransform, RigidTransform],
) -> bool:
    """Tells whether two guesses put the first one's camera at the same place."""
    (X_MN, X_NC), (X_MN2, _) = guess, other
    apart = (X_MN @ X_NC).inverse() @ (X_MN2 @ X_NC)
    return bool(
        np.linalg.norm(apart.translation()) < _NEAR
        and angle_deg(apart.rotation()) < _NEAR_DEG
    )
