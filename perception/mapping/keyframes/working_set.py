"""The keyframes in memory; the others are in a file."""

import sqlite3
import weakref
from collections import OrderedDict
from dataclasses import dataclass

from perception.ground import FrozenValue
from perception.mapping.keyframes.keyframe import Keyframe
from perception.mapping.keyframes.view import View


class WorkingSet:
    """Keeps the most recently used views in memory, up to a limit.

    Every view is written to a temporary SQLite file when it is added, and read back
    when it is used after it left memory. The file has no name and ends with the
    process; it can be made again from the raw pictures in a `MapStore`.
    """

    def __init__(self, size: int) -> None:
        """Starts an empty set.

        Args:
            size: Largest number of views in memory.

        Raises:
            ValueError: `size` is not positive.
        """
        if size < 1:
            raise ValueError(f"mapping.working_set must be >= 1, got {size!r}.")
        self._size = size
        self._views: OrderedDict[int, View] = OrderedDict()
        # An empty name is a temporary file; SQLite caches 2 MB of it in memory.
        self._db = sqlite3.connect("", isolation_level=None)
        weakref.finalize(self, self._db.close)
        self._db.execute("CREATE TABLE views (k INTEGER PRIMARY KEY, data BLOB)")

    @property
    def members(self) -> list[int]:
        """Numbers of the keyframes whose views are in memory, ascending."""
        return sorted(self._views)

    def take(self, k: int, keyframe: Keyframe) -> Keyframe:
        """Adds a keyframe's view.

        Args:
            k: Its number, a new one.
            keyframe: With its view in memory.

        Returns:
            The keyframe, its view in memory or in the file.
        """
        view = keyframe.source.view()
        self._db.execute("INSERT INTO views VALUES (?, ?)", (k, view.packed()))
        self._keep(k, view)
        return keyframe.replace(source=_Paged(k, self))

    def view(self, k: int) -> View:
        """Returns a keyframe's view and makes it the most recently used."""
        view = self._views.get(k)
        if view is None:
            row = self._db.execute("SELECT data FROM views WHERE k = ?", (k,))
            view = View.unpacked(row.fetchone()[0])
        self._keep(k, view)
        return view

    def _keep(self, k: int, view: View) -> None:
        self._views[k] = view
        self._views.move_to_end(k)
        if len(self._views) > self._size:
            self._views.popitem(last=False)


@dataclass(frozen=True, eq=False)
class _Paged(FrozenValue):
    """The view of keyframe `k`, in memory or in the file."""

    k: int
    working_set: WorkingSet

    def view(self) -> View:
        return self.working_set.view(self.k)
