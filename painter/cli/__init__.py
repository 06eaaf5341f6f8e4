"""The painter command; one file a subcommand."""
