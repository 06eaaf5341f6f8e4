"""Clock of a camera against the clock of this computer."""

from collections import deque

# Pictures over which the offset is estimated: few enough that a drift of 100 ppm stays
# below 1 ms at 30 Hz, enough that one of them arrives without delay.
_WINDOW = 200
# A clock that steps back by more than this was set, s; by less, the picture is a
# repeat. (A clock that steps forward gives a smaller offset, which applies at once.)
_JUMP = 1.0


class CameraClock:
    """Maps times of a camera's clock to this computer's monotonic clock.

    Transfer and scheduling delay a picture and never advance it. So the minimum
    difference of arrival and camera time over the last pictures is the offset of the
    clocks plus the minimum latency, which is a constant of camera and computer.

    Source: Ridoux and Veitch, "Principles of robust timing over the Internet", 2010
    (minimum filtering of delays).
    """

    def __init__(self, latency: float) -> None:
        """Creates a clock without pictures.

        Args:
            latency: Minimum time from exposure to arrival, s.
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
            The time, s; after all earlier ones and not after `arrival`. None for a
            picture that is not newer than the last one, such as a repeat.
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
