"""The verbs of the command ``diagnose``, one module each; what is heavy is imported when a verb runs."""
