"""The bus in a process of its own: loop, mailboxes, clocks.

The only room of the bus that sets priorities or sleeps.
"""
