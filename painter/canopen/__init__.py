"""The robot's bus: CiA 301/402/401 master, units, and simulated drives; no Drake."""
