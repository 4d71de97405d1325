"""The subcommands: their options, and help that teaches by example. What they do loads when they are called."""
