"""Running a paint cycle on either body: preflight, simulate, deploy, log, write.

The only room that advances a simulator and writes a run folder from it.
"""
