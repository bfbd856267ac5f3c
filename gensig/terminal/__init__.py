"""What both commands share: exit statuses, one line for a mistake, shell completion."""
