"""PIC and PIT under uniform gravity, for up to some hundred discs; a scene without it imports nothing of this."""
