"""The `painter` command; one file a subcommand: parsing and one call.

`main.py` finds the command and maps errors to exit status, `common.py` holds shared
options.
"""
