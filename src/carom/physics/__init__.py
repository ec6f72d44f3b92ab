"""The pure physics: time of impact and impact law. Everything here is a function of its arguments alone."""
