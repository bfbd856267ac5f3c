"""The verbs of the command ``diagnose``, one module each.

What is heavy is imported when a verb runs.
"""
