"""PIC and PIT under uniform gravity, for scenes of up to some hundred discs; nothing else imports this package."""
