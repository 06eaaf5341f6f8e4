"""Running a paint cycle on either body: simulate, deploy, pre-flight, log, write.

The only room that advances a simulator and writes a run folder from it.
"""
