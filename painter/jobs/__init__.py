"""Whole jobs, one a file: what a command does, and what a notebook calls by `painter`.

A job takes values or paths, calls the rooms below it and returns values, or writes a
folder. It neither parses options nor prints; the algorithms live in the rooms below.
"""
