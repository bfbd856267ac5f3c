"""Parts that both commands share: parser, exit statuses, error line, shell completion."""
