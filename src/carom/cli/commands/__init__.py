"""The commands of `carom`, a module each: options and arguments in, a call, and what is printed."""
