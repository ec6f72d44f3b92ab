"""The checks: functions of a subject that return nothing, raise a `Violation`, or say why they do not apply."""
