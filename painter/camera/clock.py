"""A camera's clock and this computer's: what the one shows when the other does."""

from collections import deque

# Pictures over which the offset is estimated: short enough that clocks that drift by
# 100 ppm part by less than 1 ms over it at 30 Hz, long enough to hold one that was not
# held up on its way.
_WINDOW = 200
# A clock that goes back by more than this has been set anew, s; by less, a picture is
# repeated. (One that goes ahead gives a lesser offset, which counts at once.)
_JUMP = 1.0


class CameraClock:
    """Maps times of a camera's clock to this computer's monotonic clock.

    A picture arrives late by what transfer and scheduling take, never early. So the
    least difference of arrival and camera time over the last pictures is the offset of
    the clocks plus the least latency, which is a constant of camera and computer.

    Source: Ridoux and Veitch, "Principles of robust timing over the Internet", 2010
    (minimum filtering of delays).
    """

    def __init__(self, latency: float) -> None:
        """Creates a clock that knows nothing yet.

        Args:
            latency: Least time from exposure to arrival, s.
        """
        self._latency = latency
        self._offsets: deque[float] = deque(maxlen=_WINDOW)
        self._last_camera: float | None = None
        self._last = -float("inf")

    def map(self, camera_time: float, arrival: float) -> float | None:
        """Returns when a picture was taken, by this computer's clock.

        Args:
            camera_time: By the camera's clock, s.
            arrival: When it arrived, by this computer's, s.

        Returns:
            The time, s; later than all before it and not after `arrival`. None for a
            picture that is not newer than the one before, such as a repeated one.
        """
        if self._last_camera is not None and camera_time <= self._last_camera:
            if camera_time > self._last_camera - _JUMP:
                return None
            self._offsets.clear()
        self._last_camera = camera_time
        self._offsets.append(arrival - camera_time)
        time = camera_time + min(self._offsets) - self._latency
        if time <= self._last:
            return None
        self._last = time
        return time
