"""The `painter` command: one file a subcommand, which parses and makes one call.

`main.py` finds the command and maps errors to exit status, `common.py` holds shared
options. What a command does lives in the room that owns it, and is imported inside the
command's function: `--help` and a TAB load neither Drake nor Open3D.
"""
