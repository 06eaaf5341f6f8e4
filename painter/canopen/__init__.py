"""The robot's bus: CiA 301/402/401 master, units and simulated drives; no Drake.

Who owns what, bottom to top:

- `protocol`: frames, data types, state machine, SDO client; knows no file and no drive.
- `config`: the bus file, EDS files, units; what is on the bus and what is allowed.
- `wire`: ways to a bus (python-can, local socket) and logs of it.
- `master`: `ArmBus`, one object that owns the bus; no thread and no clock of its own.
- `process`: the bus in a process of its own, with its real-time loop and mailboxes.
- `analysis`: logs in words and figures; a log in the place of the bus.
- `sim`: simulated nodes, in lock step or as a process.

Two processes: the diagram's and the bus's. What crosses between them is time-stamped
setpoints one way, feedback and samples the other, through shared memory; the diagram
never blocks the bus.
"""
