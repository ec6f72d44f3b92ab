"""What commands have in common: options from a declaration, output, progress, exit codes, the command again."""
