"""The bus in a process of its own: loop, mailboxes, clocks.

The only room that sets priorities or sleeps.
"""
