"""The robot's bus: CiA 301/402/401 master, units and simulated drives; no Drake.

Who owns what, bottom to top:

- `protocol`: frames, data types, NMT, state machine, SDO client; no file, no device.
- `config`: the bus file, EDS files, units; the nodes of the bus and their limits.
- `wire`: transports of frames (python-can, local socket) and logs of them.
- `master`: `ArmBus`, one object that owns the bus; no thread and no clock of its own.
- `process`: the bus in a process of its own, with its real-time loop and mailboxes.
- `analysis`: decoded logs and their figures; a log in place of the bus.
- `sim`: simulated nodes, in lock step or as a process.

Two processes: the diagram's and the bus's. Time-stamped setpoints go to the bus through
a pipe, feedback and measured joint states come back through shared memory; the diagram
never blocks the bus.
"""
